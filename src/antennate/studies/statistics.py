"""Intervals and tests for paired trials."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from antennate.jackknife import ENOUGH, student95
from antennate.types import Bools, Floats

_Z95 = 1.959963984540054
"""The 97.5 % quantile of the normal distribution."""
_EXACT = 50
"""Most pairs whose signed ranks are tested exactly; beyond, the normal approximation is close."""


def wilson95(successes: int, trials: int) -> tuple[float, float]:
    """Wilson 95 % interval of a success rate; (0, 1) without trials.

    Every run needs it, and scipy.stats takes a second to import; the numbers are the same, bit for
    bit. Formula: Newcombe (1998), Statistics in Medicine 17, 857-872, method 3.
    """
    if trials == 0:
        return 0.0, 1.0
    rate, square = successes / trials, _Z95**2
    below = 2 * (trials + square)
    center = (2 * trials * rate + square) / below
    half = _Z95 / below * math.sqrt(4 * trials * rate * (1 - rate) + square)
    low = 0.0 if successes == 0 else center - half
    return low, 1.0 if successes == trials else center + half


Ends = tuple[float, float]
"""Lower and upper end of an interval."""


def mean95(
    values: Floats, least: float = -math.inf, most: float = math.inf
) -> tuple[float, Ends | None]:
    """Mean of values and its 95 % interval, by Student's t.

    Args:
        values: The values, shape (n,).
        least: What no value can lie below, as 0 for a time or a share. The mean of them cannot
            either, so the interval is cut there: it loses nothing that could be true.
        most: What no value can exceed, likewise, as the time limit of a restricted time.

    Returns:
        The mean, NaN of no values, and the ends; None of fewer than `ENOUGH` values.
    """
    count = len(values)
    mean = float(values.mean()) if count else float("nan")
    if count < ENOUGH:
        return mean, None
    half = student95(count - 1) * float(values.std(ddof=1)) / math.sqrt(count)
    return mean, (max(least, mean - half), min(most, mean + half))


@dataclass(frozen=True, slots=True)
class Discordance:
    """Two conditions on the same trials, by success alone.

    Attributes:
        only_first: Trials on which only the first succeeded; `only_second` likewise.
        mcnemar_p: Exact two-sided McNemar test on those.
    """

    only_first: int
    only_second: int
    mcnemar_p: float


def mcnemar(ok: Bools) -> Discordance:
    """Compare the successes of two conditions trial by trial, shape (n, 2)."""
    from scipy import stats  # takes long; only where it is needed

    first, second = ok[:, 0], ok[:, 1]
    only_first, only_second = int((first & ~second).sum()), int((second & ~first).sum())
    discordant = only_first + only_second
    p = float(stats.binomtest(only_first, discordant).pvalue) if discordant else 1.0
    return Discordance(only_first, only_second, p)


def signed_rank(difference: Floats) -> float:
    """Two-sided p of Wilcoxon's signed-rank test on differences (n,).

    Equal differences share the mean of their ranks; zeros take ranks, too, and count half for
    either side. Up to 50 differences it is exact: the signs of those that are not zero, each as
    likely as the other. Beyond, it is the normal approximation.
    """
    from scipy import stats  # takes long; only where it is needed

    known = difference != 0
    if not known.any():
        return 1.0
    if len(difference) > _EXACT:
        test = stats.wilcoxon(difference, zero_method="zsplit", method="asymptotic")
        return float(np.asarray(test)[1])
    twice = np.rint(2 * stats.rankdata(np.abs(difference))).astype(int)[known]  # ties have halves
    chance = np.ones(1)  # of each sum of the ranks of positive differences
    for rank in twice:
        chance = (np.pad(chance, (0, rank)) + np.pad(chance, (rank, 0))) / 2
    off = abs(2 * np.arange(len(chance)) - twice.sum())
    return float(chance[off >= off[twice[difference[known] > 0].sum()]].sum())


@dataclass(frozen=True, slots=True)
class PairedTest:
    """Two conditions on the same seeds.

    Attributes:
        only_first: Seeds on which only the first succeeded; `only_second` likewise.
        mcnemar_p: Exact two-sided McNemar test on those.
        time_difference_s: Mean of restricted time, first minus second [s].
        time_difference_95: Its 95 % interval, see `mean95`.
        wilcoxon_p: Two-sided signed-rank test on restricted times, see `signed_rank`; None of one
            seed.
        both: Seeds on which both succeeded; `both_time_s` are the mean times of the first and the
            second on those [s], None without any.
    """

    only_first: int
    only_second: int
    mcnemar_p: float
    time_difference_s: float
    time_difference_95: Ends | None
    wilcoxon_p: float | None
    both: int
    both_time_s: tuple[float, float] | None


def compare(
    first_ok: Bools,
    second_ok: Bools,
    first_t: Floats,
    second_t: Floats,
    limit: float = math.inf,
) -> PairedTest:
    """Compare two conditions by trial.

    Args:
        first_ok: Whether the first succeeded, shape (n,).
        second_ok: The same of the second.
        first_t: Times of the first, restricted to the limit [s], shape (n,).
        second_t: The same of the second.
        limit: The limit [s]: no difference is larger, in either direction.
    """
    success = mcnemar(np.stack([first_ok, second_ok], axis=1))
    difference = first_t - second_t
    mean, ends = mean95(difference, -limit, limit)
    rank = signed_rank(difference) if len(difference) > 1 else None
    both = first_ok & second_ok
    times = (float(first_t[both].mean()), float(second_t[both].mean())) if both.any() else None
    return PairedTest(
        *(success.only_first, success.only_second, success.mcnemar_p),
        *(mean, ends, rank, int(both.sum()), times),
    )
