"""Intervals and paired tests against published figures and hand counts."""

from __future__ import annotations

import math
import subprocess
import sys
from collections.abc import Sequence
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import binomtest, t, wilcoxon

from antennate.jackknife import student95
from antennate.studies import statistics


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


@pytest.mark.parametrize("words", [["tunnel"], ["study", "plan.toml", "--trust-code"]])
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
    """Times of which some are the limit: the mean lies within, so a cut interval holds it too."""
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
    first, second = np.array([0.0] * 4 + [limit] * 2), np.array([limit] * 5 + [0.0])
    ok = np.ones(6, bool)
    ends = statistics.compare(ok, ok, first, second, limit).time_difference_95
    assert ends is not None
    assert ends[0] == -limit  # 50 s quicker on average, give or take 88 s
    assert -limit < ends[1] < limit


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


def signed_rank(difference: list[float]) -> float | None:
    """p of trials that differ by so much."""
    ok = np.ones(len(difference), bool)
    first = np.array(difference)
    return statistics.compare(ok, ok, first, np.zeros_like(first)).wilcoxon_p


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


def test_many_pairs_are_tested_by_the_normal_approximation() -> None:
    difference = np.random.default_rng(3).normal(0.2, 1.0, 51).tolist()
    _, p = np.asarray(wilcoxon(difference, method="exact"))
    assert signed_rank(difference) == pytest.approx(p, rel=0.02)
