"""One tunnel trial three ways: pure simulation, and hardware code against the twin in lock-step.

Servos take goals in whole ticks and the board stamps in whole microseconds, so the pure simulation
rounds both as well; nothing else differs, and every maneuver must be the same.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from lockstep import BoardPort, LockstepClock
from stated import stated

from antennate.control.loop import run_loop
from antennate.control.registry import make_controller
from antennate.experiments.tunnel.physics import TrialMonitor, TunnelConfig
from antennate.hardware.config import DriveConfig
from antennate.hardware.driving.connect import prepare
from antennate.hardware.driving.drive import drive
from antennate.hardware.driving.report import Report
from antennate.hardware.dynamixel import bringup
from antennate.hardware.dynamixel.actuators import DynamixelActuators
from antennate.hardware.esp32.board import Board, BoardReader
from antennate.hardware.joints import Joints
from antennate.hardware.safety import torque
from antennate.hardware.safety.deadlines import ANSWER
from antennate.hardware.safety.session import Session
from antennate.hardware.safety.signal_quality import SignalQuality
from antennate.params.control import ControlParams
from antennate.params.safety import SupervisorParams, TouchCheckParams
from antennate.sim.sim_robot import SimRobot
from antennate.sim.trial import draw_trial, scene_of
from antennate.twin.config import TwinConfig, watched
from antennate.twin.robot import TwinRobot
from antennate.types import AntennaFrame, Clock, Controller, JointCommand, Robot
from dynamixel_bus.answers import Timing
from dynamixel_bus.bus import Bus
from dynamixel_bus.port import Port

AT_ONCE = SupervisorParams(approach=20.0)
"""Walks as soon as it may, without a slow approach to where its gait begins."""
_WARM_UP = 2.0
"""Longest time until the board's clock is known [s]."""


@dataclass(frozen=True, slots=True)
class Decisions:
    """What was decided in a trial.

    Attributes:
        maneuvers: One a tick.
        counts: Readings of each tick [counts], two a tick.
        status: How the trial ended, as in `trials.csv`.
    """

    maneuvers: list[int]
    counts: list[tuple[float, float]]
    status: str


class Rounded:
    """A simulated body whose servos take whole ticks and whose board stamps microseconds."""

    def __init__(self, body: SimRobot, joints: Joints) -> None:
        self._body, self._joints = body, joints

    @property
    def clock(self) -> Clock:
        """The simulation's."""
        return self._body.clock

    def read(self) -> AntennaFrame:
        """Read, with the time rounded."""
        frame = self._body.read()
        return AntennaFrame(t=1e-6 * np.rint(1e6 * frame.t), counts=frame.counts)

    def write(self, command: JointCommand) -> None:
        """Round, then command."""
        self._body.write(self._joints.command(self._joints.ticks(command)))


class Watch:
    """The monitor of a trial, and what was decided.

    The robot was put where its servos tell the start of the gait, whatever their zeros are off.
    """

    def __init__(self, config: TunnelConfig, name: str, trial: int) -> None:
        period = config.control.period
        scene = scene_of(config)
        start = draw_trial(config, scene, trial, config.control.gait, period)
        self.body = SimRobot(1, config.robot, period, config.physics.timestep)
        self.body.load(0, start.world, start.chance)
        angles = start.world.drives()
        bias = np.pad(start.chance.joint_bias, (0, len(angles) - config.robot.yaw_count))
        start.world.place_drives(angles + bias)  # its servos tell the start of the gait
        self.controller = make_controller(name, config.control, config.robot)
        self.controller.reset(np.array([0]), start.phase)
        self._monitor = TrialMonitor(start.episode(config.time_limit), name)
        self.maneuvers: list[int] = []
        self.counts: list[tuple[float, float]] = []
        self.status = ""

    def go_on(self, frame: AntennaFrame, command: JointCommand) -> bool:
        """Note one tick; False once the trial has ended."""
        maneuver = int(self.controller.maneuver[0])
        self.maneuvers.append(maneuver)
        left, right = frame.counts[0].tolist()
        self.counts.append((left, right))
        failure = self.body.failures.get(0)
        self.status = self._monitor.tick(self.body.world(0), maneuver, failure) or ""
        return not self.status

    def decisions(self) -> Decisions:
        """All of it."""
        return Decisions(self.maneuvers, self.counts, self.status)


class Bare:
    """A board and, where there are some, actuators as a robot that nobody supervises."""

    def __init__(self, board: Board, actuators: DynamixelActuators | None, clock: Clock) -> None:
        self.clock, self.reader, self.actuators = clock, BoardReader(board, clock), actuators

    def read(self) -> AntennaFrame:
        t, counts = self.reader.read()
        return AntennaFrame(t=np.array([t]), counts=counts)

    def write(self, command: JointCommand) -> None:
        assert self.actuators is not None
        self.actuators.command(command)


