"""One traverse of the bench along a wall: flex and force at every tick, before any measure."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from antennate.antenna.statics import Profile, with_profile
from antennate.errors import SimulationError
from antennate.experiments.touch.config import MOVES, TouchConfig, reach, site
from antennate.robots.antenna import AntennaSpec
from antennate.sim import touch_wall
from antennate.sim.bench import Bench, Watch, compile_bench, unwatched
from antennate.sim.touch_wall import Site, WallKind
from antennate.types import Floats

RUN_UP = 0.5
"""Time in which the carriage starts off, before the first tick [s]."""


@dataclass(frozen=True, slots=True)
class Plan:
    """One traverse before it is run; chance depends on seed and trial alone.

    Attributes:
        wall, speed, profile, trial: Which one; speed in [m/s].
        springs: Drawn factors of the n springs, shape (n,); `antenna` has them.
        overlap: How far the straight tip would stand behind the surface [m].
        site: Where the wall stands; it begins at `wall_start` along the traverse [m].
    """

    config: TouchConfig
    wall: WallKind
    speed: float
    profile: Profile
    trial: int
    springs: Floats
    antenna: AntennaSpec
    overlap: float
    site: Site
    wall_start: float
    ticks: int

    def outline(self) -> list[Floats]:
        """Surface of the wall along the traverse, lines of shape (n, 2) [m]."""
        lines = touch_wall.outline(self.config.wall, self.wall, self.site)
        return [line + np.array([self.wall_start, 0.0]) for line in lines]


@dataclass(frozen=True, slots=True)
class Traverse:
    """One traverse as it came out of the engine, tick by tick.

    Attributes:
        x: Way of the carriage [m], shape (n,).
        flex: Summed hinge angles under the flex sensor [rad], shape (n,).
        force: Force of all obstacles on the antenna, mean over the tick [N], shape (n,).
        joints: Hinges and tip [m] in trial 0, shape (n, h + 1, 2); (0, h + 1, 2) in others.
        reason: Why the physics is invalid; empty if it is sound.
    """

    plan: Plan
    x: Floats
    flex: Floats
    force: Floats
    joints: Floats
    reason: str = ""


def plan(config: TouchConfig, wall: WallKind, speed: float, profile: Profile, trial: int) -> Plan:
    """One traverse with its draws."""
    rng = np.random.default_rng([config.seed, trial])
    shift, phase = rng.random(2)
    overlap = config.overlap + config.overlap_spread * rng.uniform(-1.0, 1.0)
    springs = 1.0 + config.spring_tolerance * rng.uniform(-1.0, 1.0, config.antenna.hinges)
    nominal = with_profile(config.antenna, profile)
    coils = tuple(float(c / f) for c, f in zip(nominal.active_coils, springs, strict=True))
    antenna = nominal.model_copy(update={"active_coils": coils})
    stands = site(antenna, overlap, config.wall_length, phase)
    return Plan(
        *(config, wall, speed, profile, trial, springs, antenna),
        overlap=reach(antenna) - stands.near,
        site=stands,
        wall_start=config.lead + config.free_length + shift * config.place_spread,
        ticks=1 + math.ceil(config.travel / speed * antenna.sensor.rate - 1e-9),
    )


def run_traverse(
    config: TouchConfig,
    wall: WallKind,
    speed: float,
    profile: Profile,
    trial: int,
    watch: Watch = unwatched,
) -> Traverse:
    """Move the antenna along the wall; trouble in the physics ends the traverse early."""
    one = plan(config, wall, speed, profile, trial)
    obstacles = touch_wall.build(config.wall, wall, one.site, one.wall_start)
    bench = Bench(compile_bench(config.physics, one.antenna, obstacles), one.antenna)
    ticks: list[tuple[float, float, float]] = []
    joints: list[Floats] = []
    reason = ""
    try:
        _start_off(bench, one)
        for tick in range(one.ticks):
            force = _advance(bench, one, (tick - 1) / one.antenna.sensor.rate) if tick else 0.0
            ticks.append((float(bench.carriage.position[0]), bench.flex(), force))
            watch(bench)
            if trial == 0:
                joints.append(bench.joints())
    except SimulationError as error:
        reason = str(error)
    x, flex, force = np.array(ticks).reshape(-1, 3).T
    shapes = np.array(joints).reshape(-1, one.antenna.hinges + 1, 2)
    return Traverse(one, x, flex, force, shapes, reason)


def _start_off(bench: Bench, one: Plan) -> None:
    """Reach x = 0 at full speed, from rest, at a steady acceleration."""
    base, speed = one.antenna.base_angle, one.speed
    bench.place(-speed * RUN_UP / 2, 0.0, base)
    moves = round(RUN_UP * one.antenna.sensor.rate) * MOVES
    for i in range(1, moves + 1):
        share = i / moves
        bench.command(speed * RUN_UP / 2 * (share**2 - 1.0), 0.0, share * speed, 0.0, base)
        bench.step(_steps(one))


def _advance(bench: Bench, one: Plan, since: float) -> float:
    """One tick on, `since` seconds after the first; the mean force in it [N]."""
    force = np.zeros(2)
    pace = 1.0 / (one.antenna.sensor.rate * MOVES)
    for i in range(1, MOVES + 1):
        x = one.speed * (since + i * pace)
        bench.command(x, 0.0, one.speed, 0.0, one.antenna.base_angle)
        force += bench.press(_steps(one)) / MOVES
    return float(np.linalg.norm(force))


def _steps(one: Plan) -> int:
    """Physics steps between two targets of the carriage."""
    return round(1.0 / (one.antenna.sensor.rate * MOVES * one.config.physics.timestep))
