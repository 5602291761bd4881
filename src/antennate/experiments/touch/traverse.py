"""One traverse of the bench along a wall: flex and force at every tick, nothing judged yet."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from antennate.antenna import statics as mechanics
from antennate.antenna.statics import Profile
from antennate.errors import SimulationError
from antennate.params import BenchPhysicsParams, TouchWallsParams
from antennate.robots.antenna import AntennaSpec
from antennate.sim import touch_wall
from antennate.sim.bench import Bench, compile_bench
from antennate.sim.touch_wall import Site, WallKind
from antennate.types import Floats

CLEARANCE = 0.005
"""Free way between the straight antenna and what it must not touch yet [m]."""
RUN_UP = 0.5
"""Time in which the carriage starts off, before the first tick [s]."""
MOVES = 5
"""Updates of the carriage's target in one tick."""


@dataclass(frozen=True, slots=True)
class Draw:
    """What chance decides about a trial.

    Attributes:
        shift: Place of the wall beyond its first possible one [m].
        phase: Phase of a periodic wall, in turns.
        overlap: How far the straight tip would stand behind the surface [m].
        springs: Factors of the n springs, shape (n,).
    """

    shift: float
    phase: float
    overlap: float
    springs: Floats


@dataclass(frozen=True, slots=True)
class Plan:
    """One traverse in full.

    Attributes:
        antenna: The antenna with its drawn springs.
        kind: Kind of the wall; `walls` its dimensions.
        site: Where it stands; it begins at `wall_start` along the traverse [m].
        speed: Speed of the carriage [m/s].
        travel: Way from the first tick to the last [m].
    """

    antenna: AntennaSpec
    physics: BenchPhysicsParams
    walls: TouchWallsParams
    kind: WallKind
    site: Site
    wall_start: float
    speed: float
    travel: float

    @property
    def ticks(self) -> int:
        """Number of ticks."""
        return 1 + math.ceil(self.travel / self.speed * self.antenna.sensor.rate - 1e-9)


@dataclass(frozen=True, slots=True)
class Course:
    """What the engine says about a traverse, tick by tick.

    Attributes:
        x: Way of the carriage [m], shape (n,).
        flex: Summed hinge angles under the flex sensor [rad], shape (n,).
        force: Force of all obstacles on the antenna, mean over the tick [N], shape (n,).
        joints: Hinges and tip [m], shape (t, n + 1, 2); (0, n + 1, 2) if they were not kept.
        reason: Why the physics is invalid; empty if it is sound.
    """

    x: Floats
    flex: Floats
    force: Floats
    joints: Floats
    reason: str = ""


@dataclass(frozen=True, slots=True)
class Traverse:
    """One traverse as it came out of the engine.

    Attributes:
        wall, speed, profile, trial: Which one; speed in [m/s].
        course: What the engine says.
        overlap: Drawn overlap [m].
        outline: Surface of the wall along the traverse, lines of shape (n, 2) [m].
    """

    wall: WallKind
    speed: float
    profile: Profile
    trial: int
    course: Course
    overlap: float
    outline: list[Floats]


def reach(antenna: AntennaSpec) -> float:
    """Distance of the straight antenna's tip from the line of traverse [m]."""
    return antenna.length * math.sin(antenna.base_angle)


def site(antenna: AntennaSpec, overlap: float, length: float, phase: float) -> Site:
    """Where a wall stands for an overlap [m]."""
    return Site(
        near=reach(antenna) - overlap,
        clear=reach(antenna) + antenna.radius + CLEARANCE,
        top=antenna.length + antenna.radius + CLEARANCE,
        length=length,
        phase=phase,
    )


def with_springs(antenna: AntennaSpec, profile: str, factors: Floats) -> AntennaSpec:
    """The antenna with the springs of a profile, each off by its factor."""
    nominal = mechanics.with_profile(antenna, profile)
    coils = tuple(float(c / f) for c, f in zip(nominal.active_coils, factors, strict=True))
    return nominal.model_copy(update={"active_coils": coils})


def run_traverse(plan: Plan, keep_joints: bool) -> Course:
    """Move the antenna along the wall; trouble in the physics ends the course early."""
    model = compile_bench(
        plan.physics,
        plan.antenna,
        touch_wall.build(plan.walls, plan.kind, plan.site, plan.wall_start),
    )
    bench = Bench(model, plan.antenna)
    ticks: list[tuple[float, float, float]] = []
    joints: list[Floats] = []
    reason = ""
    try:
        _start_off(bench, plan)
        for tick in range(plan.ticks):
            force = _advance(bench, plan, (tick - 1) / plan.antenna.sensor.rate) if tick else 0.0
            ticks.append((float(bench.carriage.position[0]), bench.flex(), force))
            if keep_joints:
                joints.append(bench.joints())
    except SimulationError as error:
        reason = str(error)
    x, flex, force = np.array(ticks).reshape(-1, 3).T
    return Course(x, flex, force, np.array(joints).reshape(-1, plan.antenna.hinges + 1, 2), reason)


def _start_off(bench: Bench, plan: Plan) -> None:
    """Reach x = 0 at full speed, from rest, at a steady acceleration."""
    base, speed = plan.antenna.base_angle, plan.speed
    bench.place(-speed * RUN_UP / 2, 0.0, base)
    moves = round(RUN_UP * plan.antenna.sensor.rate) * MOVES
    for i in range(1, moves + 1):
        share = i / moves
        bench.command(speed * RUN_UP / 2 * (share**2 - 1.0), 0.0, share * speed, 0.0, base)
        bench.step(_steps(plan))


def _advance(bench: Bench, plan: Plan, since: float) -> float:
    """One tick on, `since` seconds after the first; the mean force in it [N]."""
    force = np.zeros(2)
    pace = 1.0 / (plan.antenna.sensor.rate * MOVES)
    for i in range(1, MOVES + 1):
        bench.command(
            plan.speed * (since + i * pace), 0.0, plan.speed, 0.0, plan.antenna.base_angle
        )
        force += bench.press(_steps(plan)) / MOVES
    return float(np.linalg.norm(force))


def _steps(plan: Plan) -> int:
    """Physics steps between two targets of the carriage."""
    return round(1.0 / (plan.antenna.sensor.rate * MOVES * plan.physics.timestep))