@dataclass(frozen=True, slots=True)
class Stage:
    """A world with its control at the first tick of a trial.

    Attributes:
        body: The world.
        control: The controller, its phase that of the trial.
        period: Control period [s].
        go_on: For `run_loop`; False once the trial has ended.
        decisions: What was decided so far.
        robot: The twin, None in pure simulation.
    """

    body: Robot
    control: Controller
    period: float
    go_on: Callable[[AntennaFrame, JointCommand], bool]
    decisions: Callable[[], Decisions]
    robot: TwinRobot | None = None


def simulation(config: TunnelConfig, name: str, trial: int) -> Stage:
    """The trial in pure simulation, goals rounded to ticks."""
    watch = Watch(config, name, trial)
    body = Rounded(watch.body, Joints(config.robot))
    period = config.control.period
    return Stage(body, watch.controller, period, watch.go_on, watch.decisions)


def simulated(config: TunnelConfig, name: str, trial: int) -> Decisions:
    """The whole trial in pure simulation."""
    stage = simulation(config, name, trial)
    run_loop(stage.body, stage.control, stage.period, stage.go_on)
    return stage.decisions()


@dataclass(frozen=True, slots=True)
class Rig:
    """The whole of the hardware code in front of a twin, in invented time."""

    robot: TwinRobot
    clock: LockstepClock
    session: Session
    board_port: Any
    bus_port: Any


def rig(
    config: TwinConfig,
    name: str = "closed",
    touch: TouchCheckParams | None = None,
    cable: Callable[[Port], Port] = lambda port: port,
) -> Rig:
    """A session before a twin robot, not yet armed.

    Args:
        config: The twin.
        name: Name of its controller.
        touch: How it is checked by touch, None if it is not.
        cable: Wraps each port.
    """
    robot = watched(config)[0]
    params = ControlParams(**dict(config.control))
    clock = LockstepClock(robot)
    board_port, bus_port = cable(BoardPort(robot, clock)), cable(clock)
    bus = Bus(bus_port, Timing(config.robot.baud, latest=ANSWER), clock=clock.now)
    session = Session(
        board=Board(board_port, SupervisorParams().stale_age),
        actuators=DynamixelActuators(bus, Joints(config.robot), clock.now),
        clock=clock,
        controller=make_controller(name, params, config.robot),
        period=params.period,
        quality=SignalQuality(params.conditioning, touch=touch),
        limits=AT_ONCE,
    )
    return Rig(robot, clock, session, board_port, bus_port)


def before_twin(config: TunnelConfig, name: str, trial: int) -> Stage:
    """The hardware code before a twin, torque on.

    Raises:
        BringUpError: The servos did not come up.
    """
    watch = Watch(config, name, trial)
    period = config.control.period
    spec = config.robot
    robot = TwinRobot(watch.body, spec, period, boot_id=trial + 1)
    clock = LockstepClock(robot)
    board = Board(BoardPort(robot, clock), SupervisorParams().stale_age)
    bus = Bus(clock, Timing(spec.baud, latest=ANSWER), clock=clock.now)
    while board.newest(clock.now()) is None and clock.now() < _WARM_UP:
        clock.sleep(period)
        board.poll(clock.now)
    bringup.require(bus, {servo.get("id"): servo.model.number for servo in robot.servos})
    torque.arm_watchdogs(bus, spec.ids)
    clock.sleep_until(period * np.ceil(clock.now() / period + 1.0))
    torque.enable(bus, spec.ids)
    body = Bare(board, DynamixelActuators(bus, Joints(spec), clock.now), clock)
    return Stage(body, watch.controller, period, watch.go_on, watch.decisions, robot)


def on_twin(
    config: TunnelConfig,
    name: str,
    trial: int,
    on_tick: Callable[[TwinRobot], None] = lambda robot: None,
) -> Decisions:
    """The trial by the hardware code, all of it through bytes, in invented time.

    Args:
        config: The trial's world.
        name: Name of its controller.
        trial: Its number.
        on_tick: Called after every tick, for instance to break something.

    Raises:
        BringUpError: The servos did not come up.
    """
    stage = before_twin(config, name, trial)

    def go_on(frame: AntennaFrame, command: JointCommand) -> bool:
        if stage.robot is not None:
            on_tick(stage.robot)
        return stage.go_on(frame, command)

    run_loop(stage.body, stage.control, stage.period, go_on)
    return stage.decisions()


class Driven:
    """`drive` of a controller before a twin in lock-step; what it decided and sent, tick by tick.

    Args:
        controller: Its name.
        duration: For how long it walks [s].
    """

    def __init__(self, controller: str, duration: float = 3.0) -> None:
        robot = watched(TwinConfig())[0]
        clock = LockstepClock(robot)
        config = DriveConfig(robot=stated(), controller=controller, duration=duration)
        config = config.model_copy(update={"dry_run": 0.5, "touch_check": False})
        self.session = prepare(config, BoardPort(robot, clock), clock, clock)
        self.maneuvers: list[int] = []
        self.goals: list[tuple[int, ...]] = []

        def on_tick(session: Session, now: float) -> None:
            self.maneuvers.append(session.control.decision.maneuver)
            self.goals.append(tuple(servo.get("goal_position") for servo in robot.servos))

        self.report: Report = drive(self.session, config, True, on_tick)
