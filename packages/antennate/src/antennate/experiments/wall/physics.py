"""One antenna along the boulder wall: what chance draws, the way of its base, what becomes of it.

Everything is defined before any run. The base comes in along the wall's normal until the straight
antenna would reach behind the crests by the overlap, then moves along the wall. A trial *jams* if
the tip advances less than `jam_advance` over some `jam_travel` of the base, *slips* if no sphere is
touched for longer than `slip_time`, and succeeds if it does neither over the whole travel. The same
is counted once more without the `start`. A trial that does both counts as a jam.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import ClassVar, Literal

import numpy as np
from pydantic import model_validator

from antennate.antenna.statics import PROFILES, Profile, with_profile
from antennate.params.base import Params, number, require_different
from antennate.params.bench import BenchVariationParams, WallParams
from antennate.params.scene import GRAVITY, BenchPhysicsParams
from antennate.robots.antenna import AntennaSpec, SensorParams
from antennate.sim.bench import Ball, Bench, Watch, compile_bench, unwatched
from antennate.studies.columns import CONDITION, column, tabular, tabular_row
from antennate.studies.pooling import largest, median
from antennate.types import Floats

COMMAND_PERIOD = 0.002
"""Time between commands to the carriage [s]."""


class WallConfig(Params):
    """Everything that decides the outcome of `bench wall`."""

    unread: ClassVar[tuple[str, ...]] = (
        "antenna.base_angle",
        "antenna.base_spacing",
        *(f"antenna.sensor.{n}" for n in SensorParams.model_fields if n != "active_length"),
    )
    trials: int = number(20, "1", "paper: 20 trials a profile", ge=1, le=10000)
    """Trials of every profile."""
    seed: int = number(1, "1", "assumed: any", ge=0)
    """Seed of all chance."""
    profiles: tuple[Profile, ...] = number(
        tuple(PROFILES), "1", "paper: its three; assumed: two controls it lacks", min_length=1
    )
    """Profiles to run."""
    wall: WallParams = WallParams()
    antenna: AntennaSpec = AntennaSpec()
    variation: BenchVariationParams = BenchVariationParams()
    physics: BenchPhysicsParams = BenchPhysicsParams()

    @model_validator(mode="after")
    def _sound(self) -> WallConfig:
        require_different("profiles", self.profiles)
        reach = self.antenna.length * math.sin(self.wall.base_angle)
        if self.wall.overlap + self.variation.overlap >= reach / 2:
            raise ValueError(
                f"wall.overlap must stay below half of the antenna's reach, {reach / 2:.4g} m, "
                f"found {self.wall.overlap:g} m"
            )
        if self.wall.travel <= max(self.wall.start + self.wall.jam_travel, self.wall.jam_travel):
            raise ValueError(
                f"wall.travel must exceed start and jam_travel together, "
                f"{self.wall.start + self.wall.jam_travel:g} m, found {self.wall.travel:g} m"
            )
        ratio = COMMAND_PERIOD / self.physics.timestep
        if abs(ratio - round(ratio)) > 1e-6 or round(ratio) < 1:
            raise ValueError(
                f"physics.timestep must divide {COMMAND_PERIOD:g} s, found "
                f"{self.physics.timestep:g}"
            )
        return self


Outcome = Literal["success", "jam", "slip", "invalid"]
SAMPLE_PERIOD = 0.01
"""Time between samples of a passage [s]."""


@tabular
class Measured:
    """What is measured of a passage; of many the median or the largest, of the valid ones."""

    least_advance_mm: float | None = column("least advance", "mm", median, default=None)
    """Smallest advance of the tip over any `jam_travel` of the base."""
    longest_stick_mm: float | None = column("longest stick", "mm", median, form=".1f", default=None)
    """Longest travel of the base during which the tip never got ahead by `jam_advance`."""
    longest_gap_s: float | None = column("longest gap", "s", median, default=None)
    """Longest time without touch after the first one."""
    touched: float | None = column(pool=median, default=None)
    """Share of samples that touch."""
    force_mean_n: float | None = column(
        "contact force, mean", "N", median, form=".3f", default=None
    )
    force_max_n: float | None = column("contact force, largest", "N", largest, default=None)
    flex_max_deg: float | None = column("flex, largest", "deg", largest, form=".0f", default=None)
    """Largest flex under the flex sensor."""
    hinge_max_deg: float | None = column(
        "angle of a hinge, largest", "deg", largest, form=".0f", default=None
    )
    """Largest angle of any one hinge, also of those beyond the flex sensor."""


@tabular_row
class WallTrial(Measured):
    """One trial, a row of trials.csv; what is measured is empty where it is invalid."""

    seed: int
    trial: int
    profile: str = field(metadata=CONDITION)
    outcome: Outcome
    """Success, jam, slip or invalid, over the whole travel."""
    outcome_after_start: Outcome
    """Success, jam, slip or invalid, without the start of the travel."""
    reason: str = ""


@dataclass(frozen=True, slots=True)
class Traverse:
    """Samples of one passage.

    Attributes:
        base: Travel of the base [m], shape (n,).
        tip: Advance of the tip along the wall since the travel began [m], shape (n,).
        touching: Whether a sphere is touched, shape (n,).
        force: Contact force [N], shape (n,).
        flex: Flex under the flex sensor [rad], shape (n,).
        hinges: Hinge angles [rad], shape (t, n).
        shapes: Hinges and tip in the plane [m], x from the crests on, at every tenth of the travel,
            shape (11, n + 1, 2).
        boulders: Middle and radius of each boulder in the same plane [m], shape (k, 3).
    """

    base: Floats
    tip: Floats
    touching: Floats
    force: Floats
    flex: Floats
    hinges: Floats
    shapes: Floats
    boulders: Floats


def classify(wall: WallParams, seed: int, trial: int, profile: str, seen: Traverse) -> WallTrial:
    """The outcome of a passage, by the definitions of `wall`."""
    advance = least_advance(seen.base, seen.tip, wall.jam_travel)
    gap = longest_gap(seen.touching, SAMPLE_PERIOD)
    late = seen.base > wall.start
    after = _outcome(
        wall,
        least_advance(seen.base[late], seen.tip[late], wall.jam_travel),
        longest_gap(seen.touching[late], SAMPLE_PERIOD, True),
    )
    return WallTrial(
        seed=seed,
        trial=trial,
        profile=profile,
        outcome=_outcome(wall, advance, gap),
        outcome_after_start=after,
        least_advance_mm=1e3 * advance,
        longest_stick_mm=1e3 * longest_stick(seen.base, seen.tip, wall.jam_advance),
        longest_gap_s=gap,
        touched=float(seen.touching.mean()),
        force_mean_n=float(seen.force.mean()),
        force_max_n=float(seen.force.max()),
        flex_max_deg=math.degrees(abs(seen.flex).max()),
        hinge_max_deg=math.degrees(abs(seen.hinges).max()),
    )


def invalid(config: WallConfig, profile: str, trial: int, reason: str) -> WallTrial:
    """What is told of a trial that has no passage."""
    place = {"seed": config.seed, "trial": trial, "profile": profile, "reason": reason}
    return WallTrial(outcome="invalid", outcome_after_start="invalid", **place)


def least_advance(base: Floats, tip: Floats, travel: float) -> float:
    """Smallest advance of the tip over any such travel of the base; all in m, shapes (n,)."""
    ends = np.searchsorted(base, base + travel - 1e-9)
    begins = np.flatnonzero(ends < len(base))
    return float((tip[ends[begins]] - tip[begins]).min())


def longest_stick(base: Floats, tip: Floats, advance: float) -> float:
    """Longest travel of the base during which the tip never got ahead by so much; all in m."""
    longest = 0.0
    for i in range(len(base)):
        ahead = tip[i:] - tip[i] >= advance
        end = int(np.argmax(ahead)) if ahead.any() else len(ahead) - 1
        longest = max(longest, float(base[i + end] - base[i]))
    return longest


def longest_gap(touching: Floats, period: float, from_start: bool = False) -> float:
    """Longest time without touch [s], after the first touch or from the start on."""
    free = np.flatnonzero(np.concatenate([[from_start], touching > 0, [True]]))
    if len(free) == 1 and not from_start:
        return len(touching) * period  # never touched at all
    return float((np.diff(free) - 1).max(initial=0)) * period


def _outcome(wall: WallParams, advance: float, gap: float) -> Outcome:
    if advance < wall.jam_advance:
        return "jam"
    return "slip" if gap > wall.slip_time else "success"


SETTLE = 0.5
"""Time to come to rest under gravity before the approach [s]."""
SAMPLES = round(SAMPLE_PERIOD / COMMAND_PERIOD)
"""Commands to a sample."""
_CLEAR = 0.002
"""Distance between tip and crests before the approach [m]."""


@dataclass(frozen=True)
class Passage:
    """What chance has drawn for a trial, and what follows from it.

    Attributes:
        antenna: The antenna, with the trial's friction.
        factors: What each spring's stiffness is multiplied with, shape (n,).
        base: Angle of the antenna's base [rad].
        approach: Way of the base towards the wall [m].
        crest: Distance of the crests from its start [m].
    """

    config: WallConfig
    antenna: AntennaSpec
    factors: Floats
    balls: Sequence[Ball]
    base: float
    approach: float
    crest: float

    @property
    def pull(self) -> tuple[float, float]:
        """Gravity in the plane [m/s²]."""
        ways = {"down": -GRAVITY, "up": GRAVITY, "off": 0.0}
        return 0.0, ways[self.config.wall.gravity]


def draw(config: WallConfig, profile: str, trial: int) -> Passage:
    """Draw a trial of a profile; all profiles meet the same chance."""
    rng = np.random.default_rng([config.seed, trial])
    wall, variation = config.wall, config.variation
    factors = np.exp(rng.normal(0.0, variation.stiffness, config.antenna.hinges))
    friction = max(0.0, config.antenna.friction + rng.normal(0.0, variation.friction))
    angle = wall.base_angle + rng.uniform(-1, 1) * variation.base_angle
    overlap = wall.overlap + rng.uniform(-1, 1) * variation.overlap
    phase = rng.uniform(0.0, 1.0) * wall.sphere_diameter
    antenna = with_profile(config.antenna, profile)
    antenna = antenna.model_copy(update={"friction": min(friction, 2.0)})
    crest = antenna.length * math.sin(angle) + antenna.radius + _CLEAR
    balls = spheres(wall, antenna, angle, phase, crest)
    way = math.pi / 2 - angle, overlap + _CLEAR, crest
    return Passage(config, antenna, factors, balls, *way)


def passage(config: WallConfig, profile: str, trial: int, watch: Watch = unwatched) -> Traverse:
    """Move one antenna along the wall; `watch` looks at the bench."""
    drawn = draw(config, profile, trial)
    wall, physics = config.wall, config.physics
    base, approach = drawn.base, drawn.approach
    model = compile_bench(physics, drawn.antenna, drawn.balls, drawn.pull)
    for i, factor in enumerate(drawn.factors):
        model.joint(f"antenna/hinge{i}").stiffness *= factor
    bench = Bench(model, drawn.antenna)
    bench.place(0.0, 0.0, base)
    bench.step(round(SETTLE / physics.timestep))
    substeps = round(COMMAND_PERIOD / physics.timestep)
    for x in ramp(approach, wall.speed):
        bench.command(x, 0.0, wall.speed, 0.0, base)
        bench.step(substeps)
        watch(bench)
    begin = bench.tip()[1]
    path = ramp(wall.travel, wall.speed)
    rows, hinges, shapes = [], [], []
    shown_at = marks(path)
    for i, y in enumerate(path):
        bench.command(approach, y, 0.0, wall.speed, base)
        bench.step(substeps)
        watch(bench)
        if i in shown_at:
            shapes.append(bench.joints())
        if i % SAMPLES == 0:
            force = float(np.hypot(*bench.contact_force()))
            tip = bench.tip()[1] - begin
            rows.append((y, tip, bench.touching(), force, bench.flex()))
            hinges.append(bench.hinges().copy())
    base_y, tip_y, touching, forces, flex = np.array(rows, float).T
    crest = drawn.crest
    drawing = np.array(hinges), np.array(shapes) - [crest, 0.0], from_crest(drawn.balls, crest)
    return Traverse(base_y, tip_y, touching, forces, flex, *drawing)


def spheres(
    wall: WallParams, antenna: AntennaSpec, angle: float, phase: float, crest: float
) -> list[Ball]:
    """Spheres all along the way, their crests clear of the tip at first.

    Args:
        wall: Its numbers.
        antenna: The antenna that passes.
        angle: Of the antenna against the way, at its base [rad].
        phase: How far the first sphere stands on along the way [m].
        crest: Distance of the crests from the base [m].
    """
    pitch = wall.sphere_diameter
    below = -2 * pitch - max(0.0, -antenna.length * math.cos(angle))
    above = wall.travel + 1.2 * antenna.length
    heights = np.arange(below + phase, above, pitch)
    return [Ball(crest + pitch / 2, float(y), pitch / 2) for y in heights]


def from_crest(balls: Sequence[Ball], crest: float) -> Floats:
    """Centres of spheres from the crest on, and their radii [m], shape (n, 3)."""
    return np.array([(ball.x - crest, ball.y, ball.radius) for ball in balls])


def marks(path: Sequence[float] | Floats) -> set[int]:
    """Indices on a way at which the antenna's shape is kept: both ends and each tenth between."""
    return {round(i * (len(path) - 1) / 10) for i in range(11)}


def ramp(length: float, speed: float) -> list[float]:
    """Places of the base on a way of this length [m] at a speed [m/s], one each command period."""
    count = max(1, math.ceil(length / (speed * COMMAND_PERIOD) - 1e-9))
    return (length * np.arange(1, count + 1) / count).tolist()
