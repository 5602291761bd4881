"""What the antenna meets on the bench, and how it is moved there."""

from __future__ import annotations

import math
from typing import Any, Literal

from antennate.params.base import Params, number

Solver = Literal["mujoco", "chain"]
"""What steps the physics of the bench: the engine, or the chain solver of the extra `fast`."""


def solver() -> Any:
    """The parameter that chooses it."""
    return number(
        "mujoco", "1", "assumed: needs no further package; docs/science/chain.md compares them"
    )


class WallParams(Params):
    """A vertical line of touching spheres, passed from below by an antenna at a fixed angle."""

    sphere_diameter: float = number(0.00635, "m", "paper: spheres of 6.35 mm", gt=1e-4, le=0.1)
    """Diameter and pitch."""
    speed: float = number(0.008, "m/s", "paper: 8 mm/s", gt=1e-5, le=0.5)
    """Speed of the base."""
    travel: float = number(
        0.16, "m", "assumed: unpublished; four times what `start` leaves out", gt=0.02, le=2
    )
    """Travel of the base along the wall."""
    base_angle: float = number(
        math.radians(53.0),
        "rad",
        "fitted: where the profiles differ most (docs/science/wall_study.py window)",
        gt=0.17,
        lt=2.9,
    )
    """Angle of the antenna from the direction of travel; a right angle faces the wall."""
    overlap: float = number(0.008, "m", "assumed: a few spheres' radii", gt=0, le=0.1)
    """How far the straight antenna would reach behind the crests."""
    gravity: Literal["down", "up", "off"] = number(
        "down", "1", "assumed: the wall is vertical, the base moves up, weight acts along it"
    )
    """Gravity against the travel, along it, or out of the plane."""
    jam_advance: float = number(0.001, "m", "assumed: a sixth of a sphere", gt=0)
    """A jammed tip advances less."""
    jam_travel: float = number(0.019, "m", "assumed: three spheres", gt=0)
    """Over this travel of the base."""
    slip_time: float = number(0.8, "s", "assumed: one sphere at the paper's speed", gt=0)
    """Contact lost for longer."""
    start: float = number(0.040, "m", "assumed: the antenna bows from its approach", ge=0)
    """Travel that the second count leaves out."""


class BenchVariationParams(Params):
    """What differs from trial to trial on the bench."""

    stiffness: float = number(
        0.05, "1", "assumed: makers quote 10 % of the rate, taken as two sigma", ge=0, le=0.3
    )
    """Standard deviation of a spring's stiffness."""
    friction: float = number(0.02, "1", "assumed: clean and dusty places", ge=0)
    """Standard deviation of the friction."""
    base_angle: float = number(math.radians(1.0), "rad", "assumed: clamped by hand", ge=0)
    """Half range of the base angle."""
    overlap: float = number(0.0005, "m", "assumed: set by hand", ge=0, le=0.01)
    """Half range of the overlap."""
