"""One robot driven from its bytes: what stands on both sides of the one loop.

It is the body, which reads the board and writes goals, and the control, a controller behind a
supervisor. Nothing reaches the servos but what the supervisor lets through. Any packet feeds their
watchdogs, and with torque on packets are sent only upon a decision of this very tick: the
controller's, or the session's own to stand still while legs forget their turns or for a moment
before a release, or to keep the command for one tick after a sound decision at half pace. Goals
move at a limited speed, so that neither the first command nor a broken controller lets one jump.

After the bus was lost no goal is sent until an arm event. With that one ids and models are checked,
watchdogs armed and goals set to where the servos stand, as with the first.
"""

from __future__ import annotations

import math

import numpy as np

from antennate.errors import AntennateError
from antennate.hardware.driving.body import HardwareRobot
from antennate.hardware.driving.decider import Decider, Decision, Thought, decision, nowhere
from antennate.hardware.driving.orders import Orders, Tally
from antennate.hardware.driving.timing import LoopTiming
from antennate.hardware.driving.tracebacks import Tracebacks, said
from antennate.hardware.driving.turns import Turns
from antennate.hardware.dynamixel import bringup
from antennate.hardware.dynamixel.bringup import BringUpError
from antennate.hardware.dynamixel.bus import Bus
from antennate.hardware.esp32.board import Board
from antennate.hardware.joints import CommandError, Joints, plain
from antennate.hardware.ports.port import PortError
from antennate.hardware.safety.causes import Cause, Inputs, Outputs, State
from antennate.hardware.safety.diagnosis import Band, ChannelDiagnosis
from antennate.hardware.safety.supervisor import Supervisor
from antennate.hardware.safety.trust import Trust
from antennate.hardware.safety.watch import ServoWatch
from antennate.params import BusParams, ConditioningParams, DiagnosisParams, SupervisorParams
from antennate.types import AntennaFrame, Clock, Floats, JointCommand, Maneuver

_AGAIN = BusParams().motion_budget
"""Time for the answers of servos told again in a tick to let go [s]."""


