"""One whole tunnel trial by `drive`, and the same trial in pure simulation.

`drive` runs as it does on a robot: a dry run, an arm event, then `Session`, its supervisor, its
diagnosis of the antennae and its limit of the goals' speed, all through bytes, before the twin in
lock-step. Nothing of that exists in pure simulation. To compare the two from the first reading that
the controller gets, the simulation begins where the session stands then, and no later:

- its controller is first given what the session's was before the physics began: no readings, or
  one of the standing twin;
- its physics runs the ticks that arming took, with every joint held where it stood;
- its goals are rounded to ticks, as servos take them.

From there on it runs alone, and shares nothing with the session but the trial's seed. The limit of
speed never acts: the twin's legs stand where its gait begins, and none is asked to be faster.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from lockstep import BoardPort, LockstepClock
from stated import stated
from twin_rig import Watch

from antennate.control.loop import run_loop
from antennate.experiments.tunnel.physics import TunnelConfig
from antennate.hardware.config import DriveConfig
from antennate.hardware.driving.connect import prepare
from antennate.hardware.driving.drive import drive
from antennate.hardware.driving.report import Report
from antennate.hardware.esp32.board import Board
from antennate.hardware.joints import Joints
from antennate.hardware.safety.session import Session
from antennate.robots.spec import RobotSpec
from antennate.sim.sim_robot import SimRobot
from antennate.twin.robot import TwinRobot
from antennate.types import AntennaFrame, Bools, Clock, Floats, Ints, JointCommand

_DRY_RUN = 0.5
"""Time before the arm event [s]."""


_NOTHING = AntennaFrame(t=np.full(1, math.nan), counts=np.full((1, 2), math.nan))


@dataclass(slots=True)
class Start:
    """Where a session stood when its controller got the first reading that the physics follows.

    Attributes:
        before: What it got until then.
        standing: Ticks of the physics before that reading.
        first: That reading; made by the standing twin, noise included, if `standing` is 0.
    """

    before: list[AntennaFrame]
    standing: int
    first: AntennaFrame


@dataclass(slots=True)
class Walk:
    """Each tick from the first reading on.

    Attributes:
        readings: Time [s] and counts of the left and the right antenna, as the controller got them.
        maneuvers: What it decided.
        commands: What it asked for, as bytes.
        goals: What the servos were then sent [ticks].
        status: How the trial ended, as in `trials.csv`; empty if it was cut short.
    """

    readings: list[tuple[float, float, float]] = field(
        default_factory=list[tuple[float, float, float]]
    )
    maneuvers: list[int] = field(default_factory=list[int])
    commands: list[bytes] = field(default_factory=list[bytes])
    goals: list[tuple[int, ...]] = field(default_factory=list[tuple[int, ...]])
    status: str = ""

    def note(
        self, frame: AntennaFrame, maneuver: int, command: JointCommand, goals: tuple[int, ...]
    ) -> None:
        """Add a tick."""
        left, right = frame.counts[0].tolist()
        self.readings.append((float(frame.t[0]), left, right))
        self.maneuvers.append(maneuver)
        self.commands.append(
            b"".join(a.tobytes() for a in (command.yaw, command.leg, command.antenna))
        )
        self.goals.append(goals)


@dataclass(frozen=True, slots=True)
class Driven:
    """A trial by `drive`.

    Attributes:
        walk: What happened.
        start: What a simulation needs to begin alike.
        report: What `drive` says of it.
    """

    walk: Walk
    start: Start
    report: Report


def in_process(orders: DriveConfig, robot: TwinRobot) -> Session:
    """A session before a twin in lock-step, with calls in place of wires."""
    clock = LockstepClock(robot)
    return prepare(orders, BoardPort(robot, clock), clock, clock)


def driven(
    config: TunnelConfig,
    name: str,
    trial: int,
    ticks: float = math.inf,
    wired: Callable[[DriveConfig, TwinRobot], Session] = in_process,
    phase: float = 0.0,
) -> Driven:
    """The trial by `drive`, until it is decided or for so many ticks.

    Args:
        config: The trial's world.
        name: Name of its controller.
        trial: Its number.
        ticks: Most ticks from the first reading on.
        wired: Puts a session before the twin.
        phase: Time that the loop begins later [s], which moves its ticks against the board's.

    Raises:
        BringUpError: The servos did not come up.
    """
    watch, walk, period = Watch(config, name, trial), Walk(), config.control.period
    robot = TwinRobot(watch.body, config.robot, period, boot_id=trial + 1, standing_noise=True)
    orders = DriveConfig(
        controller=name,
        dry_run=_DRY_RUN,
        touch_check=False,
        robot=stated(config.robot),
        control=config.control,
    )
    session = wired(orders, robot)
    control = session.control.controller = _Judged(
        watch, lambda: _taken(session.board) - robot.stood
    )
    session.clock.sleep_until(session.clock.now() + phase)

    def on_tick(session: Session, now: float) -> None:
        if control.first is None or session.orders.stop:
            return
        goals = tuple(servo.get("goal_position") for servo in robot.servos)
        walk.note(session.frame, int(control.maneuver[0]), session.control.command, goals)
        session.orders.stop = bool(watch.status) or len(walk.readings) >= ticks

    report = drive(session, orders, arm=True, on_tick=on_tick)
    walk.status = watch.status
    return Driven(walk, Start(control.before, control.standing, control.first or _NOTHING), report)


def simulated_alike(
    config: TunnelConfig,
    name: str,
    trial: int,
    start: Start,
    ticks: float = math.inf,
) -> Walk:
    """The trial in pure simulation, begun alike."""
    watch, walk = Watch(config, name, trial), Walk()
    period, control = config.control.period, watch.controller
    for frame in start.before:
        control.step(frame)
    body = _Begun(watch.body, config.robot, period, start)

    def go_on(frame: AntennaFrame, command: JointCommand) -> bool:
        walk.note(frame, int(control.maneuver[0]), command, body.sent)
        return watch.go_on(frame, command) and len(walk.readings) < ticks

    run_loop(body, control, period, go_on)
    walk.status = watch.status
    return walk


def _taken(board: Board) -> int:
    """The board's tick in which its newest sample was taken."""
    newest = board.clock.newest
    return -1 if newest is None else newest.sample.seq


