"""Counts to the bending level b in [0, 1]: a running mean over T_avg, then one sigmoid.

A sample that cannot be used, one that is missing or at a rail of the converter, makes the level of
its side NaN as long as it is in the window of the mean. `contact.py` turns NaN into UNKNOWN. So a
broken wire is UNKNOWN in simulation, too; on a robot the diagnosis of each channel finds more.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from antennate.params.control import ConditioningParams, ControlParams, CurveParams
from antennate.types import Bools, Floats, Ints

LOW_RAIL = 5.0
"""Readings up to this are at the lower rail [counts]: two sigma of the noise above 0 (assumed)."""
HIGH_RAIL = 4090.0
"""Readings from this on are at the upper rail [counts]: two sigma below full scale (assumed)."""


def usable(counts: Floats) -> Bools:
    """Whether readings [counts] are finite and between the rails, same shape.

    A wire that is open at the flex sensor or shorted reads a rail, whatever the antenna does.
    """
    return (counts > LOW_RAIL) & (counts < HIGH_RAIL)


def sigmoid(z: Floats) -> Floats:
    """1 / (1 + exp(-z)), same shape; NaN stays NaN."""
    return 1.0 / (1.0 + np.exp(-np.minimum(np.maximum(z, -700.0), 700.0)))


@dataclass(frozen=True, slots=True)
class Curves:
    """The curves of both antennae, left before right: what `CurveParams` has, shapes (2,)."""

    midpoint: Floats
    slope: Floats
    polarity: Floats
    counts_low: Floats
    counts_high: Floats


def curves(control: ControlParams) -> CurveParams | Curves:
    """What makes levels of counts (..., 2): one curve for both antennae, or one for each."""
    left, right = control.conditioning, control.conditioning_right
    if right is None:
        return left
    pairs = ([getattr(one, f.name) for one in (left, right)] for f in fields(Curves))
    return Curves(*(np.array(pair, float) for pair in pairs))


def bending_level(params: CurveParams | Curves, counts: Floats) -> Floats:
    """Sigmoid calibration, b = 1 / (1 + exp(-s k (x - x0))), s the polarity of the reading x.

    Args:
        params: Slope k, midpoint x0, polarity and normalisation.
        counts: Readings [counts], any shape, (..., 2) for two curves; NaN passes through.

    Returns:
        b in [0, 1], same shape.
    """
    return _level(params, _share(params, counts))


def level_and_fraction(params: CurveParams | Curves, counts: Floats) -> tuple[Floats, Floats]:
    """`bending_level`, and flex as a fraction of the calibrated range: 0 straight, 1 fully bent."""
    x = _share(params, counts)
    return _level(params, x), _fraction(params, x)


def _share(params: CurveParams | Curves, counts: Floats) -> Floats:
    """Readings as shares of the range between both ends of the curve."""
    return (counts - params.counts_low) / (params.counts_high - params.counts_low)


def _level(params: CurveParams | Curves, x: Floats) -> Floats:
    return sigmoid(params.polarity * params.slope * (x - params.midpoint))


def _fraction(params: CurveParams | Curves, x: Floats) -> Floats:
    if isinstance(params, Curves):
        return np.where(params.polarity > 0, x, 1.0 - x)
    return x if params.polarity > 0 else 1.0 - x


class RunningMean:
    """Mean of the counts of the last T_avg, per row and side; of all samples so far before that."""

    def __init__(self, params: ConditioningParams, batch: int, period: float) -> None:
        self.length = max(1, round(params.averaging_time / period))
        self._ring: Floats = np.zeros((self.length, batch, 2))
        self._seen: Ints = np.zeros(batch, dtype=np.int64)  # not counted beyond the length
        self._next = 0
        self._short = self.length  # ticks until all rows have seen so many

    def reset(self, rows: Ints | Bools) -> None:
        """Forget what some rows have seen."""
        self._seen[rows] = 0
        self._short = self.length
        self._ring[:, rows] = 0.0

    def step(self, counts: Floats) -> Floats:
        """Take one reading, shape (B, 2) [counts], and return the mean, same shape."""
        self._ring[self._next] = np.where(usable(counts), counts, np.nan)
        self._next = (self._next + 1) % self.length
        total = np.add.reduce(self._ring, axis=0)
        if not self._short:
            return total / self.length
        self._short -= 1
        self._seen = np.minimum(self._seen + 1, self.length)
        return total / self._seen[:, None]
