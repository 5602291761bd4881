"""How much of one quantity another predicts: rising curves, and the variance that they explain."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from antennate.jackknife import ENOUGH, jackknife95
from antennate.types import Floats, Ints


@dataclass(frozen=True, slots=True)
class Curve:
    """The best increasing curve in the sense of least squares, straight between its knots.

    Attributes:
        x: Knots, increasing, shape (k,).
        y: Values there, never decreasing; beyond the ends the curve is constant.
    """

    x: Floats
    y: Floats

    @classmethod
    def through(cls, x: Floats, y: Floats) -> Curve:
        """Fit to points x, y of shape (n,); points of equal x count as one of more weight."""
        from scipy import optimize  # takes long; only where it is needed

        knots, where, weights = np.unique(x, return_inverse=True, return_counts=True)
        means = np.bincount(where, weights=y) / weights
        fitted = optimize.isotonic_regression(means, weights=weights).x
        return cls(knots, np.asarray(fitted))

    def __call__(self, x: Floats) -> Floats:
        """Values at x, any shape."""
        return np.interp(x, self.x, self.y)


@dataclass(frozen=True, slots=True)
class Explained:
    """How well a prediction serves.

    Attributes:
        n: Points predicted.
        r2: 1 - sum (y - prediction)^2 / sum (y - mean y)^2: share of variance explained; below 0
            the prediction is worse than the mean.
        r2_95: Its 95 % interval over groups; NaN with fewer than `ENOUGH`.
        rmse: Root mean square error, in the unit of y.
        groups: How many groups the points are of.
    """

    n: int
    r2: float
    r2_95: tuple[float, float]
    rmse: float
    groups: int


def explained(truth: Floats, prediction: Floats, groups: Ints) -> Explained:
    """Test a prediction made without these points.

    The interval of R² is a jackknife over groups of log(1 - R²), so that it ends below 1. It is for
    groups drawn at random, each without regard to the others. Groups that were spread evenly on
    purpose vary less from one set to the next than it says.

    Args:
        truth: What was to be predicted, shape (n,).
        prediction: The same shape.
        groups: What errs as one: the trial of each point, shape (n,).
    """
    if len(truth) == 0:
        return Explained(0, float("nan"), (float("nan"), float("nan")), float("nan"), 0)
    _, where = np.unique(groups, return_inverse=True)
    parts = (np.ones_like(truth), truth, truth**2, (truth - prediction) ** 2)
    sums = np.stack([np.bincount(where, weights=part) for part in parts], axis=1)
    whole = sums.sum(axis=0)
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        share, left = _unexplained(whole), _unexplained(whole - sums)
        low, high = 1.0 - np.exp(jackknife95(np.log(share), np.log(left))[::-1])
    if len(sums) < ENOUGH:
        low = high = np.nan
    rmse = float(np.sqrt(parts[3].mean()))
    return Explained(len(truth), float(1.0 - share), (float(low), float(high)), rmse, len(sums))


def _unexplained(sums: Floats) -> Floats:
    n, first, second, error = np.moveaxis(sums, -1, 0)
    return error / (second - first**2 / n)


def by_group(
    fit: tuple[Floats, Floats, Ints], x: Floats, groups: Ints, falling: bool = False
) -> Floats:
    """Predict y at x with one monotone curve for every group.

    Args:
        fit: x, y and group of the points to fit to, each of shape (n,).
        x: Where to predict, shape (m,).
        groups: Group of each; NaN is predicted where a group has no point to fit to.
        falling: Whether y falls as x rises.
    """
    sign = -1.0 if falling else 1.0
    known_x, known_y, known = fit
    predicted = np.full(len(x), np.nan)
    for group in np.unique(groups):
        of, at = known == group, groups == group
        if of.any():
            predicted[at] = Curve.through(sign * known_x[of], known_y[of])(sign * x[at])
    return predicted