class _Judged:
    """The controller of a trial, judged as in simulation: before its goals are sent.

    Args:
        watch: Controller and monitor.
        standing: Ticks of the physics before the newest reading; negative before it begins.

    Attributes:
        before: What it got before the first reading that the physics follows.
        standing: Ticks of the physics before that reading.
        first: That reading, None so far.
    """

    def __init__(self, watch: Watch, standing: Callable[[], int]) -> None:
        self._watch, self._standing = watch, standing
        control = watch.controller
        self.maneuver, self.contact, self.level = control.maneuver, control.contact, control.level
        self.before: list[AntennaFrame] = []
        self.standing = 0
        self.first: AntennaFrame | None = None

    def reset(self, rows: Ints | Bools, phase: Floats | float = 0.0) -> None:
        """Start the controller anew."""
        self._watch.controller.reset(rows, phase)

    def step(self, frame: AntennaFrame) -> JointCommand:
        """The command of this tick."""
        control = self._watch.controller
        command = control.step(frame)
        self.maneuver, self.contact, self.level = control.maneuver, control.contact, control.level
        if self.first is None:
            self.standing = self._standing()
            if self.standing < 0 or np.isnan(frame.counts).all():
                self.before.append(frame)
                return command
            self.first = frame
        if not self._watch.status:
            self._watch.go_on(frame, command)
        return command


class _Begun:
    """A simulated body whose joints were held for a while, and whose goals are those of servos.

    Attributes:
        sent: The newest goals [ticks].
    """

    def __init__(self, body: SimRobot, robot: RobotSpec, period: float, start: Start) -> None:
        self._body, self._joints = body, Joints(robot)
        self._ahead = float(start.first.t[0]) - start.standing * period
        self.sent: tuple[int, ...] = ()
        self._frame: AntennaFrame | None = self._stamped(body.read())
        angles = body.world(0).drives()
        bias = np.pad(body.joint_bias(0), (0, len(angles) - robot.yaw_count))
        stood = np.rint(self._joints.positions(angles - bias))
        for tick in range(start.standing):
            self._send(stood)
            body.sleep_until((tick + 1) * period)
            self._frame = self._stamped(body.read())
        if not start.standing:
            self._frame = start.first

    @property
    def clock(self) -> Clock:
        """The simulation's."""
        return self._body.clock

    def read(self) -> AntennaFrame:
        """Read; the first time what was read when it began."""
        frame, self._frame = self._frame or self._stamped(self._body.read()), None
        return frame

    def _stamped(self, frame: AntennaFrame) -> AntennaFrame:
        """Stamped in whole microseconds as by the board."""
        return AntennaFrame(
            t=1e-6 * np.rint(1e6 * (frame.t + self._ahead)),
            counts=frame.counts,
            angular_velocity=frame.angular_velocity,
            linear_acceleration=frame.linear_acceleration,
        )

    def write(self, command: JointCommand) -> None:
        """Round, then command."""
        self._send(self._joints.ticks(command))

    def _send(self, goals: Floats | Ints) -> None:
        self.sent = tuple(goals.astype(int).tolist())
        self._body.write(self._joints.command(goals))
