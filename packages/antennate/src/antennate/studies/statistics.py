"""Intervals of shares, means and differences, and tests for paired trials."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from antennate.jackknife import ENOUGH, student95
from antennate.studies.columns import Ends, Frame, column, percent, tabular
from antennate.studies.pooling import count, share
from antennate.types import Bools, Floats, Ints

_Z95 = 1.959963984540054
"""The 97.5 % quantile of the normal distribution."""
_SAME = 1e-10
"""Differences [s or share] that lie no farther apart are equal: times have ticks of 1e-3 s or more,
tables six decimals, and sums of them round in the last of 16 digits."""
_EXACT = 50
"""Most pairs whose signed ranks are tested exactly; beyond, the normal approximation is close."""


def wilson95(successes: float, trials: float) -> tuple[float, float]:
    """Wilson 95 % interval of a success rate; (0, 1) without trials.

    Every run needs it, and scipy.stats takes half a second to import; the numbers are the same,
    bit for bit. Formula: Newcombe (1998), Statistics in Medicine 17, 857-872, method 3.
    """
    if trials == 0:
        return 0.0, 1.0
    rate, square = successes / trials, _Z95**2
    below = 2 * (trials + square)
    center = (2 * trials * rate + square) / below
    half = _Z95 / below * math.sqrt(4 * trials * rate * (1 - rate) + square)
    low = 0.0 if successes == 0 else center - half
    return low, 1.0 if successes == trials else center + half


def wilson(name: str = "outcome", value: Any = "success") -> Any:
    """A column: Wilson's 95 % interval of the share of rows that hold a value in a column."""

    def ends(rows: Frame, _: str) -> Ends | None:
        return wilson95(int((rows[name] == value).sum()), len(rows)) if len(rows) else None

    return percent("  Wilson 95 %", pool=ends)


@tabular
class Outcomes:
    """How trials ended."""

    trials: int = column("trials", form="d")
    successes: int = column("successes", pool=count("outcome", "success"), form="d")
    success_share: float | None = percent("  share", pool=share("outcome", "success"))
    """Successes over valid trials; `null` without any."""
    wilson95: Ends | None = wilson()
    """Wilson's interval of that share; `null` without any."""
    timeouts: int = column("out of time", pool=count("outcome", "timeout"), form="d")
    """Trials that ran out of time."""
    left: int = column("left the scene", pool=count("outcome", "left"), form="d")
    """Trials in which the robot left the scene by another way than its end."""
    invalid: int = column("invalid", form="d")
    first_reason: str | None


def mean95(
    values: Floats, least: float = -math.inf, most: float = math.inf, restricted: bool = False
) -> tuple[float, Ends | None]:
    """Mean of values and its 95 % interval: by Student's t, or joined where failures are the limit.

    Args:
        values: The values, shape (n,).
        least: What no value can lie below, as 0 for a time or a share. The mean of them cannot
            either, so the interval is cut there: it loses nothing that could be true.
        most: What no value can exceed, likewise, as the time limit of a restricted time.
        restricted: Whether a value of `most` stands for a failure, as in restricted times. The
            interval then joins that of the share of failures and that of the others, see `joined`.
            It reaches up for failures that few trials did not meet.

    Returns:
        The mean, NaN of no values, and the ends; None of fewer than `ENOUGH` values.
    """
    mean = float(values.mean()) if len(values) else float("nan")
    if len(values) < ENOUGH:
        return mean, None
    rare = [(values >= most, most)] if restricted and math.isfinite(most) else []
    low, high = joined(values, rare, max(least, 0.0) if rare else 0.0)
    return mean, (max(least, low), min(most, high))


def mean95_by_draw(values: Floats, draw: Ints, least: float) -> tuple[float, Ends | None]:
    """Mean of values of which some belong to one draw, and its 95 % interval over draws.

    It is that of a ratio of two sums, of what the draws bring over how many they bring (Cochran
    1977, Sampling Techniques, section 6.4), by Student's t.

    Args:
        values: The values, shape (n,).
        draw: Number of the draw of each, shape (n,).
        least: As for `mean95`.
    """
    counts = np.bincount(draw)
    counts = counts[counts > 0]
    mean, _ = mean95(values)
    excess = np.bincount(draw, weights=values - mean)[np.unique(draw)]
    ends = mean95(mean + excess * len(counts) / max(len(values), 1), least)[1]
    return mean, None if ends is None else (min(ends[0], mean), max(ends[1], mean))


def difference95(first: Floats, second: Floats, limit: float) -> tuple[float, Ends | None]:
    """Mean difference of restricted times trial by trial and its 95 % interval, see `joined`.

    Rare are the trials in which one alone fails. Without such a trial it would differ from the
    usual time by what is left to the limit. Without a finite limit the interval is Student's.

    Args:
        first: Times of the first, a failure as the limit [s], shape (n,).
        second: The same of the second.
        limit: The limit [s]: no difference is larger, in either direction.
    """
    difference = first - second
    mean = float(difference.mean()) if len(difference) else float("nan")
    if len(difference) < ENOUGH:
        return mean, None
    lost, beaten = first >= limit, second >= limit
    rare = [
        (lost & ~beaten, limit - _mean(second[~beaten], 0.0)),
        (beaten & ~lost, _mean(first[~lost], 0.0) - limit),
    ]
    low, high = joined(difference, rare if math.isfinite(limit) else [])
    return mean, (max(-limit, low), min(limit, high))


