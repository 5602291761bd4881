"""95 % intervals from a few groups that vary as wholes: each group is left out in turn."""

from __future__ import annotations

import numpy as np

from antennate.types import Floats, Ints

ENOUGH = 5
"""Fewest trials from which an interval of a mean is told. By Student's t that of two is seven times
as wide as that of five at the same spread: such an interval decides nothing."""
MANY = 10
"""Fewest groups from which the interval of a median is that of a share, taken as quantiles."""


def student95(freedom: int) -> float:
    """Half width of a 95 % interval in standard errors, by Student's t of so many degrees."""
    from scipy.special import stdtrit  # scipy.stats takes half a second longer

    return float(stdtrit(freedom, 0.975))


def jackknife95(value: Floats | float, left: Floats) -> Floats:
    """Jackknife interval by Student's t of one degree less than groups.

    A bootstrap that draws whole groups anew is too narrow where groups are few: Cameron, Gelbach
    and Miller (2008), Review of Economics and Statistics 90, 414-427. The jackknife: Efron and
    Tibshirani (1993), An Introduction to the Bootstrap, chapter 11.

    Args:
        value: Of all groups, shape (...).
        left: The same without each group, shape (groups, ...).

    Returns:
        Both ends, shape (2, ...); NaN with fewer than two groups, or where it does not matter which
        one is left out: that tells nothing of the next.
    """
    count = len(left)
    if count < 2:
        return np.full((2, *np.shape(value)), np.nan)
    half = student95(count - 1) * np.sqrt((count - 1) * left.var(axis=0))
    half = np.where(np.ptp(left, axis=0) == 0.0, np.nan, half)
    return np.stack([value - half, value + half])


def median95(values: Floats, groups: Ints) -> Floats:
    """Interval of the median of values that vary in groups.

    The jackknife of a median does not come right however many groups there are, as few values
    decide it: Efron and Tibshirani (1993), section 11.6. From MANY groups on, the interval is the
    jackknife's of the share of values below the median, about one half, and ends at the quantiles
    of both shares: Woodruff (1952), Journal of the American Statistical Association 47, 635-646.
    Of fewer groups that is up to two and a half times as wide where they differ much.

    Args:
        values: All values, shape (n,).
        groups: Group of each, shape (n,).

    Returns:
        Both ends, shape (2,); NaN as in `jackknife95`.
    """
    names, where, sizes = np.unique(groups, return_inverse=True, return_counts=True)
    if len(names) < 2:
        return np.full(2, np.nan)
    median = np.median(values)
    if len(names) < MANY:
        return jackknife95(median, np.array([np.median(values[groups != one]) for one in names]))
    below = (values < median) + 0.5 * (values == median)
    sums = np.bincount(where, weights=below)
    shares = jackknife95(0.5, (sums.sum() - sums) / (len(values) - sizes))
    return shares if np.isnan(shares).any() else np.quantile(values, np.clip(shares, 0, 1))
