"""One robot under a supervisor: the robot that the loop runs, and its controller.

Only what the supervisor allows is sent to the actuators. Every packet feeds their watchdogs. So
with torque on, packets are sent only in a tick with a decision: the controller's, or to stand still
(for the actuators, before torque goes off, or for one tick at half pace); the supervisor is asked
about each. Goals move at a limited speed, so that neither the first command nor a broken controller
makes a joint jump.

Torque comes on with the joints where they are. They approach the first command slowly, all
together, and the controller's time stands still meanwhile. If all joints can reach it in one tick
there is no approach.

After the bus was lost no goal is sent until an arm event. Then all servos are checked again and
goals are set to the present positions, as at the first arm event.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from antennate.errors import reason
from antennate.hardware.actuators import ActuatorError, Actuators
from antennate.hardware.esp32.board import Board, BoardReader
from antennate.hardware.joints import CommandError
from antennate.hardware.safety import deadlines
from antennate.hardware.safety.causes import Cause
from antennate.hardware.safety.controller import SupervisedController
from antennate.hardware.safety.imu import ImuDiagnosis
from antennate.hardware.safety.signal_quality import SignalQuality
from antennate.hardware.safety.supervisor import Inputs, Outputs, Supervisor
from antennate.hardware.timing import LoopTiming
from antennate.params.safety import SupervisorParams
from antennate.types import AntennaFrame, Clock, Controller, JointCommand, State
from dynamixel_bus.port import PortError


@dataclass(slots=True)
class Orders:
    """What the operator wants.

    Attributes:
        arm: Torque on; only the change to True counts.
        stop: Torque off.
        released: No walk, as no key is held.
    """

    arm: bool = False
    stop: bool = False
    released: bool = False


@dataclass(slots=True)
class Tally:
    """Ticks run, commands sent to the actuators, and goals that moved slower than asked."""

    ticks: int = 0
    sent: int = 0
    limited: int = 0


class Session:
    """A robot under a supervisor; `run_loop(session, session.control, ...)`. For one thread.

    Attributes:
        period: Control period [s].
        quality: What the readings of the antennae are worth.
        imu: What those of the inertial sensor are worth, None without one.
        control: The controller under supervision.
        orders: Read in every tick.
        outputs: The supervisor's of the last tick, None before the first.
        timing: Whether the loop keeps its pace, None before the first tick.
        frame: What the controller got in the last tick.
        lost: Whether the actuators were lost; no goal is sent until an arm event.
        touched: Whether anything was written to the actuators.
        approaching: Whether the joints are on their way to the first command since torque came on.
        unrecorded: Whether a record that is required is not kept; the robot holds meanwhile.
        note: What its controller tells a person, for the status line.
        events: What began or ended with this tick, of a protocol.
        unfit: What of the robot's own description speaks against torque, in words; set by
            `prepare`, empty if nothing does.
    """

    def __init__(
        self,
        board: Board,
        actuators: Actuators,
        clock: Clock,
        controller: Controller,
        period: float,
        quality: SignalQuality,
        limits: SupervisorParams | None = None,
    ) -> None:
        self.board, self.actuators, self.clock = board, actuators, clock
        self.period, self.quality = period, quality
        self.control = SupervisedController(controller, actuators.robot, actuators.check, clock.now)
        self._limits = limits or SupervisorParams()
        deadlines.require_order(self._limits, period)
        self.supervisor = Supervisor(self._limits)
        self.reader = BoardReader(board, clock)
        self.orders, self.tally = Orders(), Tally()
        self.timing: LoopTiming | None = None
        self.outputs: Outputs | None = None
        self._angles = (math.nan,) * len(actuators.robot.ids)
        robot = actuators.robot
        self.imu = ImuDiagnosis(robot.imu) if robot.has_imu else None
        self.frame = self._frame(0.0, [math.nan, math.nan])
        self._slow = period * min(1.0, self._limits.approach / max(actuators.robot.fastest))
        self._fresh = self.approaching = False
        self.lost = self.touched = self.unrecorded = False
        self.unfit = self.note = ""
        self.events: tuple[str, ...] = ()

    @property
    def mute(self) -> bool:
        """Whether no actuator answers: bus, adapter or power is gone."""
        return self.actuators.state.silent(self._limits.late_answers)

    def read(self) -> AntennaFrame:
        """The newest reading; NaN if it is not good or while the supervisor stops the gait."""
        now, out, control = self.clock.now(), self.outputs, self.control
        self.events = ()
        if self.timing is None:
            self.timing = LoopTiming(now, self.period)
        self.timing.begin(now)
        t = self._feel()
        counts = self.quality.counts if out is not None and out.clear else [math.nan, math.nan]
        self._mark("read")
        empty = out is not None and any(a.cause is Cause.SUPPLY_WARN for a in out.causes)
        control.standing = self.actuators.resting or self.approaching
        control.rate = self._limits.slow_rate if empty else 1.0
        self.frame = self._frame(control.time(t), counts)
        return self.frame

    def _frame(self, t: float, counts: list[float]) -> AntennaFrame:
        """These readings, and what else the robot feels now."""
        parts = np.array([t]), np.array([counts]), np.array([self._angles])
        if self.imu is None:
            return AntennaFrame(*parts)
        motion = np.array([self.imu.angular_velocity, self.imu.linear_acceleration])
        if self.control.rate < 1.0:  # it is not asked in every tick, so its sum would be no turn
            motion[:] = math.nan
        return AntennaFrame(*parts, *motion)

    def _feel(self) -> float:
        """Judge the newest reading of the board: its time [s]."""
        t, counts = self.reader.read()
        self.quality.step(t, counts[0].tolist(), self.control.decision.contact)
        if self.imu is not None:
            self.imu.step(t, self.reader.imu)
            self.imu.misses = self.reader.misses
        return t

    def write(self, command: JointCommand) -> None:
        """Let the supervisor decide on this tick, carry that out, then read the actuators."""
        self._mark("decide")
        self.tally.ticks += 1
        self._decide(command)
        self._angles = self.actuators.state.angles
        self._mark("bus")
        if self.timing is not None:
            self.timing.finish(self.clock.now())

    def _mark(self, stage: str) -> None:
        if self.timing is not None:
            self.timing.mark(stage, self.clock.now())

    def _decide(self, command: JointCommand) -> None:
        """Ask the supervisor, do what it allows, look at the actuators."""
        now, actuators = self.clock.now(), self.actuators
        out = self.outputs = self.supervisor.step(now, self._inputs(now))
        try:
            if out.arming:
                self.touched = True
                actuators.enable(command)
                self._fresh, self.approaching = self._slow < self.period, False
                self.lost = False
            elif out.feed_watchdog and actuators.enabled and not self.lost:
                self._move(out, command)
            if not out.torque and actuators.enabled:
                actuators.disable()
            elif not actuators.enabled and actuators.left_on:
                actuators.disable(again=True)
        except (PortError, CommandError, ActuatorError) as error:
            actuators.state.bus_error = reason(error)
            self.lost |= not isinstance(error, CommandError)
            return
        if out.feed_watchdog or not out.torque:  # any packet would feed the watchdogs
            actuators.look()
        self.lost |= actuators.state.silent(self._limits.silent_answers)

    def _move(self, out: Outputs, command: JointCommand) -> None:
        """Send goals nearer to the command, or unchanged; after a fault nothing else begins."""
        actuators = self.actuators
        if out.state < State.FAULT:
            actuators.maintain(out.move)
        moves = out.move and not actuators.resting
        if moves and (self._fresh or self.approaching):
            near = self.period if self._fresh else self._slow
            self._fresh, self.approaching = False, actuators.away(command, near) > 0
        pace = self._slow if self.approaching else self.period
        slow = actuators.command(command if moves else None, pace)
        self.tally.limited += 0 if self.approaching else slow
        self.tally.sent += moves

    def release(self) -> list[int]:
        """Torque off, verified; returns ids that did not confirm it; each tick tells them again."""
        return self.actuators.disable()

    def stand(self, time: float) -> None:
        """Hold the last goals for a time [s], so that the robot comes to rest before a release.

        At most `deadlines.STAND`. The supervisor is asked in every tick, as while it walks: the
        decision is to stand still, and no key lets the robot walk any more.
        """
        now, self.orders.arm, self.orders.released = self.clock.now(), False, True
        due, end = now, now + min(time, deadlines.STAND)
        while self.actuators.enabled and not self.lost and self.clock.now() < end:
            due = max(due + self.period, self.clock.now())
            self.clock.sleep_until(due)
            self._feel()
            self.control.hold()
            self._decide(self.control.command)

    def _inputs(self, now: float) -> Inputs:
        clock, state, control = self.board.clock, self.actuators.state, self.control
        objections = (self.unfit, *self.quality.objections)
        return Inputs(
            age=clock.age(now),
            valid=self.reader.used,
            refused=self.reader.refused,
            findings=self.quality.findings,
            noise=self.quality.noise,
            decided_at=control.result.decided_at,
            maneuver=control.decision.maneuver,
            contact=control.decision.contact,
            bad_command=control.result.bad_command,
            failure=control.result.failure,
            resets=clock.resets,
            reset_reason="" if clock.last_reset is None else clock.last_reset.name,
            board_error=self.board.trouble,
            missed=state.missed,
            servo_errors=state.errors,
            bus_error=state.bus_error,
            watchdogs=state.watchdogs,
            disarmed=state.disarmed,
            supply=state.supply,
            behind=state.joints.behind,
            outside=state.joints.outside,
            leaps=state.joints.leaps,
            modes=state.modes,
            drift=self.quality.drifted,
            imu="" if self.imu is None else self.imu.fault,
            objections=() if self.actuators.enabled else tuple(filter(None, objections)),
            unrecorded=self.unrecorded,
            arm=self.orders.arm,
            stop=self.orders.stop,
            released=self.orders.released,
        )
