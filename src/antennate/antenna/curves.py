"""Curves from readings to the flex level, fitted to samples: a sigmoid and what rivals it.

    b = 1 / (1 + exp(-s k (x - x0))),   x = (counts - low) / (high - low)

b is the level, 0 straight and 1 full; s the polarity, found from the data; x0 the midpoint and k
the slope. The fit minimises the squared error of b. A straight line and an isotonic regression
stand beside it for comparison.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from antennate.control.conditioning import sigmoid
from antennate.types import Floats, Ints

MODELS = ("sigmoid", "line", "isotonic")


@dataclass(frozen=True)
class Samples:
    """Readings with known levels.

    Attributes:
        counts: Readings [counts], shape (n,).
        level: Level of each, 0 straight and 1 full, shape (n,).
        trial: Number of the push of each, shape (n,).
        speed: Pushing speed [m/s], NaN where unknown, shape (n,).
        row: Row of the file, for errors, shape (n,).
    """

    counts: Floats
    level: Floats
    trial: Ints
    speed: Floats
    row: Ints


def polarity(samples: Samples) -> Literal[-1, 1]:
    """1 if readings rise with the level, -1 if they fall."""
    return 1 if float((samples.level - samples.level.mean()) @ samples.counts) >= 0 else -1


def curve(z: Floats, slope: float, midpoint: float) -> Floats:
    """Level, 0 to 1, of signed normalised readings z = s x, same shape; midpoint is s x0."""
    return sigmoid(slope * (z - midpoint))


BOUNDS = ((-5.0, float(np.log(1000.0))), (-3.0, 3.0))
"""Where the logarithm of the slope is searched, and the midpoint."""


def fit_sigmoid(x: Floats, level: Floats, sign: int) -> tuple[float, float]:
    """Slope k and midpoint x0 that minimise the squared error of the level.

    Args:
        x: Normalised readings, shape (n,).
        level: Levels, shape (n,).
        sign: Polarity, 1 or -1.
    """
    from scipy.optimize import least_squares  # takes long; only where it is needed

    z = sign * x
    start = (np.log(8.0), float(np.interp(0.5, *_sorted(level, z))))

    def error(p: Floats) -> Floats:
        return curve(z, float(np.exp(p[0])), float(p[1])) - level

    found = least_squares(error, start, bounds=np.transpose(BOUNDS)).x
    return float(np.exp(found[0])), sign * float(found[1])


def _sorted(by: Floats, other: Floats) -> tuple[Floats, Floats]:
    order = np.argsort(by, kind="stable")
    return by[order], other[order]


def ends(samples: Samples) -> tuple[float, float]:
    """Readings that normalise to 0 and 1: the outermost ones, a few outliers apart."""
    low, high = np.percentile(samples.counts, [0.5, 99.5])
    return float(low), float(high)


def predict(model: str, x: Floats, level: Floats, at: Floats, sign: int) -> Floats:
    """Levels that one of MODELS, fitted to normalised readings x and levels (n,), gives at others.

    Args:
        model: Which.
        x: Readings of the fit, shape (n,).
        level: Their levels, shape (n,).
        at: Other readings, shape (m,).
        sign: Polarity, 1 or -1.
    """
    from scipy.optimize import isotonic_regression  # takes long; only where it is needed

    if model == "sigmoid":
        slope, midpoint = fit_sigmoid(x, level, sign)
        return curve(sign * at, slope, sign * midpoint)
    if model == "line":
        straight = np.polyval(np.polyfit(x, level, 1), at)
        return np.asarray(np.clip(straight, 0.0, 1.0), dtype=np.float64)
    z, b = _sorted(sign * x, level)
    return np.asarray(np.interp(sign * at, z, isotonic_regression(b).x), dtype=np.float64)
