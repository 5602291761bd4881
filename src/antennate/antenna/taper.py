"""From diameters to the stiffness proxy of a tapering antenna, and the ladder that follows it.

Bending stiffness E I of a round section goes with the fourth power of its diameter, so that the
proxy is K = (d / d_1)^4 with d_1 at the base. The angles of springs in a row add up, each under the
same torque: one spring that replaces a stretch of antenna has the harmonic mean of its stiffnesses.
"""

from __future__ import annotations

import math

import numpy as np

from antennate.params.spring import TaperParams
from antennate.types import Floats


def diameters(params: TaperParams) -> Floats:
    """Diameters base to tip [m], shape (segments,)."""
    ends, count = (1e-3 * params.base_mm, 1e-3 * params.tip_mm), params.segments
    return np.geomspace(*ends, count) if params.law == "geometric" else np.linspace(*ends, count)


def second_moment(diameter: Floats) -> Floats:
    """Second moment of area of round sections [m⁴], same shape as their diameters [m]."""
    return math.pi * diameter**4 / 64.0


def proxy(diameter: Floats) -> Floats:
    """Stiffness over that of the base, (d / d_1)^4, shape (n,)."""
    return (diameter / diameter[0]) ** 4


def binned(values: Floats, bins: int) -> Floats:
    """Harmonic means of equal stretches of a row of segments, shape (bins,).

    Args:
        values: Stiffness of each segment, shape (n,); a segment that lies in two stretches counts
            for each by its share.
        bins: Number of stretches.
    """
    edges = np.linspace(0.0, len(values), bins + 1)
    give = np.concatenate([[0.0], np.cumsum(1.0 / values)])
    return len(values) / bins / np.diff(np.interp(edges, np.arange(len(values) + 1), give))


def ladder_proxy(coils: Floats) -> Floats:
    """Stiffness of a ladder of springs over that of its first, shape (n,)."""
    return coils[0] / coils


def distance_decades(first: Floats, second: Floats) -> float:
    """Root mean square of the difference of two proxies in powers of ten."""
    return float(np.sqrt(np.mean(np.log10(first / second) ** 2)))


def follow(wanted: Floats, fewest: int, most: int) -> Floats:
    """Whole coil counts whose ladder follows a proxy best, within limits, shape of `wanted`.

    The base takes every count in turn; each further spring then takes the count that comes nearest
    in proportion. Of these ladders the one nearest in decades wins, of equals the shortest.
    """
    ladders = []
    for base in range(fewest, most + 1):
        exact = np.clip(base / wanted * wanted[0], fewest, most)
        below, above = np.floor(exact), np.minimum(np.ceil(exact), most)
        ladders.append(np.where(exact / below <= above / exact, below, above))
    aim = wanted / wanted[0]
    return min(ladders, key=lambda coils: distance_decades(ladder_proxy(coils), aim))
