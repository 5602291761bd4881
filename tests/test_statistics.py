"""Intervals and paired tests against published figures and hand counts."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import binomtest, t

from antennate.antenna.rivals import student
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
    assert student(count) == t.ppf(0.975, count - 1)


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
    assert all(np.isnan(statistics.mean95(np.array([]))))


def test_a_bootstrap_interval_is_about_two_standard_errors_wide() -> None:
    values = np.random.default_rng(1).normal(5.0, 2.0, 400)
    mean, low, high = statistics.mean95(values)
    assert mean == pytest.approx(values.mean())
    assert high - low == pytest.approx(2 * 1.96 * values.std() / 20, rel=0.1)


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
