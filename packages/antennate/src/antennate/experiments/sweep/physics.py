"""One antenna whose base sweeps beside a wall: what it does, and which shape it has.

The antenna is a left one: the robot heads along x and the wall stands at positive y. The base comes
from the heading to the near end of its sweep, and then turns by theta0 + A sin(2 pi f t). A right
antenna is the mirror image, so it needs no bench of its own.
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field, model_validator

from antennate.antenna.shapes import Shape, classify
from antennate.antenna.statics import PROFILES, Profile
from antennate.errors import SimulationError
from antennate.experiments.force.physics import speed_at, way
from antennate.params.base import Params, number, require_different, require_whole_steps
from antennate.params.bench import EstimateParams, ShapeParams, SweepParams
from antennate.params.control import ConditioningParams
from antennate.params.scene import BenchPhysicsParams
from antennate.robots.antenna import AntennaSpec
from antennate.sim.bench import Bar, Bench, compile_bench
from antennate.types import Bools, Floats


class SweepConfig(Params):
    """Everything that decides the outcome of `bench sweep`."""

    unread: ClassVar[tuple[str, ...]] = (
        "antenna.base_angle",
        *(f"conditioning.{n}" for n in ConditioningParams.model_fields if n != "averaging_time"),
    )
    seed: int = number(0, "1", "assumed: any", ge=0)
    """Seed of all chance."""
    profiles: tuple[Profile, ...] = number(
        tuple(PROFILES), "1", "assumed: the paper's three and both controls", min_length=1
    )
    """Profiles of the map."""
    profile: Profile = number("descending", "1", "paper: the robot's profile")
    """Profile of the estimates."""
    distances: tuple[float, ...] = number(
        (0.35, 0.5, 0.65, 0.8, 0.95), "1", "assumed: up to nearly out of reach", min_length=1
    )
    """Distances of the wall, over the length of the antenna."""
    centres: tuple[Annotated[float, Field(ge=0, le=2.0)], ...] = number(
        tuple(math.radians(a) for a in (47.0, 70.0, 90.0)),
        "rad",
        "assumed: the mounting angle, and on to sideways",
        min_length=1,
    )
    """Centres of the sweep."""
    amplitudes: tuple[Annotated[float, Field(gt=0, le=1.5)], ...] = number(
        tuple(math.radians(a) for a in (15.0, 30.0, 45.0)),
        "rad",
        "assumed: half and one and a half times the default",
        min_length=1,
    )
    """Amplitudes of the sweep."""
    sweeps: int = number(2, "1", "assumed: they repeat; one before them is left out", ge=1, le=100)
    """Sweeps measured."""
    speed: float = number(
        0.05, "m/s", "assumed: slowly; under half of the paper's 0.12 m/s", gt=0, le=1
    )
    """Speed of the base along the wall where it moves."""
    points: bool = number(False, "1", "assumed: a large file that few need")
    """Whether to save the points of the antenna of `profile` in every cell, for `tracks`."""
    sweep: SweepParams = SweepParams()
    shape: ShapeParams = ShapeParams()
    estimate: EstimateParams = EstimateParams()
    antenna: AntennaSpec = AntennaSpec()
    conditioning: ConditioningParams = ConditioningParams()
    physics: BenchPhysicsParams = BenchPhysicsParams()

    @model_validator(mode="after")
    def _agree(self) -> SweepConfig:
        require_whole_steps("antenna.sensor.rate", self.antenna.sensor.rate, self.physics.timestep)
        require_different("profiles", self.profiles)
        least = self.antenna.radius / self.antenna.length
        for what, values in (
            ("distances", self.distances),
            ("estimate.distance", self.estimate.distance),
        ):
            if min(values) <= least:
                raise ValueError(
                    f"{what} must exceed the antenna's radius, {least:g} of its length, "
                    f"found {min(values):g}"
                )
        if not self.estimate.distance[0] < self.estimate.distance[1]:
            raise ValueError(f"estimate.distance must rise, found {self.estimate.distance}")
        return self


_APPROACH = 0.5
"""Time from the heading to the near end of the sweep [s]."""
_BEFORE = 0.005
"""Distance from the first point of an outline to the first hinge, along the base [m]."""
_THICK, _LONG = 0.02, 2.0
"""Radius and half length of the wall's capsule [m]."""


@dataclass(frozen=True, slots=True)
class Wall:
    """A straight wall.

    Attributes:
        distance: From the antenna's base at the start to the surface, at right angles [m].
        tilt: Angle of the wall from the heading, positive away from the robot [rad].
    """

    distance: float
    tilt: float = 0.0

    @property
    def normal(self) -> Floats:
        """Direction from the base to the wall, shape (2,)."""
        return np.array([-math.sin(self.tilt), math.cos(self.tilt)])

    def bar(self) -> Bar:
        """The wall as an obstacle of the bench."""
        middle = (self.distance + _THICK) * self.normal
        along = _LONG * np.array([math.cos(self.tilt), math.sin(self.tilt)])
        (x0, y0), (x1, y1) = middle - along, middle + along
        return Bar(float(x0), float(y0), float(x1), float(y1), _THICK)


