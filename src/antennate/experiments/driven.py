"""One whole tunnel trial by `drive`, and the same trial in pure simulation.

`drive` runs as it does on a robot: a dry run, an arm event, then `Session`, its supervisor, its
diagnosis of the antennae and its limit of the goals' speed, all through bytes, before the twin in
lock-step. Nothing of that exists in pure simulation. To compare the two from the first reading that
the controller gets, the simulation begins where the session stands then, and no later:

- its controller is first asked without readings, at the times at which the session's was;
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

from antennate.body import Clock
from antennate.controller import Arm
from antennate.experiments.tunnel import TunnelConfig
from antennate.experiments.twin import Watch
from antennate.hardware.driving.drive import DriveConfig, drive, prepare
from antennate.hardware.driving.report import Report
from antennate.hardware.driving.session import Session
from antennate.hardware.joints import Joints
from antennate.loop import run_loop
from antennate.params.layout import LayoutParams
from antennate.records import AntennaFrame, Floats, Ints, Pose
from antennate.sim.body import SimBody
from antennate.twin.lockstep import BoardPort, LockstepClock
from antennate.twin.robot import TwinRobot

_DRY_RUN = 0.5
"""Time before the arm event [s]."""


@dataclass(slots=True)
class Start:
    """Where a session stood when its controller got the first reading.

    Attributes:
        blind: Times of the ticks in which it got none [s].
        standing: Ticks of the physics by then.
        t: Time of that reading [s].
    """

    blind: list[float] = field(default_factory=list[float])
    standing: int = 0
    t: float = math.nan


@dataclass(slots=True)
class Walk:
    """Each tick from the first reading on.

    Attributes:
        readings: Time [s] and counts of the left and the right antenna, as the controller got them.
        maneuvers: What it decided.
        poses: What it asked for, as bytes.
        goals: What the servos were then sent [ticks].
        status: How the trial ended, as in `trials.csv`; empty if it was cut short.
    """

    readings: list[tuple[float, float, float]] = field(
        default_factory=list[tuple[float, float, float]]
    )
    maneuvers: list[int] = field(default_factory=list[int])
    poses: list[bytes] = field(default_factory=list[bytes])
    goals: list[tuple[int, ...]] = field(default_factory=list[tuple[int, ...]])
    status: str = ""

    def note(self, frame: AntennaFrame, maneuver: int, pose: Pose, goals: tuple[int, ...]) -> None:
        """Add a tick."""
        left, right = frame.counts[0].tolist()
        self.readings.append((float(frame.t[0]), left, right))
        self.maneuvers.append(maneuver)
        self.poses.append(b"".join(a.tobytes() for a in (pose.yaw, pose.leg, pose.antenna)))
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
    arm: Arm,
    trial: int,
    layout: LayoutParams,
    ticks: float = math.inf,
    wired: Callable[[DriveConfig, TwinRobot], Session] = in_process,
) -> Driven:
    """The trial by `drive`, until it is decided or for so many ticks.

    Args:
        config: The trial's world.
        arm: Its controller.
        trial: Its number.
        layout: Servos of the robot.
        ticks: Most ticks from the first reading on.
        wired: Puts a session before the twin.

    Raises:
        BringUpError: The servos did not come up.
    """
    watch, walk, start = Watch(config, arm, trial), Walk(), Start()
    period = config.controller.period
    robot = TwinRobot(watch.body, layout, period, boot_id=trial + 1, standing_noise=True)
    orders = DriveConfig(
        controller=arm, dry_run=_DRY_RUN, touch_check=False, layout=layout, mind=config.controller
    )
    session = wired(orders, robot)
    session.decider = watch.controller

    def on_tick(session: Session, now: float) -> None:
        t, counts = float(session.frame.t[0]), session.frame.counts
        if session.orders.stop:
            return
        if not walk.readings and np.isnan(counts).all():
            start.blind.append(t)
            return
        if not walk.readings:
            start.standing, start.t = round(watch.body.now() / period), t
        goals = tuple(servo.get("goal_position") for servo in robot.servos)
        walk.note(session.frame, int(watch.controller.maneuver[0]), session.pose, goals)
        more = watch.go_on(session.frame, session.pose)
        session.orders.stop = not more or len(walk.readings) >= ticks

    report = drive(session, orders, arm=True, on_tick=on_tick)
    walk.status = watch.status
    return Driven(walk, start, report)


def simulated_alike(
    config: TunnelConfig,
    arm: Arm,
    trial: int,
    layout: LayoutParams,
    start: Start,
    ticks: float = math.inf,
) -> Walk:
    """The trial in pure simulation, begun alike."""
    watch, walk = Watch(config, arm, trial), Walk()
    period, mind = config.controller.period, watch.controller
    for t in start.blind:
        mind.step(AntennaFrame(t=np.array([t]), counts=np.full((1, 2), math.nan)))
    body = _Begun(watch.body, layout, period, start)

    def go_on(frame: AntennaFrame, pose: Pose) -> bool:
        walk.note(frame, int(mind.maneuver[0]), pose, body.sent)
        return watch.go_on(frame, pose) and len(walk.readings) < ticks

    run_loop(body, mind, period, go_on)
    walk.status = watch.status
    return walk


class _Begun:
    """A simulated body whose joints were held for a while, and whose goals are those of servos.

    Attributes:
        sent: The newest goals [ticks].
    """

    def __init__(self, body: SimBody, layout: LayoutParams, period: float, start: Start) -> None:
        self._body, self._joints = body, Joints(layout)
        self._ahead = start.t - start.standing * period
        self.sent: tuple[int, ...] = ()
        self._frame: AntennaFrame | None = body.read()
        stood = np.rint(self._joints.positions(body.world(0).drives()))
        for tick in range(start.standing):
            self._send(stood)
            body.sleep_until((tick + 1) * period)
            self._frame = body.read()

    @property
    def clock(self) -> Clock:
        """The simulation's."""
        return self._body.clock

    def read(self) -> AntennaFrame:
        """Read, stamped in whole microseconds as by the board."""
        frame, self._frame = self._frame or self._body.read(), None
        t = 1e-6 * np.rint(1e6 * (frame.t + self._ahead))
        return AntennaFrame(t=t, counts=frame.counts)

    def write(self, pose: Pose) -> None:
        """Round, then command."""
        self._send(self._joints.ticks(pose))

    def _send(self, goals: Floats | Ints) -> None:
        self.sent = tuple(goals.astype(int).tolist())
        self._body.write(self._joints.pose(goals))