class Session:
    """A robot, its controller and its supervisor; for one thread.

    Args:
        board: The antennae.
        bus: The servos.
        joints: Which servo moves what.
        clock: The host's time.
        decider: The controller.
        period: Control period [s].
        conditioning: The calibrated range of both antennae.
        diagnosis: Windows and limits of the diagnosis.
        limits: Limits of the supervisor.
        trust: What is known of the antennae; they are not checked by touch if not given.

    Attributes:
        orders: The operator's, read in every tick.
        outputs: The supervisor's of the last tick, None before the first.
        channels: Diagnosis of the left and the right antenna.
        watch: What the servos say.
        turns: How far legs have turned.
        tally: What was done.
        tracebacks: Of the controller.
        timing: Whether the loop keeps its pace, None before the first tick.
        frame: What the controller got in the last tick.
        command: What it said.
        decision: What it decided, whenever it was asked last without failing.
        touched: Whether anything was written to the servos.
        unrecorded: Whether a record that is required is not kept; the robot holds meanwhile.
        unreleased: Ids that did not confirm that their torque is off.
    """

    def __init__(
        self,
        board: Board,
        bus: Bus,
        joints: Joints,
        clock: Clock,
        decider: Decider,
        period: float,
        conditioning: ConditioningParams,
        diagnosis: DiagnosisParams | None = None,
        limits: SupervisorParams | None = None,
        trust: Trust | None = None,
    ) -> None:
        self.board, self.bus, self.joints, self.clock = board, bus, joints, clock
        self.decider, self.period = decider, period
        band = Band(conditioning.counts_low, conditioning.counts_high, conditioning.polarity)
        windows = diagnosis or DiagnosisParams()
        self.channels = [ChannelDiagnosis(windows, band) for _ in range(2)]
        self._limits = limits or SupervisorParams()
        self.supervisor = Supervisor(self._limits)
        self.watch = ServoWatch(bus, joints.ids, clock.now)
        self.trust = trust or Trust(conditioning)
        self.turns = Turns(bus, joints)
        self.orders = Orders()
        self.tally = Tally()
        self.tracebacks = Tracebacks()
        self.timing: LoopTiming | None = None
        self.outputs: Outputs | None = None
        self.frame = AntennaFrame(t=np.zeros(1), counts=np.full((1, 2), math.nan))
        self.command = nowhere()
        self.decision = Decision()
        self._body = HardwareRobot(board, bus, joints, clock)
        self._thought = Thought()
        self._goals: Floats | None = None
        self._command: JointCommand | None = None
        self._used = self._refused = 0
        self._owed = 0.0
        self._sound = False
        self._lost = self.touched = self.unrecorded = False
        self.unreleased: list[int] = []

    @property
    def asked(self) -> bool:
        """Whether the controller was asked in the last tick."""
        return self._thought.asked

    @property
    def mute(self) -> bool:
        """No servo answers: the bus, its adapter or the power of all servos is gone."""
        return self._dead(self._limits.late_answers)

    def _dead(self, missed: int) -> bool:
        return bool(self.watch.bus_error) or min(self.watch.missed.values()) >= missed

    # the body

    def read(self) -> AntennaFrame:
        """The newest reading, diagnosed; NaN while the supervisor wants the gait to stand still."""
        now = self.clock.now()
        if self.timing is None:
            self.timing = LoopTiming(now, self.period)
        self.timing.begin(now)
        before = sum(self.board.clock.verdicts.values())
        frame = self._body.read()
        self._used = self._body.used
        self._refused = sum(self.board.clock.verdicts.values()) - before - self._used
        t = float(frame.t[0])
        raw = frame.counts[0].tolist()
        found = [channel.step(t, c) for channel, c in zip(self.channels, raw, strict=True)]
        self.trust.step(t, raw, found, self.decision.contact)
        counts = [reading.counts for reading in found]
        if self.outputs is None or not self.outputs.clear:
            counts = [math.nan, math.nan]
        self._mark("read")
        self.frame = AntennaFrame(
            t=self.turns.time(frame.t, self._rate()), counts=np.array([counts])
        )
        return self.frame

    def _rate(self) -> float:
        """How fast the controller's time goes, 1 as the clock: slower while the supply is low."""
        causes = () if self.outputs is None else self.outputs.causes
        empty = any(active.cause is Cause.SUPPLY_WARN for active in causes)
        return self._limits.slow_rate if empty else 1.0

    def write(self, command: JointCommand) -> None:
        """Let the supervisor judge this tick, and do what it says; then look at the servos."""
        self._mark("decide")
        self.command = command
        self._act(command)
        self._mark("bus")
        if self.timing is not None:
            self.timing.finish(self.clock.now())

    def _mark(self, stage: str) -> None:
        if self.timing is not None:
            self.timing.mark(stage, self.clock.now())

    def _act(self, command: JointCommand) -> None:
        now = self.clock.now()
        self.outputs = out = self.supervisor.step(now, self._inputs(now))
        self.tally.ticks += 1
        try:
            if out.arming:
                self._arm(command)
            elif out.feed_watchdog and self._goals is not None and not self._lost:
                self._forget_turns(out)
                self._send(command if out.move and not self.turns.standing else None)
            if not out.torque and self._goals is not None:
                self.release()
            elif self._goals is None and self.unreleased:
                self._release_again()
        except (PortError, CommandError, BringUpError) as error:
            self.watch.bus_error = str(error)
            self._lost |= not isinstance(error, CommandError)
            return
        self.watch.loose = self.turns.loose
        if out.feed_watchdog or not out.torque:  # any packet would feed the watchdogs
            self.watch.step()
        self._lost |= self._dead(self._limits.silent_answers)

    # the control

    def step(self, frame: AntennaFrame) -> JointCommand:
        """The controller's command; an exception of it is a cause, not the end.

        While legs forget their turns the controller is not asked, and its time stands still: to
        stand is the session's own decision. So it is to go slowly, which leaves out single ticks,
        but none after a failure.
        """
        due = self._due() or not self._sound
        thought = self._thought = Thought()
        if self._command is not None and (self.turns.standing or not due):
            thought.asked, thought.decided_at = False, self.clock.now()
            return self._command
        self._sound = False
        try:
            own = AntennaFrame(t=frame.t.copy(), counts=frame.counts.copy())
            command = self.decider.step(own)  # which it may change
            self.decision = decision(self.decider)
        except KeyboardInterrupt:
            raise
        except BaseException as error:  # noqa: BLE001 a plugged-in controller may raise anything
            thought.failure = said(error)
            self.tracebacks.keep(self.clock.now(), error)
            return nowhere()
        thought.decided_at = self.clock.now()
        try:
            command = plain(command)
            self.joints.ticks(command)
        except CommandError as error:
            thought.bad_command = str(error)
            self.tally.refused += 1
        else:
            self._command = command
            self._sound = self.decision.maneuver in set(Maneuver)
        return command

    def _due(self) -> bool:
        """Whether a period of the controller's own time has passed; call once a tick."""
        self._owed += self._rate()
        if self._owed < 1.0:
            return False
        self._owed -= 1.0
        return True

    def release(self) -> list[int]:
        """Torque off, verified: ids that did not confirm it; they are told again in each tick."""
        self._goals = None
        self.turns.reset()
        self.watch.arm(False)
        self.unreleased = []
        for group in self.joints.in_order_of_release:
            try:
                self.unreleased += bringup.disable(self.bus, group)
            except Exception as error:  # noqa: BLE001 the next group has its turn whatever happens
                self.unreleased += group
                self.tracebacks.keep(self.clock.now(), error)
        return list(self.unreleased)

    def _release_again(self) -> None:
        """One short try at those that did not confirm."""
        self.unreleased = bringup.disable(self.bus, self.unreleased, 1, _AGAIN)

    def stand(self, time: float) -> None:
        """Hold the last goals for a time [s], so that the robot comes to rest before a release.

        Raises:
            PortError: The bus is gone.
        """
        end = self.clock.now() + time
        while self._goals is not None and not self._lost and self.clock.now() < end:
            self._body.send(self._goals)
            self.clock.sleep_until(self.clock.now() + self.period)

    def _inputs(self, now: float) -> Inputs:
        clock, watch, thought = self.board.clock, self.watch, self._thought
        left, right = self.channels
        return Inputs(
            age=clock.age(now),
            valid=self._used,
            refused=self._refused,
            findings=(left.reading.finding, right.reading.finding),
            decided_at=thought.decided_at,
            maneuver=self.decision.maneuver,
            contact=self.decision.contact,
            bad_command=thought.bad_command,
            failure=thought.failure,
            resets=clock.resets,
            reset_reason="" if clock.last_reset is None else clock.last_reset.name,
            board_error=self.board.trouble,
            missed=watch.missed,
            servo_errors=watch.errors,
            bus_error=watch.bus_error,
            watchdogs=watch.watchdogs,
            disarmed=watch.disarmed,
            supply=watch.supply,
            drift=self.trust.drifted,
            objections=() if self._goals is not None else self.trust.objections,
            unrecorded=self.unrecorded,
            arm=self.orders.arm,
            stop=self.orders.stop,
        )

    def _arm(self, command: JointCommand) -> None:
        """Torque on where everything stands, for all servos or for none."""
        self.touched = True
        try:
            self._goals = self._enable(command)
        except AntennateError:
            self.release()
            raise
        self.unreleased = []
        self.watch.arm(True)
        self._lost = False

    def _enable(self, command: JointCommand) -> Floats:
        """Torque on: where everything stands [ticks]; legs count their turns from there."""
        bus, ids = self.bus, self.joints.ids
        self.turns.reset()
        bringup.require_models(bus, self.joints.models)
        bringup.arm_watchdogs(bus, ids)
        bringup.limit_speed(bus, self.joints.profiles)
        stood = bringup.hold_here(bus, ids)
        self.joints.align(np.array([stood[servo] for servo in ids], float), command)
        present = bringup.enable(bus, ids)
        return np.array([present[servo] for servo in ids], float)

    def _forget_turns(self, out: Outputs) -> None:
        """A tick's share of it; after a fault a leg without torque waits for an arm event."""
        if self._goals is None or out.state >= State.FAULT:
            return
        if out.move:
            self.turns.begin(self._goals)
        self.turns.step(self._goals, self.watch.positions, out.move)

    def _send(self, command: JointCommand | None) -> None:
        """Goals one tick nearer to a command; where they are without one."""
        goals = self._goals
        if goals is None:
            return
        if command is not None:
            reach = self.joints.reach(self.period)
            wanted = self.joints.ticks(command) - goals
            self.tally.limited += int((abs(wanted) > reach).sum())
            goals = goals + np.clip(wanted, -reach, reach)
            self.tally.sent += 1
        self._body.send(goals)
        self._goals = goals