def joined(values: Floats, rare: Sequence[tuple[Bools, float]], usual: float = 0.0) -> Ends:
    """95 % interval of the mean of values of which up to two classes are rare, as failures.

    Student's interval of many usual values and few that lie far off is too short: it knows nothing
    of the rare ones that it has not met (benchmarks/coverage.py). So the share of each rare class
    has Wilson's interval, times how far the class lies from the usual values; the spread within
    the classes has Student's; and the distances of the ends from the mean are added as squares,
    with the correlation of two shares of one sample. The way: Zou and Donner (2008), Statistics in
    Medicine 27, 1693-1702; for means with many zeros Zou, Taleban and Huo (2009), Computational
    Statistics and Data Analysis 53, 3755-3764, there with lognormal values. Without rare classes
    it is Student's interval.

    Args:
        values: The values, shape (n,), at least two.
        rare: Whether each value is of a rare class, shape (n,), and the value of that class where
            there is none. Classes do not overlap.
        usual: The usual value where there is none.
    """
    count, mean = len(values), float(values.mean())
    common = np.ones(count, bool)
    for mask, _ in rare:
        common &= ~mask
    center = np.full(count, _mean(values[common], usual))
    below, above, shares, signs = list[float](), list[float](), list[float](), list[float]()
    for mask, value in rare:
        jump = _mean(values[mask], value) - _mean(values[common], usual)
        center[mask] += jump
        number = int(mask.sum())
        ends = sorted(jump * (end - number / count) for end in wilson95(number, count))
        below.append(-ends[0])
        above.append(ends[1])
        shares.append(number / count)
        signs.append(math.copysign(1.0, jump))
    freedom = max(1, count - int(common.any()) - sum(bool(mask.any()) for mask, _ in rare))
    error2 = float(((values - center) ** 2).sum()) / freedom / count
    half2 = student95(freedom) ** 2 * error2
    link = -math.prod(signs) * _odds(shares) if len(rare) == 2 else 0.0
    low, high = (
        math.sqrt(max(0.0, half2 + sum(d * d for d in off) + 2.0 * link * math.prod(off)))
        for off in (below, above)
    )
    return mean - low, mean + high


def _odds(shares: Sequence[float]) -> float:
    """How strongly two shares of one sample exclude one another: minus their correlation."""
    if max(shares) == 1.0:
        return 0.0
    return min(1.0, math.sqrt(math.prod(share / (1.0 - share) for share in shares)))


def _mean(values: Floats, without: float) -> float:
    return float(values.mean()) if len(values) else without


@tabular
class Both:
    """How many trials two conditions have in common."""

    trials: int = column("valid in both", form="d")
    """Trials that are valid in both."""


@tabular
class Discordance:
    """Two conditions on the same trials, by success alone."""

    only_first: int = column("only the first", form="d")
    """Trials on which only the first succeeded."""
    only_second: int = column("only the second", form="d")
    """Trials on which only the second succeeded."""
    mcnemar_p: float = column("McNemar p", form=".3g")
    """McNemar's test on those, exact and two-sided."""


@tabular
class Matched(Discordance, Both):
    """Two conditions on the same trials, by success, and how many those are."""


def mcnemar(ok: Bools) -> Matched:
    """Compare the successes of two conditions trial by trial, shape (n, 2)."""
    from scipy.special import bdtr  # scipy.stats takes half a second longer

    first, second = ok[:, 0], ok[:, 1]
    only_first, only_second = int((first & ~second).sum()), int((second & ~first).sum())
    tail = float(bdtr(min(only_first, only_second), only_first + only_second, 0.5))
    p = min(1.0, 2.0 * tail)
    return Matched(trials=len(ok), only_first=only_first, only_second=only_second, mcnemar_p=p)


def sign_flips(sums: Ints) -> float:
    """Exact two-sided p that two conditions succeed alike, by draws with several trials each.

    Sums are successes of the first less those of the second, whole numbers of shape (n,). Had the
    conditions changed places in a draw, its sum would have the other sign: p is the share of all
    2^n choices of signs whose total is as far from 0 as the one found, or farther. With one trial
    a draw this is McNemar's exact test. Trials of one draw may depend on one another.
    """
    sizes = np.abs(sums)[sums != 0]
    most = int(sizes.sum())
    chance = np.zeros(2 * most + 1)
    chance[most] = 1.0  # of each total, from -most on
    for size in sizes:
        chance = (np.roll(chance, size) + np.roll(chance, -size)) / 2.0
    far = abs(np.arange(-most, most + 1)) >= abs(int(sums.sum()))
    return min(1.0, float(chance[far].sum()))


