"""95 % intervals from a few groups that vary as wholes: each group is left out in turn."""

from __future__ import annotations

import numpy as np

from antennate.types import Floats


def student95(freedom: int) -> float:
    """Half width of a 95 % interval in standard errors, by Student's t of so many degrees."""
    from scipy.special import stdtrit  # scipy.stats takes a second longer

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
