"""How much of one quantity another predicts: rising curves, and the variance that they explain."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import BeforeValidator

from antennate.jackknife import ENOUGH, jackknife95
from antennate.studies.columns import column, tabular
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


Number = Annotated[float, BeforeValidator(lambda value: math.nan if value is None else value)]
"""A number that is NaN where it does not exist, which is `null` in result.json."""


@tabular
class Explained:
    """How well a prediction serves; `null` where nothing is predicted."""

    n: int
    """Loads or samples predicted, none of which served to fit."""
    r2: Number = column("R2", interval="r2_95")
    """Share of the variance explained: 1 - sum (y - prediction)² / sum (y - mean y)², below 0 where
    the mean predicts better. The interval is over groups, by jackknife and Student's t; both ends
    are `null` with fewer than five."""
    r2_95: tuple[Number, Number]
    rmse: Number
    """Root mean square error [N]."""
    groups: int
    """Loads or traverses behind these."""


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
        return Explained(n=0, r2=math.nan, r2_95=(math.nan, math.nan), rmse=math.nan, groups=0)
    _, where = np.unique(groups, return_inverse=True)
    parts = (np.ones_like(truth), truth, truth**2, (truth - prediction) ** 2)
    sums = np.stack([np.bincount(where, weights=part) for part in parts], axis=1)
    whole = sums.sum(axis=0)
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        share, left = _unexplained(whole), _unexplained(whole - sums)
        low, high = 1.0 - np.exp(jackknife95(np.log(share), np.log(left))[::-1])
    if len(sums) < ENOUGH:
        low = high = np.nan
    return Explained(
        n=len(truth),
        r2=float(1.0 - share),
        r2_95=(float(low), float(high)),
        rmse=float(np.sqrt(parts[3].mean())),
        groups=len(sums),
    )


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
