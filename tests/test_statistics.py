"""Intervals and paired tests against published figures and hand counts."""

from __future__ import annotations

import math
import subprocess
import sys
from collections.abc import Sequence
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.optimize import root_scalar
from scipy.stats import PermutationMethod, binomtest, t, wilcoxon

from antennate.jackknife import student95
from antennate.studies import statistics
from antennate.studies.statistics import Ends


@pytest.mark.parametrize(
    ("successes", "trials", "low", "high"), [(10, 10, 0.72, 1.0), (6, 10, 0.31, 0.83)]
)
def test_wilson_intervals_of_the_papers_counts(
    successes: int, trials: int, low: float, high: float
) -> None:
    assert statistics.wilson95(successes, trials) == pytest.approx((low, high), abs=0.005)


@pytest.mark.parametrize("trials", [1, 2, 3, 10, 30, 97, 100, 4096])
def test_wilson_intervals_are_those_of_scipy_bit_for_bit(trials: int) -> None:
    for successes in {*range(0, trials + 1, max(1, trials // 40)), trials}:
        found = binomtest(successes, trials).proportion_ci(0.95, method="wilson")
        assert statistics.wilson95(successes, trials) == (found.low, found.high)


@pytest.mark.parametrize("count", [2, 3, 10, 200])
def test_the_quantile_of_student_is_that_of_scipy_bit_for_bit(count: int) -> None:
    assert student95(count - 1) == t.ppf(0.975, count - 1)


@pytest.mark.ci
@pytest.mark.parametrize(
    "words",
    [pytest.param(["tunnel"], marks=pytest.mark.slow), ["study", "plan.toml", "--trust-code"]],
)
def test_a_run_of_one_condition_starts_without_the_statistics_of_scipy(
    tmp_path: Path, words: list[str]
) -> None:
    """They take a second to import."""
    text = (
        'experiment = "tunnel"\ntrials = 1\n[settings]\ncontrollers = ["open"]\ntime_limit = 0.1\n'
    )
    (tmp_path / "plan.toml").write_text(text + '[vary]\n"tunnel.strewn" = [0, 4]\n')
    few = ["--controllers", "open", "--scene", "flat", "--time-limit", "0.1", "--trials", "1"]
    words = [*words, *(few if words == ["tunnel"] else []), "--workers", "1", "--no-figures"]
    code = f"""
import sys
from antennate.cli import main
assert main({words}) == 0
assert "scipy.stats" not in sys.modules
"""
    subprocess.run([sys.executable, "-c", code], cwd=tmp_path, check=True)


def test_no_trials_say_nothing() -> None:
    assert statistics.wilson95(0, 0) == (0.0, 1.0)
    mean, ends = statistics.mean95(np.array([]))
    assert math.isnan(mean)
    assert ends is None


@pytest.mark.parametrize(
    ("count", "quantile"),
    [(5, 2.776), (10, 2.262), (21, 2.086), (121, 1.980)],
)
def test_the_interval_of_a_mean_has_the_printed_quantiles_of_student(
    count: int, quantile: float
) -> None:
    """Table III of Fisher and Yates (1963), P = 0.05, for count - 1 degrees of freedom."""
    values = np.random.default_rng(count).normal(5.0, 2.0, count)
    mean, ends = statistics.mean95(values)
    assert ends is not None
    low, high = ends
    error = math.sqrt(sum((v - mean) ** 2 for v in values) / (count - 1) / count)
    assert mean == pytest.approx(sum(values) / count)
    assert (high - mean) / error == pytest.approx(quantile, abs=6e-4)
    assert (mean - low) / error == pytest.approx(quantile, abs=6e-4)


@pytest.mark.parametrize("count", [5, 10])
def test_19_of_20_intervals_of_few_values_hold_the_true_mean(count: int) -> None:
    rng = np.random.default_rng(count)
    found = [statistics.mean95(rng.normal(5.0, 2.0, count)) for _ in range(4000)]
    held = np.mean([ends is not None and ends[0] < 5.0 < ends[1] for _, ends in found])
    assert held == pytest.approx(0.95, abs=4 * math.sqrt(0.05 * 0.95 / 4000))


@pytest.mark.parametrize("count", [1, 2, 3, 4])
def test_few_values_have_a_mean_and_no_interval(count: int) -> None:
    """Four degrees of freedom are the fewest: below, Student's quantile is above three."""
    values = np.arange(count, dtype=float)
    assert statistics.mean95(values) == ((count - 1) / 2, None)
    one = np.zeros(count, bool)
    found = statistics.compare(one, one, values, np.zeros(count), 100.0)
    assert found.time_difference_s == (count - 1) / 2
    assert found.time_difference_95 is None


def test_an_interval_ends_where_its_values_do_and_loses_no_mean() -> None:
    """A mean of values within bounds lies within, so a cut interval holds it too."""
    limit, share = 100.0, 0.9
    rng, cut = np.random.default_rng(9), 0
    for _ in range(500):
        late = rng.random(6) < share
        values = np.where(late, limit, 20.0)
        truth = share * limit + (1 - share) * 20.0
        (_, whole), (_, ends) = statistics.mean95(values), statistics.mean95(values, 0.0, limit)
        assert whole is not None
        assert ends is not None
        assert 0.0 <= ends[0] <= ends[1] <= limit
        assert (whole[0] <= truth <= whole[1]) == (ends[0] <= truth <= ends[1])
        cut += whole != ends
    assert cut > 100


LIMIT = 100.0


def restricted(times: Sequence[float] | np.ndarray) -> tuple[float, float]:
    """The interval of the mean of restricted times."""
    _, ends = statistics.mean95(np.array(times, float), 0.0, LIMIT, restricted=True)
    assert ends is not None
    return ends


def difference(first: Sequence[float] | np.ndarray, second: Sequence[float] | np.ndarray) -> Ends:
    """The interval of the mean difference of restricted times."""
    _, ends = statistics.difference95(np.array(first, float), np.array(second, float), LIMIT)
    assert ends is not None
    return ends


@pytest.mark.parametrize(
    ("failures", "trials", "low", "high"),
    # Newcombe (1998), Statistics in Medicine 17, 857-872, table I, method 3
    [
        (81, 263, 0.2553, 0.3662),
        (15, 148, 0.0624, 0.1605),
        (0, 20, 0.0, 0.1611),
        (1, 29, 0.0061, 0.1718),
    ],
)
def test_times_that_do_not_vary_have_wilsons_interval_of_their_failures(
    failures: int, trials: int, low: float, high: float
) -> None:
    times = [LIMIT] * failures + [20.0] * (trials - failures)
    assert restricted(times) == pytest.approx((20.0 + 80.0 * low, 20.0 + 80.0 * high), abs=0.005)


@pytest.mark.parametrize("failures", [0, 1, 20, 39, 40])
def test_the_interval_is_the_sum_in_squares_of_wilsons_and_students(failures: int) -> None:
    """By hand; with no failure it reaches up for those that 40 trials do not meet."""
    times = np.random.default_rng(failures).uniform(10.0, 40.0, 40 - failures)
    mean = times.mean() if failures < 40 else 0.0
    share = binomtest(failures, 40).proportion_ci(0.95, method="wilson")
    freedom = max(40 - (failures > 0) - (failures < 40), 1)
    half = t.ppf(0.975, freedom) * math.sqrt(((times - mean) ** 2).sum() / freedom / 40)
    whole = np.append(times, [LIMIT] * failures)
    low = whole.mean() - math.hypot(half, (LIMIT - mean) * (failures / 40 - share.low))
    high = whole.mean() + math.hypot(half, (LIMIT - mean) * (share.high - failures / 40))
    assert restricted(whole) == pytest.approx((max(low, 0.0), min(high, LIMIT)))


def tango(only_first: int, only_second: int, trials: int) -> Ends:
    """Score interval of a paired difference of shares: Tango (1998), Stat. Med. 17, 891-908."""

    def score(delta: float) -> float:
        b = -only_first - only_second + (2 * trials - only_first + only_second) * delta
        c = -only_second * delta * (1.0 - delta)
        nuisance = (math.sqrt(b * b - 8 * trials * c) - b) / (4 * trials)
        spread = trials * (2.0 * nuisance + delta * (1.0 - delta))
        return (only_first - only_second - trials * delta) / math.sqrt(spread)

    middle = (only_first - only_second) / trials
    low, high = (
        root_scalar(lambda x, z=z: score(x) - z, bracket=(middle, end)).root
        for z, end in ((1.959964, -0.999), (-1.959964, 0.999))
    )
    return low, high


@pytest.mark.parametrize(("only_first", "only_second"), [(12, 2), (10, 10), (5, 1), (1, 0)])
def test_a_difference_of_failures_alone_is_near_the_score_interval_of_tango(
    only_first: int, only_second: int
) -> None:
    trials = 50
    same = [20.0] * (trials - only_first - only_second)
    first = [LIMIT] * only_first + [20.0] * only_second + same
    second = [20.0] * only_first + [LIMIT] * only_second + same
    found = np.array(difference(first, second)) / 80.0
    wide = np.array(tango(only_first, only_second, trials))
    assert found == pytest.approx(wide, abs=0.05)
    if only_second:
        assert np.ptp(found) == pytest.approx(np.ptp(wide), rel=0.1)


def trials_of(seed: int, count: int, share: float) -> np.ndarray:
    """Restricted times, lognormal below the limit, with a share of failures."""
    rng = np.random.default_rng(seed)
    times = np.minimum(18.0 * np.exp(rng.normal(0.0, 0.4, count)), 99.0)
    return np.where(rng.random(count) < share, LIMIT, times)


@pytest.mark.parametrize("share", [0.0, 0.1, 0.5, 1.0])
@pytest.mark.parametrize("count", [5, 40])
def test_an_interval_of_differences_turns_with_the_pair_and_stays_in_bounds(
    count: int, share: float
) -> None:
    for seed in range(20):
        first, second = trials_of(seed, count, share), trials_of(seed + 100, count, share / 2)
        low, high = difference(first, second)
        assert difference(second, first) == pytest.approx((-high, -low), abs=1e-9)
        assert -LIMIT <= low <= (first - second).mean() <= high <= LIMIT
        low, high = restricted(first)
        assert 0.0 <= low <= first.mean() <= high <= LIMIT


@pytest.mark.parametrize("factor", [0.01, 60.0])
def test_the_unit_of_time_does_not_matter(factor: float) -> None:
    first, second = trials_of(1, 40, 0.1), trials_of(2, 40, 0.1)
    mean, ends = statistics.mean95(factor * first, 0.0, factor * LIMIT, restricted=True)
    assert ends == pytest.approx(np.multiply(factor, restricted(first)))
    assert mean == pytest.approx(factor * first.mean())
    _, ends = statistics.difference95(factor * first, factor * second, factor * LIMIT)
    assert ends == pytest.approx(np.multiply(factor, difference(first, second)))


def test_later_starts_of_clock_and_limit_move_both_ends() -> None:
    first, second = trials_of(3, 30, 0.1), trials_of(4, 30, 0.1)
    _, ends = statistics.difference95(first + 7.0, second + 7.0, LIMIT + 7.0)
    assert ends == pytest.approx(difference(first, second))
    _, ends = statistics.mean95(first + 7.0, 7.0, LIMIT + 7.0, restricted=True)
    assert ends == pytest.approx(np.add(7.0, restricted(first)))


@pytest.mark.parametrize("count", [5, 12, 40])
def test_more_failures_never_lower_an_end(count: int) -> None:
    times = np.sort(trials_of(5, count, 0.0))[::-1]
    found = np.array([restricted(np.append([LIMIT] * k, times[k:])) for k in range(count)])
    assert (np.diff(found, axis=0) >= -1e-9).all()


@pytest.mark.parametrize("share", [0.01, 0.02, 0.05])
def test_the_interval_holds_the_true_mean_where_few_trials_fail(share: float) -> None:
    """Student's holds 84 to 91 % there: docs/science/statistics.md."""
    rng, held = np.random.default_rng(37), {"joined": 0, "student": 0, "difference": 0}
    many, truth = 2000, 20.0 + 80.0 * share
    for _ in range(many):
        late = rng.random(40) < share
        times = np.where(late, LIMIT, 10.0 + rng.gamma(4.0, 2.5, 40))  # of 10 s on average
        other = 10.0 + rng.gamma(4.0, 2.5, 40)
        low, high = restricted(times)
        held["joined"] += low <= truth <= high
        _, ends = statistics.mean95(times)
        assert ends is not None
        held["student"] += ends[0] <= truth <= ends[1]
        low, high = difference(times, other)
        held["difference"] += low <= 80.0 * share <= high
    assert held["joined"] > 0.94 * many
    assert held["difference"] > 0.94 * many
    assert held["student"] < 0.92 * many


def test_without_a_limit_a_difference_has_students_interval() -> None:
    first, second = trials_of(6, 30, 0.0), trials_of(7, 30, 0.0)
    _, ends = statistics.difference95(first, second, math.inf)
    assert ends == pytest.approx(statistics.mean95(first - second)[1])


def test_mcnemar_counts_the_trials_on_which_the_arms_differ() -> None:
    first = np.array([True] * 6 + [False] * 4)
    second = np.array([True] * 10)
    found = statistics.compare(first, second, np.where(first, 10.0, 100.0), np.full(10, 20.0))
    assert (found.only_first, found.only_second, found.both) == (0, 4, 6)
    assert found.mcnemar_p == pytest.approx(2 * 0.5**4)
    assert found.both_time_s == (10.0, 20.0)
    assert found.time_difference_s == pytest.approx((6 * -10 + 4 * 80) / 10)


def test_equal_arms_do_not_differ() -> None:
    same = np.array([True, False])
    found = statistics.compare(same, same, np.array([5.0, 9.0]), np.array([5.0, 9.0]))
    assert (found.mcnemar_p, found.wilcoxon_p, found.time_difference_s) == (1.0, 1.0, 0.0)


def signed_rank(difference: list[float]) -> float:
    """p of trials that differ by so much."""
    ok = np.ones(len(difference), bool)
    first = np.array(difference)
    p = statistics.compare(ok, ok, first, np.zeros_like(first)).wilcoxon_p
    assert p is not None
    return p


@pytest.mark.parametrize("count", [2, 3, 5, 10, 50])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_pairs_of_one_sign_are_two_of_all_patterns_of_signs(count: int, sign: float) -> None:
    assert signed_rank([sign * n for n in range(1, count + 1)]) == 2 / 2**count
    assert signed_rank([sign] * count) == 2 / 2**count


@pytest.mark.parametrize(
    ("ranks", "p"),
    # T is the sum of the ranks given; of the 2**n patterns 2 * (those with a sum of T or less)
    [([1], 2 * 2 / 2**6), ([3], 2 * 5 / 2**6), ([2, 3], 2 * 10 / 2**6), ([1, 4, 5], 1.0)],
)
def test_the_signed_ranks_of_six_pairs_as_counted_by_hand(ranks: list[int], p: float) -> None:
    assert signed_rank([-n if n in ranks else n for n in range(1, 7)]) == pytest.approx(p)


@pytest.mark.parametrize(
    "difference",
    [
        [1, 1, -1, 2, 2, 3],
        [0, 0, 1, 2, 3, 4, 5],
        [0, -1, 1, 1, 4, 4, -4, 7],
        [0, 0, 0, 5],
        [-100, 0, 0, 0, 30, 30, 30, 30, 2, 2],
    ],
)
def test_ties_and_zeros_as_all_patterns_of_signs_have_them(difference: list[float]) -> None:
    """Zeros have half of their ranks on either side (Pratt's ranks, zeros split)."""
    sizes = [abs(d) for d in difference]
    ranks = [sum(s < own for s in sizes) + (sizes.count(own) + 1) / 2 for own in sizes]
    middle = sum(ranks) / 2

    def off(signs: Sequence[float]) -> float:
        above = sum(r * (s + 1) / 2 for r, s in zip(ranks, signs, strict=True))
        return abs(above - middle)

    signs = [(1, -1) if d else (0,) for d in difference]
    own = off(list(np.sign(difference)))
    every = [off(pattern) >= own for pattern in product(*signs)]
    assert signed_rank(difference) == pytest.approx(sum(every) / len(every), rel=1e-12)


PRATT = np.array([0, 2, 3, 4, 6, 7, 8, 9, 11, 14, 15, 17, -18], float)
"""Pratt (1959), Journal of the American Statistical Association 54, 655-667."""


def test_differences_that_all_fall_do_not_gain_significance_as_pratt_asks() -> None:
    """Leaving zeros out first, as SciPy by default, they do: p falls from 0.034 to 0.028."""
    assert signed_rank(list(PRATT)) < signed_rank(list(PRATT - 1.0))
    left_out = signed_rank(list(PRATT[1:]))
    assert left_out == 2 * 70 / 2**12  # 70 sets of the ranks 1 to 12 have a sum of 12 or less
    assert left_out > signed_rank(list(PRATT - 1.0))


@pytest.mark.parametrize("count", [24, 90])
def test_differences_that_are_equal_in_ticks_are_ties(count: int) -> None:
    """Sums of 0.01 s round in the last digit; SciPy is given the same as whole numbers."""
    rng = np.random.default_rng(4)
    first, second = rng.integers(500, 540, (2, count))
    ticks = first - second
    assert len(np.unique(first * 0.01 - second * 0.01)) > len(np.unique(ticks))
    ok = np.ones(count, bool)
    found = statistics.compare(ok, ok, first * 0.01, second * 0.01).wilcoxon_p
    if count <= 50:
        assert found == pytest.approx(signed_rank(ticks.astype(float).tolist()), rel=1e-12)
    else:
        test = wilcoxon(ticks, zero_method="pratt", method="asymptotic", correction=False)
        assert found == pytest.approx(np.asarray(test)[1], rel=1e-12)


def test_rounding_alone_is_no_difference_and_orders_none() -> None:
    """Of 2, -2 and 3 ticks the ranks 1.5, 1.5 and 3 sum to 4.5: six of eight signs lie so far."""
    assert signed_rank([0.1 + 0.2 - 0.3] * 9) == 1.0
    assert signed_rank([0.3 - 0.1, 0.1 - 0.3 + 1e-16, 0.3]) == signed_rank([2.0, -2.0, 3.0]) == 0.75


def exactly(values: np.ndarray, zeros: str) -> float:
    """All patterns of signs as SciPy goes through them."""
    method: Any = PermutationMethod(n_resamples=2 ** len(values))
    _, p = np.asarray(wilcoxon(values, zero_method=zeros, method=method))
    return float(p)


@pytest.mark.parametrize("values", [PRATT, [0, 0, 1, -2, 3, 3, 4, 5], [0, 0, 0, -1, 2, 2, 6, 6, 9]])
def test_few_pairs_are_tested_as_scipy_does_with_pratts_ranks(values: Sequence[float]) -> None:
    assert signed_rank(list(values)) == pytest.approx(exactly(np.array(values, float), "pratt"))


@pytest.mark.parametrize("zeros", [0, 12])
def test_many_pairs_are_tested_as_scipy_does_by_the_normal_approximation(zeros: int) -> None:
    values = np.random.default_rng(3).normal(0.2, 1.0, 60).round(1)
    values[:zeros] = 0.0
    test = wilcoxon(values, zero_method="pratt", method="asymptotic", correction=False)
    assert signed_rank(values.tolist()) == np.asarray(test)[1]


def test_many_pairs_are_tested_by_the_normal_approximation() -> None:
    difference = np.random.default_rng(3).normal(0.2, 1.0, 51).tolist()
    _, p = np.asarray(wilcoxon(difference, method="exact"))
    assert signed_rank(difference) == pytest.approx(p, rel=0.02)
