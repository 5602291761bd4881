"""A walk on a flat floor, and what is measured on it: speed, yaw and the work it costs.

It runs through the same interface and loop as a trial, without a random part.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from antennate.control.gait import Gait
from antennate.control.loop import run_loop
from antennate.params.control import ControlParams, GaitParams
from antennate.params.scene import VariationParams
from antennate.robots.spec import RobotSpec
from antennate.sim.scenes.scene import FlatScene
from antennate.sim.sim_robot import Disturbance, SimRobot
from antennate.sim.trial import place_at_start
from antennate.sim.world import World, compile_world
from antennate.studies.columns import column, tabular
from antennate.telemetry.header import Header, log_name
from antennate.telemetry.simulated import Decisions, SimulatedLog
from antennate.types import AntennaFrame, Contact, Floats, JointCommand, Maneuver
from antennate_lab.gait.config import GaitStudyConfig


class MeteredWorld(World):
    """A world that adds up what its servos do.

    Attributes:
        work: Positive mechanical work of all servos so far [J].
    """

    work = 0.0

    def advance(self, count: int) -> None:
        """Advance by `count` physics steps; every one of them counts with its own power."""
        for _ in range(count):
            super().advance(1)
            self.work += self._positive_power() * self.model.opt.timestep

    def _positive_power(self) -> float:
        """Summed power of the servos that push, as the last step began [W].

        Torque falls with speed by the damping of the joint.
        """
        model, data = self.model, self.data
        slope = model.dof_damping[model.jnt_dofadr[model.actuator_trnid[:, 0]]]
        speed = data.actuator_velocity
        return float(np.maximum((data.actuator_force - slope * speed) * speed, 0.0).sum())


_STANDSTILL = 0.01
"""Robot lengths a cycle under which a cost of transport means nothing."""
_TINY = 1e-6
"""Rounding of tick times [s]."""


@dataclass(frozen=True, slots=True)
class Walk:
    """One walk on the flat floor, settling included.

    Attributes:
        name: A maneuver in small letters, `wave_off`, or `sweep` and its number.
        t: Times of the ticks [s], shape (n,).
        head: Plan positions of the head [m], shape (n, 2).
        centre: Mean of the links [m], shape (n, 2).
        heading: Direction from the rear three links to the front three [rad], shape (n,).
        work: Positive mechanical work of all servos since the start [J], shape (n,).
        weight: Weight of the robot [N].
        length: Robot length [m].
    """

    name: str
    gait: GaitParams
    t: Floats
    head: Floats
    centre: Floats
    heading: Floats
    work: Floats
    weight: float
    length: float


@tabular
class Speed:
    """How fast a walk is, over whole cycles."""

    speed_m_s: float = column("speed", "m/s", form="+.3f")
    """Mean speed of the centre along the body's mean axis; negative is backwards."""
    body_lengths_per_cycle: float = column("body lengths a cycle", form="+.2f")
    """Distance along this axis in body lengths per gait cycle; negative is backwards."""


@tabular
class Pace(Speed):
    """What a walk comes to over whole cycles."""

    yaw_deg_per_cycle: float = column("yaw a cycle", "deg", form="+.1f")
    """Turn of the body per gait cycle; positive is to the left."""
    cost_of_transport: float | None = column("cost of transport", form=".3f")
    """Positive mechanical work of all servos over weight times distance; `null` near standstill."""


def measure(walk: Walk, settling_cycles: int, cycles: int) -> Pace:
    """The pace of a walk after settling.

    Every tick starts one cycle, so that the phase at which a cycle is cut does not count.
    """
    period = 1.0 / walk.gait.frequency
    first, last = settling_cycles * period, (settling_cycles + cycles) * period
    start = walk.t[(walk.t > first - _TINY) & (walk.t < last - period - _TINY)]
    axis = _gain(walk.t, _integral(walk.t, walk.heading), start, period) / period
    moved = [_gain(walk.t, walk.centre[:, k], start, period) for k in range(2)]
    step = float((moved[0] * np.cos(axis) + moved[1] * np.sin(axis)).mean())
    yaw = float(_gain(walk.t, walk.heading, start, period).mean())
    work = np.interp([first, last], walk.t, walk.work)
    drag = float(work[1] - work[0]) / cycles / walk.weight
    moves = abs(step) > _STANDSTILL * walk.length
    return Pace(
        speed_m_s=step / period,
        body_lengths_per_cycle=step / walk.length,
        yaw_deg_per_cycle=math.degrees(yaw),
        cost_of_transport=drag / abs(step) if moves else None,
    )


