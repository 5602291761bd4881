"""One tunnel trial three ways: pure simulation, and hardware code against the twin in lock-step.

Servos take goals in whole ticks and the board stamps in whole microseconds, so the pure simulation
rounds both as well; nothing else differs, and every maneuver must be the same.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from antennate.control.controllers import Arm, Controller
from antennate.control.loop import run_loop
from antennate.experiments.tunnel.monitor import TrialMonitor
from antennate.experiments.tunnel.passage import Passage
from antennate.experiments.tunnel.run import TunnelConfig, prepare
from antennate.hardware.driving.body import HardwareRobot
from antennate.hardware.driving.connect import DOUBT
from antennate.hardware.driving.session import Session
from antennate.hardware.dynamixel import bringup
from antennate.hardware.dynamixel.answers import Timing
from antennate.hardware.dynamixel.bus import Bus
from antennate.hardware.esp32.board import Board
from antennate.hardware.joints import Joints
from antennate.hardware.safety.trust import Trust
from antennate.params import Params, SupervisorParams, TouchCheckParams, number
from antennate.params.base import GATHERED
from antennate.params.twin import BatteryParams
from antennate.robots.layout import LayoutParams
from antennate.sim.sim_robot import SimRobot
from antennate.twin.lockstep import BoardPort, LockstepClock
from antennate.twin.robot import TwinRobot
from antennate.twin.touch import TouchStimulus
from antennate.types import AntennaFrame, Clock, JointCommand, Robot

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


class TwinConfig(Params):
    """The robot and its world that `antennate twin` serves."""

    trial: int = number(0, "1", "assumed: the first", "trial of the world's seed", ge=0)
    duration: float | None = number(
        None, "s", "assumed: until it is stopped", "time to serve", gt=0
    )
    fault: Annotated[tuple[str, ...], GATHERED] = number(
        (), "1", "assumed: nothing is broken", "faults, such as servo:7=silent@3s"
    )
    touch: Annotated[tuple[str, ...], GATHERED] = number(
        (),
        "1",
        "assumed: nobody is there",
        "antennae touched before it walks, such as left@2s; from the first packet on the bus",
    )
    battery: BatteryParams = BatteryParams()
    layout: LayoutParams = LayoutParams()
    world: TunnelConfig = TunnelConfig()


def build(config: TwinConfig, boot_id: int | None = None) -> TwinRobot:
    """The robot at the start of a tunnel; each start of a real board has a boot id of its own."""
    return watched(config, boot_id)[0]


def watched(config: TwinConfig, boot_id: int | None = None) -> tuple[TwinRobot, Passage]:
    """The same, and how far it comes."""
    world, start = config.world, prepare(config.world, config.trial)
    period = world.control.period
    body = SimRobot(1, world.robot.sensor, period, world.physics.timestep)
    body.load(0, start.world, start.chance)
    boot = config.trial + 1 if boot_id is None else boot_id
    touch, passage = TouchStimulus(config.touch, world.control.conditioning), Passage(start.tunnel)
    robot = TwinRobot(
        body,
        config.layout,
        period,
        boot,
        standing_noise=True,
        touch=touch,
        watch=passage.watch,
        battery=config.battery,
    )
    return robot, passage


class _Rounded:
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
    """The monitor of a trial, and what was decided."""

    def __init__(self, config: TunnelConfig, arm: Arm, trial: int) -> None:
        start = prepare(config, trial)
        period = config.control.period
        self.body = SimRobot(1, config.robot.sensor, period, config.physics.timestep)
        self.body.load(0, start.world, start.chance)
        self.controller = Controller(config.control, arm)
        self.controller.reset(np.array([0]), start.phase)
        self._judge = TrialMonitor(arm, trial, start.tunnel, config.time_limit)
        self.maneuvers: list[int] = []
        self.counts: list[tuple[float, float]] = []
        self.status = ""

    def go_on(self, frame: AntennaFrame, command: JointCommand) -> bool:
        """Note one tick; False once the trial has ended."""
        maneuver = int(self.controller.maneuver[0])
        self.maneuvers.append(maneuver)
        left, right = frame.counts[0].tolist()
        self.counts.append((left, right))
        failed = self.body.failure(0) is not None
        self.status = self._judge.watch(self.body.world(0), maneuver, failed) or ""
        return not self.status

    def decisions(self) -> Decisions:
        """All of it."""
        return Decisions(self.maneuvers, self.counts, self.status)


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


def simulation(config: TunnelConfig, arm: Arm, trial: int, layout: LayoutParams) -> Stage:
    """The trial in pure simulation, goals rounded to ticks."""
    watch = Watch(config, arm, trial)
    body = _Rounded(watch.body, Joints(layout))
    period = config.control.period
    return Stage(body, watch.controller, period, watch.go_on, watch.decisions)


def simulated(config: TunnelConfig, arm: Arm, trial: int, layout: LayoutParams) -> Decisions:
    """The whole trial in pure simulation."""
    stage = simulation(config, arm, trial, layout)
    run_loop(stage.body, stage.control, stage.period, stage.go_on)
    return stage.decisions()


@dataclass(frozen=True, slots=True)
class Rig:
    """The whole of the hardware code in front of a twin, in invented time."""

    robot: TwinRobot
    clock: LockstepClock
    session: Session


def rig(config: TwinConfig, arm: Arm = "closed", touch: TouchCheckParams | None = None) -> Rig:
    """A session before a twin robot, not yet armed; checked by touch if `touch` says how."""
    robot, params = build(config), config.world.control
    clock = LockstepClock(robot)
    session = Session(
        board=Board(BoardPort(robot, clock), SupervisorParams().stale_age),
        bus=Bus(clock, Timing(config.layout.baud, doubt=DOUBT), clock=clock.now),
        joints=Joints(config.layout),
        clock=clock,
        decider=Controller(params, arm),
        period=params.period,
        conditioning=params.conditioning,
        trust=Trust(params.conditioning, touch=touch),
    )
    return Rig(robot, clock, session)


def before_twin(config: TunnelConfig, arm: Arm, trial: int, layout: LayoutParams) -> Stage:
    """The hardware code before a twin, torque on.

    Raises:
        BringUpError: The servos did not come up.
    """
    watch = Watch(config, arm, trial)
    period = config.control.period
    robot = TwinRobot(watch.body, layout, period, boot_id=trial + 1)
    clock = LockstepClock(robot)
    board = Board(BoardPort(robot, clock), SupervisorParams().stale_age)
    bus = Bus(clock, Timing(layout.baud, doubt=DOUBT), clock=clock.now)
    while board.newest(clock.now()) is None and clock.now() < _WARM_UP:
        clock.sleep(period)
        board.poll(clock.now())
    bringup.require(bus, {servo.get("id"): servo.table.model for servo in robot.servos})
    bringup.arm_watchdogs(bus, layout.ids)
    clock.sleep_until(period * np.ceil(clock.now() / period + 1.0))
    bringup.enable(bus, layout.ids)
    body = HardwareRobot(board, bus, Joints(layout), clock)
    return Stage(body, watch.controller, period, watch.go_on, watch.decisions, robot)


def on_twin(
    config: TunnelConfig,
    arm: Arm,
    trial: int,
    layout: LayoutParams,
    on_tick: Callable[[TwinRobot], None] = lambda robot: None,
) -> Decisions:
    """The trial by the hardware code, all of it through bytes, in invented time.

    Args:
        config: The trial's world.
        arm: Its controller.
        trial: Its number.
        layout: Servos of the robot.
        on_tick: Called after every tick, for instance to break something.

    Raises:
        BringUpError: The servos did not come up.
    """
    stage = before_twin(config, arm, trial, layout)

    def go_on(frame: AntennaFrame, command: JointCommand) -> bool:
        if stage.robot is not None:
            on_tick(stage.robot)
        return stage.go_on(frame, command)

    run_loop(stage.body, stage.control, stage.period, go_on)
    return stage.decisions()