@dataclass(frozen=True, slots=True)
class Trace:
    """A sweep sample by sample, each of shape (n,).

    Attributes:
        t: Time since the sweep began [s], negative while the base comes from the heading.
        base: Angle of the base from the heading [rad].
        flex: Summed hinge angles under the flex sensor [rad].
        offset: Angle of the tip, seen from the base, off the base's direction [rad].
        reach: Distance from base to tip [m].
        points: A point on the base before the first hinge, the hinges and the tip [m], of shape
            (n, hinges + 2, 2).
        reason: Why the trial is invalid, or empty.
    """

    t: Floats
    base: Floats
    flex: Floats
    offset: Floats
    reach: Floats
    touching: Bools
    reason: str = ""
    points: Floats = field(default_factory=lambda: np.zeros((0, 2, 2)))


def record(
    physics: BenchPhysicsParams,
    antenna: AntennaSpec,
    sweep: SweepParams,
    wall: Wall,
    sweeps: float,
    speed: float = 0.0,
    gap: float = 5e-4,
) -> Trace:
    """Sweep beside a wall.

    Args:
        physics: Numerics.
        antenna: The antenna.
        sweep: The sweep.
        wall: The wall.
        sweeps: How many sweeps.
        speed: Speed of the base along the heading [m/s].
        gap: Distance to the wall that counts as touching [m].
    """
    bench, rate = Bench(compile_bench(physics, antenna, [wall.bar()]), antenna), antenna.sensor.rate
    bench.place(0.0, 0.0, 0.0)
    steps = round(1.0 / (rate * physics.timestep))
    end = _APPROACH + sweeps / sweep.frequency - 0.5 / rate
    rows: list[tuple[float, float, float, float, float, bool]] = []
    outlines: list[Floats] = []
    try:
        while bench.t < end:
            t = bench.t
            bench.command(way(t, speed), 0.0, speed_at(t, speed), 0.0, commanded(sweep, t))
            bench.step(steps)
            joints, base = bench.joints(), bench.base_angle()
            tip = joints[-1] - joints[0]
            near = wall.distance - float((joints @ wall.normal).max()) - antenna.radius
            off = math.atan2(tip[1], tip[0]) - base
            off = math.remainder(off, 2.0 * math.pi)
            reach = float(np.hypot(*tip))
            rows.append((bench.t - _APPROACH, base, bench.flex(), off, reach, near < gap))
            before = joints[:1] - _BEFORE * np.array([[math.cos(base), math.sin(base)]])
            outlines.append(np.concatenate([before, joints]))
    except SimulationError as error:
        none = np.zeros(0)
        return Trace(none, none, none, none, none, none > 0, str(error))
    t, base, flex, offset, reach, touching = np.array(rows, np.float64).T
    return Trace(t, base, flex, offset, reach, touching > 0.5, "", np.array(outlines))


def commanded(sweep: SweepParams, t: float) -> float:
    """Angle commanded to the base [rad], at a time since the trial began [s]."""
    if t < _APPROACH:
        share = t / _APPROACH
        return (sweep.centre - sweep.amplitude) * share * share * (3.0 - 2.0 * share)
    turned = 2.0 * math.pi * sweep.frequency * (t - _APPROACH)
    return sweep.centre - sweep.amplitude * math.cos(turned)


def shares(params: ShapeParams, trace: Trace, first: float) -> dict[str, float]:
    """Shares of time of each shape and of no contact, from `first` [s] on; they add up to 1."""
    at = trace.t > first
    shape = classify(params, trace.flex, trace.offset)
    touched = {
        kind.name.lower(): float((trace.touching & (shape == kind))[at].mean()) for kind in Shape
    }
    return touched | {"free": float((~trace.touching)[at].mean())}


_BODY = 0.1
"""Distance of the point `tail` behind `head`, which is on the base before the first hinge [m]."""


@dataclass(frozen=True, slots=True)
class Outlines:
    """One sweep.

    Attributes:
        trial: Its name.
        t: Time [s], shape (n,).
        points: Along the antenna [m], shape (n, k, 2).
        touching: Whether it touches the wall, shape (n,).
    """

    trial: str
    t: Floats
    points: Floats
    touching: Bools


def outlines_of(trial: str, trace: Trace, first: float) -> Outlines:
    """The points of a sweep from `first` [s] on, as `shares` counts them."""
    at = trace.t > first
    return Outlines(trial, trace.t[at], trace.points[at], trace.touching[at])


def outlines_csv(sweeps: Sequence[Outlines]) -> str:
    """A row for each sample: `left0` to the tip, body axis `tail` to `head`, and contact."""
    file = io.StringIO()
    writer = csv.writer(file, lineterminator="\n")
    names = [f"left{i}" for i in range(sweeps[0].points.shape[1])]
    columns = [f"{name}_{axis}" for name in (*names, "head", "tail") for axis in "xy"]
    writer.writerow(["trial", "frame", "time", "left_contact", *columns])
    for sweep in sweeps:
        for i, points in enumerate(sweep.points):
            head = points[0]
            points_of_row = np.vstack([points, head, head - (_BODY, 0.0)]).ravel()
            cells = [f"{value:.6f}" for value in points_of_row]
            writer.writerow([sweep.trial, i, f"{sweep.t[i]:.6f}", int(sweep.touching[i]), *cells])
    return file.getvalue()
