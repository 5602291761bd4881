"""How much of one quantity another predicts: a monotone curve, and the variance it explains."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from antennate.types import Floats, Ints

_DRAWS = 2000


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
        r2_95: Its 95 % interval, bootstrapped over groups.
        rmse: Root mean square error, in the unit of y.
    """

    n: int
    r2: float
    r2_95: tuple[float, float]
    rmse: float


def explained(truth: Floats, prediction: Floats, groups: Ints, seed: int = 0) -> Explained:
    """Test a prediction made without these points.

    Args:
        truth: What was to be predicted, shape (n,).
        prediction: The same shape.
        groups: What is drawn as one in the bootstrap: the trial of each point, shape (n,).
        seed: Seed of the bootstrap, 2000 draws.
    """
    if len(truth) == 0:
        return Explained(0, float("nan"), (float("nan"), float("nan")), float("nan"))
    _, where = np.unique(groups, return_inverse=True)
    parts = (np.ones_like(truth), truth, truth**2, (truth - prediction) ** 2)
    sums = np.stack([np.bincount(where, weights=part) for part in parts], axis=1)
    count = len(sums)
    drawn = np.random.default_rng(seed).multinomial(count, np.full(count, 1 / count), _DRAWS)
    with np.errstate(invalid="ignore", divide="ignore"):
        low, high = np.nanpercentile(_r2(drawn.astype(np.float64) @ sums), [2.5, 97.5])
        r2 = float(_r2(sums.sum(axis=0)))
    rmse = float(np.sqrt(parts[3].mean()))
    return Explained(len(truth), r2, (float(low), float(high)), rmse)


def _r2(sums: Floats) -> Floats:
    n, first, second, error = np.moveaxis(sums, -1, 0)
    return 1.0 - error / (second - first**2 / n)


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
    found = np.full(len(x), np.nan)
    for group in np.unique(groups):
        of, at = known == group, groups == group
        if of.any():
            found[at] = Curve.through(sign * known_x[of], known_y[of])(sign * x[at])
    return found
