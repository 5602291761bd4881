"""What the antenna meets on the bench, and how it is moved there."""

from __future__ import annotations

import math
from typing import Literal

from antennate.params.base import Params, number


class WallParams(Params):
    """A vertical line of touching spheres, passed from below by an antenna at a fixed angle."""

    sphere_diameter: float = number(
        0.00635, "m", "paper: spheres of 6.35 mm", "diameter and pitch", gt=1e-4, le=0.1
    )
    speed: float = number(0.008, "m/s", "paper: 8 mm/s", "speed of the base", gt=1e-5, le=0.5)
    travel: float = number(
        0.16,
        "m",
        "assumed: unpublished; four times the start that may be left out",
        "travel of the base along the wall",
        gt=0.02,
        le=2,
    )
    base_angle: float = number(
        math.radians(53.0),
        "rad",
        "fitted: unpublished; where the profiles differ most (docs/science/wall_study.py window)",
        "angle of the antenna from the direction of travel; a right angle faces the wall",
        gt=0.17,
        lt=2.9,
    )
    overlap: float = number(
        0.008,
        "m",
        "assumed: unpublished; a few spheres' radii",
        "how far the straight antenna would reach behind the crests",
        gt=0,
        le=0.1,
    )
    gravity: Literal["down", "up", "off"] = number(
        "down",
        "1",
        "assumed: the wall is vertical and the base moves up, so weight acts along the wall",
        "gravity against the travel, along it, or out of the plane",
    )
    jam_advance: float = number(
        0.001, "m", "assumed: a sixth of a sphere", "a jammed tip advances less", gt=0
    )
    jam_travel: float = number(
        0.019, "m", "assumed: three spheres", "over this travel of the base", gt=0
    )
    slip_time: float = number(
        0.8, "s", "assumed: one sphere at the paper's speed", "contact lost for longer", gt=0
    )
    start: float = number(
        0.040,
        "m",
        "assumed: until then the antenna bows from its approach",
        "travel that the second count leaves out",
        ge=0,
    )


class BenchVariationParams(Params):
    """What differs from trial to trial on the bench."""

    stiffness: float = number(
        0.05,
        "1",
        "assumed: makers quote 10 % of rate at two standard deviations",
        "standard deviation of a spring's stiffness",
        ge=0,
        le=0.3,
    )
    friction: float = number(
        0.02, "1", "assumed: clean and dusty places", "standard deviation of the friction", ge=0
    )
    base_angle: float = number(
        math.radians(1.0), "rad", "assumed: clamped by hand", "half range of the base angle", ge=0
    )
    overlap: float = number(
        0.0005, "m", "assumed: set by hand", "half range of the overlap", ge=0, le=0.01
    )
