"""One traverse of the bench along a wall: what decides it, flex and force at every tick."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field, model_validator

from antennate.antenna.statics import Profile, with_profile
from antennate.errors import SimulationError
from antennate.params.base import Params, number, require_different, require_whole_steps
from antennate.params.bench import TouchWallsParams
from antennate.params.control import ConditioningParams, RuleParams
from antennate.params.scene import BenchPhysicsParams
from antennate.robots.antenna import AntennaSpec, require_own_curve
from antennate.sim import touch_wall
from antennate.sim.bench import Bench, compile_bench
from antennate.sim.touch_wall import WALLS, Site, WallKind
from antennate.types import Floats

MOVES = 5
"""Updates of the carriage's target in one tick."""
_Speed = Annotated[float, Field(ge=0.002, le=1.0)]
_CLOSEST = 0.01
"""No wall comes nearer to the line of traverse [m]."""
_MOST_TICKS = 10**7
"""Most ticks of a study: more would not fit into memory."""
_CLEARANCE = 0.005
"""Free way between the straight antenna and what it must not touch yet [m]."""


def reach(antenna: AntennaSpec) -> float:
    """Distance of the straight antenna's tip from the line of traverse [m]."""
    return antenna.length * math.sin(antenna.base_angle)


def site(antenna: AntennaSpec, overlap: float, length: float, phase: float) -> Site:
    """Where a wall stands for an overlap [m]."""
    return Site(
        near=reach(antenna) - overlap,
        clear=reach(antenna) + antenna.radius + _CLEARANCE,
        top=antenna.length + antenna.radius + _CLEARANCE,
        length=length,
        phase=phase,
    )


class TouchConfig(Params):
    """Everything that decides the outcome of `bench touch`."""

    unread: ClassVar[tuple[str, ...]] = (
        "antenna.base_spacing",
        "rule.hold_forward",
        "rule.hold_time",
        "rule.similar",
        "rule.strong",
    )
    trials: int = number(5, "1", "assumed: a minute on two cores", ge=1, le=10000)
    """Trials of every wall, speed and profile."""
    seed: int = number(0, "1", "assumed: any", ge=0)
    """Seed of all chance."""
    walls: tuple[WallKind, ...] = number(WALLS, "1", "assumed: all", min_length=1)
    """Walls."""
    speeds: tuple[_Speed, ...] = number(
        (0.05, 0.10, 0.15), "m/s", "paper: calibration; its boulders ran at 0.008", min_length=1
    )
    """Speeds of the carriage."""
    profiles: tuple[Profile, ...] = number(
        ("stiff", "descending", "compliant"), "1", "paper: its three profiles", min_length=1
    )
    """Springs of the antenna: `descending` are antenna.active_coils as they are."""
    overlap: float = number(0.02, "m", "assumed: a sixth of the antenna", gt=0)
    """Mean of how far the tip would reach in."""
    overlap_spread: float = number(0.015, "m", "assumed: from a brush to a firm press", ge=0)
    """Half range of the overlap."""
    spring_tolerance: float = number(0.1, "1", "assumed: usual for wound springs", ge=0, lt=1)
    """Half range of a spring's factor."""
    wall_length: float = number(0.4, "m", "assumed: three antennae and more", ge=0.05, le=2)
    """Length of every wall."""
    free_length: float = number(0.08, "m", "assumed: free for half a second or more", ge=0.01, le=1)
    """Free way at both ends."""
    place_spread: float = number(0.02, "m", "assumed: more than a tick at any speed", ge=0, le=1)
    """Range of the wall's place."""
    contact_force: float = number(
        1e-4, "N", "assumed: a hundredth of the weight of a link", ge=0, le=10
    )
    """Mean force in a tick above which an obstacle presses."""
    merge_time: float = number(0.05, "s", "assumed: half of T_avg; 7.5 mm at 0.15 m/s", ge=0, le=10)
    """Gaps between presses shorter than this are contact."""
    averaging_times: tuple[Annotated[float, Field(gt=0, le=5)], ...] = number(
        (0.02, 0.05, 0.1, 0.15, 0.2, 0.3), "s", "assumed: a fifth of the default to three times it"
    )
    """Further T_avg to try on the same readings."""
    antenna: AntennaSpec = AntennaSpec()
    conditioning: ConditioningParams = ConditioningParams()
    rule: RuleParams = RuleParams()
    wall: TouchWallsParams = TouchWallsParams()
    physics: BenchPhysicsParams = BenchPhysicsParams()

    def example(self) -> tuple[WallKind, float]:
        """The wall and the speed [m/s] that are shown: a gap if there is one, the middle speed."""
        wall = "gap" if "gap" in self.walls else self.walls[0]
        return wall, sorted(self.speeds)[len(self.speeds) // 2]

    @property
    def lead(self) -> float:
        """Way of the straight tip ahead of the base [m]."""
        return self.antenna.length * math.cos(self.antenna.base_angle)

    @property
    def travel(self) -> float:
        """Way of every traverse [m]."""
        wall_and_lead = self.lead + self.place_spread + self.wall_length
        return wall_and_lead + self.antenna.length + 2 * self.free_length

    @model_validator(mode="after")
    def _agree(self) -> TouchConfig:
        for name in ("walls", "speeds", "profiles", "averaging_times"):
            require_different(name, getattr(self, name))
        rate, step = self.antenna.sensor.rate, self.physics.timestep
        require_whole_steps("antenna.sensor.rate", rate, step, MOVES)
        require_own_curve(self.antenna.sensor, "conditioning", self.conditioning)
        ticks = sum(self.travel / speed * self.antenna.sensor.rate for speed in self.speeds)
        ticks *= self.trials * len(self.walls) * len(self.profiles)
        if ticks > _MOST_TICKS:
            raise ValueError(
                f"trials: expected at most {_MOST_TICKS:,} ticks in all, found {ticks:,.0f}; ask "
                "for fewer trials, walls or profiles, or higher speeds"
            )
        self._walls_stand()
        return self

    def _walls_stand(self) -> None:
        """Every wall can be built at the smallest and the largest overlap."""
        low, high = self.overlap - self.overlap_spread, self.overlap + self.overlap_spread
        if low <= 0:
            raise ValueError(
                f"overlap_spread: expected less than overlap, {self.overlap:g} m, found "
                f"{self.overlap_spread:g} m"
            )
        for kind in self.walls:
            room = reach(self.antenna) - touch_wall.intrusion(self.wall, kind) - _CLOSEST
            if high > room:
                raise ValueError(
                    f"overlap: expected overlap and spread of at most {max(room, 0.0):.3g} m "
                    f"before the wall {kind}, whose antenna reaches {reach(self.antenna):.3g} m "
                    f"to the side, found {high:.3g} m"
                )
            for overlap in (low, high):
                place = site(self.antenna, overlap, self.wall_length, 0.0)
                touch_wall.outline(self.wall, kind, place)


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
        config,
        wall,
        speed,
        profile,
        trial,
        springs=springs,
        antenna=antenna,
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
