"""Contacts to learn from: point loads at rest within the cone of friction, and traverses.

In a traverse the antenna points along x; its base moves towards -y, so that a post bends it one way
only, until it slips off.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from pydantic import model_validator

from antennate.antenna import sensor as flex_sensor
from antennate.antenna.statics import PROFILES, Chain, Profile, equilibrium, with_profile
from antennate.control.conditioning import bending_level
from antennate.errors import SimulationError
from antennate.experiments.bench import averaged, recorded
from antennate.params.base import Params, number, require_different, require_whole_steps
from antennate.params.control import ConditioningParams
from antennate.params.scene import BenchPhysicsParams
from antennate.robots.antenna import AntennaSpec, require_own_curve
from antennate.sim.bench import Ball, Bench, compile_bench
from antennate.types import Bools, Floats, Ints

_CLEARANCE = 0.03
"""Way of the base before it meets the post [m]; it has come up to speed by then."""
_RISE = 0.2
"""Time over which the base comes up to speed [s]."""
_LOST = 0.1
"""Contact lost for so long has ended [s]."""


@dataclass(frozen=True, slots=True)
class Traverse:
    """What was recorded of one traverse while the post pressed.

    Attributes:
        flex: Flex under the flex sensor [rad], shape (n,).
        force: Size of the contact force, averaged over the time of a sample [N], shape (n,).
        place: Where the post touches, along the antenna over its length, shape (n,).
        age: Time since the post first touched [s], shape (n,).
        reason: Why the trial is invalid, or empty.
    """

    flex: Floats
    force: Floats
    place: Floats
    age: Floats
    reason: str = ""


def drag(
    physics: BenchPhysicsParams,
    antenna: AntennaSpec,
    overlap: float,
    speed: float,
    post_radius: float,
    limit: float,
    rate: float,
) -> Traverse:
    """Drag the antenna past a post until it slips off or a hinge exceeds its limit.

    Args:
        physics: Numerics.
        antenna: The antenna.
        overlap: Place of the first contact, over the length of the antenna.
        speed: Speed of the base [m/s].
        post_radius: Radius of the post [m].
        limit: Largest hinge angle that still counts [rad].
        rate: Samples a second [Hz].
    """
    post = Ball(overlap * antenna.length, -(post_radius + antenna.radius + _CLEARANCE), post_radius)
    bench = Bench(compile_bench(physics, antenna, [post]), antenna)
    bench.place(0.0, 0.0, 0.0)
    steps = round(1.0 / (rate * physics.timestep))
    end = (_CLEARANCE + 2.0 * antenna.length) / speed + _RISE
    rows: list[tuple[float, float, float, float]] = []
    last = math.inf
    try:
        while bench.t < end and bench.t - last < _LOST:
            bench.command(0.0, -way(bench.t, speed), 0.0, -speed_at(bench.t, speed), 0.0)
            force = float(np.linalg.norm(bench.press(steps)))
            if abs(bench.hinges()).max() > limit:
                break
            if force > 0.0:
                last = bench.t
                rows.append((bench.flex(), force, place_along(bench.joints(), post), last))
    except SimulationError as error:
        none = np.zeros(0)
        return Traverse(none, none, none, none, str(error))
    flex, pressed, place, t = np.array(rows).reshape(-1, 4).T
    return Traverse(flex, pressed, place, t - t[:1])


def speed_at(t: float, speed: float) -> float:
    """Speed of a base that comes up to `speed` without a jerk [m/s]."""
    return speed * min(t / _RISE, 1.0)


def way(t: float, speed: float) -> float:
    """Way of such a base [m]: the integral of its speed."""
    return speed * (t * t / (2 * _RISE) if t < _RISE else t - _RISE / 2)


def place_along(joints: Floats, post: Ball) -> float:
    """Where along the antenna lies the point nearest to the post, over its length."""
    starts, sides = joints[:-1], np.diff(joints, axis=0)
    square = (sides**2).sum(axis=1)
    to_post = np.array([post.x, post.y]) - starts
    share = np.clip((to_post * sides).sum(axis=1) / square, 0.0, 1.0)
    gap = np.linalg.norm(to_post - share[:, None] * sides, axis=1)
    nearest = int(gap.argmin())
    return float((nearest + share[nearest]) / len(sides))


class ForceConfig(Params):
    """Everything that decides the outcome of `bench force`."""

    unread: ClassVar[tuple[str, ...]] = ("antenna.base_angle", "antenna.base_spacing")
    seed: int = number(0, "1", "assumed: any", ge=0)
    """Seed of all chance."""
    profiles: tuple[Profile, ...] = number(
        tuple(PROFILES), "1", "assumed: the paper's three and both controls", min_length=1
    )
    """Profiles."""
    nearest: float = number(
        0.25, "1", "assumed: nearer contacts hardly bend the flex sensor", gt=0, lt=1
    )
    """Nearest place."""
    from_place: float = number(
        0.5, "1", "assumed: as in the study to confirm, between half and full length", gt=0, lt=1
    )
    """Nearest place of the question, over the length."""
    place_step: float = number(0.05, "1", "assumed: under a third of a link", gt=0, le=0.5)
    """Distance of places."""
    loads: int = number(
        60, "1", "assumed: the same number again monitors the curves", ge=2, le=10000
    )
    """Loads at every place to fit curves to."""
    hinge_limit_deg: float = number(
        30.0, "deg", "paper: deflection of a spring below 30 deg", gt=0, le=80
    )
    """Largest hinge angle."""
    traverses: int = number(24, "1", "assumed: half of them test the curves", ge=4, le=10000)
    """Traverses of every profile."""
    speeds: tuple[float, ...] = number(
        (0.05, 0.10, 0.15), "m/s", "paper: calibration at 5, 10 and 15 cm/s", min_length=1
    )
    """Speeds."""
    post_radius: float = number(0.003175, "m", "paper: spheres of 6.35 mm diameter", gt=0, le=0.1)
    """Radius of the post."""
    antenna: AntennaSpec = AntennaSpec()
    conditioning: ConditioningParams = ConditioningParams()
    physics: BenchPhysicsParams = BenchPhysicsParams()

    @model_validator(mode="after")
    def _agree(self) -> ForceConfig:
        require_whole_steps("antenna.sensor.rate", self.antenna.sensor.rate, self.physics.timestep)
        require_own_curve(self.antenna.sensor, "conditioning", self.conditioning)
        if self.nearest > self.from_place:
            raise ValueError(
                f"nearest must not exceed from_place, {self.from_place:g}, found {self.nearest:g}"
            )
        require_different("profiles", self.profiles)
        if min(self.speeds) <= 0:
            raise ValueError(f"speeds must be above 0, found {min(self.speeds):g}")
        if self.traverses < (least := 2 * len(self.speeds)):
            raise ValueError(
                f"traverses: expected at least {least}, two of each of {len(self.speeds)} speeds "
                f"(one fits, one tests), found {self.traverses}"
            )
        return self

    def speed(self, k: int) -> float:
        """Speed of the k-th traverse [m/s]: even ones, which fit, and odd ones meet all speeds.

        The order of `speeds` plays no part. Of an even number, two neighbours share one.
        """
        place = k // 2 if len(self.speeds) % 2 == 0 else k
        return sorted(self.speeds)[place % len(self.speeds)]

    def places(self) -> Floats:
        """Places of the static loads, over the length, the tip among them."""
        count = math.floor((1.0 - self.nearest) / self.place_step + 1e-9)
        return 1.0 - self.place_step * np.arange(count, -1, -1, dtype=np.float64)


@dataclass(frozen=True, slots=True)
class Points:
    """Contacts: what was felt, how hard they pressed, and where.

    Attributes:
        scalars: Each of SCALARS, shape (n,).
        force: Size of the force [N]; `place` over the length; both of shape (n,).
        trial: What counts as one in intervals: load or traverse, shape (n,).
        fit: Whether the point serves to fit, shape (n,); the others test the fit.
        age: Time since the contact began, shape (n,) [s]; infinite at rest.
    """

    scalars: dict[str, Floats]
    force: Floats
    place: Floats
    trial: Ints
    fit: Bools
    age: Floats


def static_loads(
    config: ForceConfig, profile: str, friction: float, largest: float
) -> tuple[Points, int]:
    """Loads of uniform size up to `largest` [N] at every place, within the cone of friction.

    Returns:
        The loads that keep every hinge within the limit, and how many did not.
    """
    antenna = with_profile(config.antenna, profile)
    chain, limit = Chain.of(antenna), math.radians(config.hinge_limit_deg)
    rng = np.random.default_rng([config.seed, 0])
    places = config.places()
    place = np.repeat(places, 2 * config.loads)
    size = rng.uniform(0.0, 1.0, len(place)) * largest
    lean = rng.uniform(-1.0, 1.0, len(place)) * math.atan(friction)
    force = size[:, None] * np.stack([np.sin(lean), np.cos(lean)], axis=1)
    rest = equilibrium(chain, place * chain.length, force, follower=True)
    good = rest.solved & (abs(rest.angles).max(axis=1) <= limit * (1 + 1e-6))
    covered = antenna.sensed_hinges
    flex = rest.angles[:, :covered].sum(axis=1)
    window = max(1, round(config.conditioning.averaging_time * config.antenna.sensor.rate))
    noise = flex_sensor.reading_noise(config.antenna.sensor, rng, (window, len(flex)))
    repeated = flex_sensor.counts(config.antenna.sensor, flex, noise)
    points = Points(
        {
            "flex": flex[good],
            "reading": repeated[0, good],
            "level": bending_level(config.conditioning, repeated.mean(axis=0))[good],
        },
        size[good],
        place[good],
        np.arange(len(place))[good],
        (np.arange(len(place)) % 2 == 1)[good],
        np.full(int(good.sum()), math.inf),
    )
    return points, int((~good).sum())


def traverse_points(config: ForceConfig, traverses: list[Traverse]) -> Points:
    """The samples of all traverses through the sensor chain; even traverses serve to fit."""
    sensor, counts, levels = config.antenna.sensor, [np.zeros(0)], [np.zeros(0)]
    for k, traverse in enumerate(traverses):
        rng = np.random.default_rng([config.seed, 2, k])
        noise = flex_sensor.reading_noise(sensor, rng, (len(traverse.flex),))
        counts.append(recorded(sensor, traverse.flex, noise))
        mean = averaged(config.conditioning, counts[-1], sensor.rate)
        levels.append(bending_level(config.conditioning, mean))
    trial = np.repeat(np.arange(len(traverses)), [len(traverse.flex) for traverse in traverses])
    return Points(
        {
            "flex": np.concatenate([t.flex for t in traverses]),
            "reading": np.concatenate(counts),
            "level": np.concatenate(levels),
        },
        np.concatenate([t.force for t in traverses]),
        np.concatenate([t.place for t in traverses]),
        trial,
        trial % 2 == 0,
        np.concatenate([t.age for t in traverses]),
    )
