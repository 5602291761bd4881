"""The spheres of a wall, and the way of the base along them."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from antennate.params.bench import WallParams
from antennate.robots.antenna import AntennaSpec
from antennate.sim.bench import Ball
from antennate.types import Floats

COMMAND_PERIOD = 0.002
"""Time between commands to the carriage [s]."""


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