def _integral(t: Floats, value: Floats) -> Floats:
    """Trapezoidal integral of `value` over t from its start, shape (n,)."""
    return np.concatenate([[0.0], np.cumsum((value[1:] + value[:-1]) / 2 * np.diff(t))])


def _gain(t: Floats, value: Floats, start: Floats, period: float) -> Floats:
    """Change of `value` over one period from each start."""
    return np.interp(start + period, t, value) - np.interp(start, t, value)


def rolling_speed(gait: GaitParams, robot: RobotSpec) -> float:
    """Speed of legs that roll on their longest radius, 2 pi f (R + e) [m/s]."""
    return 2.0 * math.pi * gait.frequency * (robot.leg_radius + robot.leg_eccentricity)


class _Fixed:
    """A control of one idea: always the same maneuver, whatever the antennae feel."""

    def __init__(
        self, gait: GaitParams, robot: RobotSpec, maneuver: Maneuver, period: float
    ) -> None:
        self._gait = Gait(gait, robot, 1, period)
        self.maneuver = np.array([int(maneuver)])
        self.contact = np.full((1, 2), int(Contact.UNKNOWN))
        self.level = np.full((1, 2), math.nan)

    @property
    def phase(self) -> Floats:
        return self._gait.phase

    def step(self, frame: AntennaFrame) -> JointCommand:
        return self._gait.step(self.maneuver)


LOGGED = "gait"
"""What stands for the controller in the log of a walk: a maneuver that nobody decides."""


Watch = Callable[[World, AntennaFrame], None]
"""Takes world and frame after each tick."""


def walk_flat(
    config: GaitStudyConfig,
    name: str,
    gait: GaitParams,
    maneuver: Maneuver,
    watch: Watch = lambda world, frame: None,
    logs: Path | None = None,
) -> Walk:
    """Walk one maneuver on the flat floor from a straight start; `logs` is a folder for its log."""
    robot, period = config.robot, 1.0 / config.rate
    scene = FlatScene().draw(robot, np.random.default_rng(0))
    world = MeteredWorld(compile_world(config.physics, robot, scene), robot)
    place_at_start(world, scene, gait)
    body = SimRobot(1, robot, period, config.physics.timestep)
    body.load(0, world, _no_chance(robot, period))
    end = (config.settling_cycles + config.cycles) / gait.frequency
    ticks: list[tuple[float, Floats, float]] = []
    control = _Fixed(gait, robot, maneuver, period)
    decisions = Decisions(robot, control)

    def go_on(frame: AntennaFrame, command: JointCommand) -> bool:
        failure = body.failures.get(0)
        if failure is not None:
            raise failure
        if log is not None:
            log.take(decisions.take(frame, command))
        watch(world, frame)
        ticks.append((world.t, world.links(), world.work))
        return world.t < end - _TINY

    with contextlib.ExitStack() as stack:
        log = (
            None
            if logs is None
            else stack.enter_context(_log(logs, config, name, world, decisions))
        )
        run_loop(body, control, period, go_on)
    links = np.array([tick[1] for tick in ticks])
    half = robot.links // 2
    axis = links[:, :half].mean(axis=1) - links[:, half:].mean(axis=1)
    return Walk(
        name=name,
        gait=gait,
        t=np.array([tick[0] for tick in ticks]),
        head=links[:, 0],
        centre=links.mean(axis=1),
        heading=np.unwrap(np.arctan2(axis[:, 1], axis[:, 0])),
        work=np.array([tick[2] for tick in ticks]),
        weight=float(world.model.body_mass.sum() * np.linalg.norm(world.model.opt.gravity)),
        length=config.length,
    )


def _log(
    folder: Path, config: GaitStudyConfig, name: str, world: World, decisions: Decisions
) -> SimulatedLog:
    """The log of a walk, in place of what a killed run left of it."""
    path = folder / log_name(name)
    path.unlink(missing_ok=True)
    params = ControlParams(rate=config.rate, gait=config.gait)
    header = Header(controller=LOGGED, params=params, robot=config.robot)
    return SimulatedLog(path, header, world, decisions)


def _no_chance(robot: RobotSpec, period: float) -> Disturbance:
    """A disturbance that disturbs nothing; the control here does not look at sensor noise."""
    still = VariationParams(start_lateral=0, start_heading=0, joint_bias=0, slip_log_sd=0)
    return Disturbance(np.random.default_rng(0), still, robot, period)