def wilson95_by_draw(successes: Ints, trials: Ints) -> tuple[float, float]:
    """Wilson 95 % interval of a success rate over draws with several trials each, shape (n,).

    It is that of so many independent trials as tell as much (Rao and Scott 1992, Biometrics 48,
    577-585): fewer where the trials of a draw end alike, though as many as draws at least. Where
    nothing shows how alike, as all succeed or there is one draw, each draw counts once.
    """
    count, draws = int(trials.sum()), len(trials)
    if count == 0:
        return wilson95(0, 0)
    rate = float(successes.sum()) / count
    spread = float(((successes - rate * trials) ** 2).sum()) / count**2
    effective = float(draws)
    if draws > 1 and spread > 0.0:
        alone = rate * (1.0 - rate) / (spread * draws / (draws - 1.0))
        effective = min(max(alone, effective), float(count))
    return wilson95(rate * effective, effective)


def poisson95(number: int) -> tuple[float, float]:
    """Exact 95 % interval of the mean of a Poisson count: Garwood (1936), Biometrika 28, 437."""
    from scipy.special import gammaincinv  # scipy.stats takes half a second longer

    low = float(gammaincinv(number, 0.025)) if number else 0.0
    return low, float(gammaincinv(number + 1, 0.975))


def holm(p: Sequence[float]) -> list[float]:
    """P values of several tests, raised so that one false rejection among them stays unlikely.

    Holm (1979), Scandinavian Journal of Statistics 6, 65-70: the k-th smallest of m is multiplied
    by m - k + 1, and none is smaller than the one before it.
    """
    raised, least = [0.0] * len(p), 0.0
    for rank, place in enumerate(sorted(range(len(p)), key=lambda i: p[i])):
        least = max(least, min(1.0, (len(p) - rank) * p[place]))
        raised[place] = least
    return raised


def signed_rank(difference: Floats) -> float:
    """Two-sided p of Wilcoxon's signed-rank test on differences (n,), with Pratt's ranks.

    Equal differences share the mean of their ranks; equal are those that rounding alone sets apart,
    as 0.3 - 0.1 and 0.5 - 0.3. Zeros, here mostly trials that both fail, take
    the lowest ranks and are left out of the sums: Pratt (1959), Journal of the American Statistical
    Association 54, 655-667. Wilcoxon's own way leaves zeros out before ranking (Hollander and
    Wolfe, Nonparametric Statistical Methods, section 3.1; default of SciPy and R). Its level is as
    right, but a set of differences can lose significance when all of them grow, as Pratt shows.

    Up to 50 differences it is exact, also with ties: the signs of those that are not zero, each as
    likely as the other. Beyond, it is the normal approximation without correction of continuity,
    with the variance of Cureton (1967), the same journal 62, 1068-1069. That is
    `scipy.stats.wilcoxon(..., zero_method="pratt", method="asymptotic")`, whose import takes half
    a second.
    """
    sizes = np.abs(difference)
    known = sizes > _SAME
    if not known.any():
        return 1.0
    order = np.argsort(sizes)
    steps = np.diff(sizes[order], prepend=0.0) > _SAME
    size = np.empty(len(sizes), int)
    size[order] = np.unique(np.cumsum(steps), return_inverse=True)[1]
    counts = np.bincount(size)
    twice = (2 * np.cumsum(counts) - counts + 1)[size][known]  # ties have ranks with halves
    if len(difference) > _EXACT:
        from scipy.special import ndtr  # scipy.stats takes half a second longer

        above = twice[difference[known] > 0].sum() - twice.sum() / 2
        return 2.0 * float(ndtr(-abs(above) / math.sqrt((twice.astype(float) ** 2).sum() / 4)))
    chance = np.ones(1)  # of each sum of the ranks of positive differences
    for rank in twice:
        chance = (np.pad(chance, (0, rank)) + np.pad(chance, (rank, 0))) / 2
    off = abs(2 * np.arange(len(chance)) - twice.sum())
    return float(chance[off >= off[twice[difference[known] > 0].sum()]].sum())


@tabular
class PairedTest(Matched):
    """Two conditions on the same seeds, by success and by time."""

    both: int = column("both succeeded", form="d")
    """Trials on which both succeeded."""
    both_time_s: Ends | None = column("  time of each", "s", form=".1f", join=", ")
    """Mean times of the first and of the second on those; `null` without any."""
    time_difference_s: float | None = column(
        "difference", "s", form="+.1f", interval="time_difference_95", default=None
    )
    """Mean of restricted time, first minus second, and its interval."""
    time_difference_95: Ends | None = None
    wilcoxon_p: float | None = column("Wilcoxon p", form=".3g")
    """Two-sided signed-rank test on restricted times, see `signed_rank`; `null` with one trial."""


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
    mean, ends = difference95(first_t, second_t, limit)
    rank = signed_rank(difference) if len(difference) > 1 else None
    both = first_ok & second_ok
    times = (float(first_t[both].mean()), float(second_t[both].mean())) if both.any() else None
    return PairedTest(
        **vars(success),
        both=int(both.sum()),
        both_time_s=times,
        time_difference_s=mean,
        time_difference_95=ends,
        wilcoxon_p=rank,
    )
