"""Contact, sensed against true, counted and measured: cases by hand and printed tables."""

import math

import numpy as np
import pytest
from scipy import stats

from antennate.experiments.touch.measures import Pool, roc
from antennate.experiments.touch.result import Pair
from antennate.experiments.touch.sensing import Comparison, match, merged, runs


def states(text: str) -> np.ndarray:
    """`..##.` as a state over time."""
    return np.array([c == "#" for c in text])


def test_runs_and_merging_by_hand():
    assert runs(states("##..#.")).tolist() == [[0, 2], [4, 5]]
    assert runs(states("")).tolist() == []
    np.testing.assert_array_equal(merged(states("#..#...#."), 3), states("####...#."))
    np.testing.assert_array_equal(merged(states("#..#."), 0), states("#..#."))


@pytest.mark.parametrize(
    ("truth", "alarm", "found", "carried", "false", "onset", "release"),
    [
        ("..####....", "....####..", [True], 0, 0, [2], [2]),
        ("..####....", "..........", [False], 0, 0, [], []),
        ("..........", "...##.....", [], 0, 1, [], []),
        ("..##......", "......##..", [False], 0, 1, [], []),  # beyond the grace
        ("..##......", ".....##...", [True], 0, 0, [3], [3]),  # within it
        ("..##..##..", "...######.", [True, True], 1, 0, [1], [1]),  # one alarm for two
        ("..######..", "...#.##...", [True], 0, 0, [1], [-1]),  # first begin, last end
        ("..########", "...#######", [True], 0, 0, [1], []),  # no end in sight
        ("....##....", ".#####....", [True], 1, 0, [], [0]),
    ],
)
def test_matches_by_hand(truth, alarm, found, carried, false, onset, release):
    m = match(states(truth), states(alarm), grace=2)
    assert m.found.tolist() == found
    assert (m.carried, m.false) == (carried, false)
    assert (m.onset.tolist(), m.release.tolist()) == (onset, release)
    assert m.alarms == len(runs(states(alarm)))


def comparison(trial, truth, alarm, level, grace=2) -> Comparison:
    truth, alarm, level = states(truth), states(alarm), np.array(level, float)
    return Comparison(
        "flat", 0.1, "stiff", trial, 2.0, truth, alarm, level, level, match(truth, alarm, grace)
    )


def reached(level: float) -> float:
    """Flex of a sensor whose level is half of it [rad]."""
    return 2.0 * level


def test_measures_by_hand():
    first = comparison(0, ".###..#.", "..##...#", [0, 1, 5, 6, 0, 0, 2, 1], grace=0)
    second = comparison(1, "....", "..#.", [0, 0, 3, 0])
    found = Pool([first, second], trials=2, rate=100.0).measure([first, second])
    # ticks: 2 hits, 2 wrong, 2 lost; the second alarm comes too late for the second contact
    assert found.f1 == pytest.approx(4 / 8)
    assert found.precision == found.recall == pytest.approx(0.5)
    assert (found.contacts, found.missed, found.alarms, found.false) == (2, 1, 3, 2)
    assert found.missed_per_m == pytest.approx(1 / 4)
    assert found.false_per_m == pytest.approx(2 / 4)
    assert found.onset.median_ms == pytest.approx(10.0)
    assert found.onset.median_mm == pytest.approx(1.0)
    assert found.release.median_ms == pytest.approx(0.0)
    assert found.missed_flex_rad == pytest.approx(2.0)
    touching, free = [1, 5, 6, 2], [0, 0, 0, 1, 0, 0, 3, 0]
    pairs = [(a > b) + (a == b) / 2 for a in touching for b in free]
    assert found.auc == pytest.approx(np.mean(pairs))


def test_the_area_agrees_with_mann_and_whitney_and_chance_is_a_half():
    rng = np.random.default_rng(5)
    group = []
    for trial in range(5):
        truth = rng.random(2000) < 0.3
        level = truth * 1.0 + rng.standard_normal(2000)
        none = match(truth, ~truth, 0)
        group.append(
            Comparison("flat", 0.1, "stiff", trial, 1.0, truth, ~truth, level, level, none)
        )
    found = Pool(group, 5, 100.0).measure(group)
    truth, level = (np.concatenate([getattr(v, k) for v in group]) for k in ("truth", "level"))
    exact = stats.mannwhitneyu(level[truth], level[~truth]).statistic
    exact /= truth.sum() * (~truth).sum()
    assert found.auc == pytest.approx(exact, abs=0.002)
    # two normal scores one standard deviation apart
    assert found.auc == pytest.approx(stats.norm.cdf(1 / math.sqrt(2)), abs=0.02)
    assert found.auc_95[0] < exact < found.auc_95[1]
    assert roc(group, 0.5, reached).auc_random == pytest.approx(0.5, abs=0.02)
    assert found.f1 == 0.0


def test_a_perfect_alarm_is_perfect_and_the_curve_goes_from_corner_to_corner():
    one = comparison(0, "..####..", "..####..", [-9, -9, 9, 9, 9, 9, -9, -9])
    found = Pool([one], 1, 100.0).measure([one])
    assert (found.f1, found.precision, found.recall, found.auc) == (1.0, 1.0, 1.0, 1.0)
    assert found.f1_95 is None  # one trial says nothing about others
    curve = roc([one], 0.5, reached)
    assert curve.default.true_positive_rate == 1.0
    assert curve.default.false_positive_rate == 0.0
    assert curve.curve[0].false_positive_rate == 1.0
    assert curve.curve[-1].true_positive_rate == 0.0
    assert curve.f1_always_contact == pytest.approx(2 / 3)
    assert (curve.default.theta, curve.default.flex_rad) == (0.5, 1.0)
    assert curve.best_f1 in curve.curve
    assert curve.best_f1.flex_rad == 2 * curve.best_f1.theta


def test_intervals_over_trials_of_equal_length_are_those_of_student_for_the_mean():
    def recall(hits):
        group = [
            comparison(trial, "#" * 10 + "..", "#" * hit + "." * (12 - hit), range(12))
            for trial, hit in enumerate(hits)
        ]
        return Pool(group, len(group), 100.0).measure(group)

    found = recall([4, 5, 6, 7, 8])
    half = 2.776 * math.sqrt(0.025 / 5)  # printed quantile, four degrees of freedom
    assert found.recall_95 == pytest.approx((0.6 - half, 0.6 + half), abs=1e-4)
    assert found.precision_95 is None  # without error in every trial
    assert recall([4, 5, 7, 8]).recall_95 is None  # so few decide nothing
    assert recall([8, 9, 10, 10, 10]).recall_95[1] == 1.0
    alike = recall([5] * 5)
    assert (alike.recall, alike.recall_95, alike.f1_95) == (0.5, None, None)
    assert alike.precision == 1.0


def test_most_intervals_over_five_trials_hold_the_truth():
    rng = np.random.default_rng(8)

    def trial(number):
        truth = np.arange(rng.integers(60, 140)) >= 20
        alarm = truth & (rng.random(len(truth)) < rng.normal(0.55, 0.08))
        level = alarm.astype(float)
        none = match(truth, ~truth, 0)
        return Comparison("flat", 0.1, "stiff", number, 1.0, truth, alarm, level, level, none)

    held = []
    for _ in range(400):
        group = [trial(number) for number in range(5)]
        low, high = Pool(group, 5, 100.0).measure(group).recall_95
        held.append(low < 0.55 < high)
    assert np.mean(held) == pytest.approx(0.95, abs=4 * math.sqrt(0.05 * 0.95 / 400))


@pytest.mark.parametrize(
    ("false", "low", "high"),
    [(0, 0.0, 3.69), (1, 0.0253, 5.57), (4, 1.09, 10.24), (5, 1.62, 11.67)],
)
def test_counts_per_metre_have_the_printed_limits_of_poisson(false, low, high):
    """Pearson and Hartley, Biometrika Tables for Statisticians, table 40, 95 %."""
    silent = comparison(0, "....", "....", [0] * 4)
    noisy = comparison(1, "." * 12, ("#." * false).ljust(12, "."), [0] * 12)
    found = Pool([silent, noisy], 2, 100.0).measure([silent, noisy])  # of 2 m each
    assert found.false == false
    assert found.false_per_m == false / 4
    assert found.false_per_m_95 == pytest.approx((low / 4, high / 4), rel=5e-3)


def test_a_difference_of_two_profiles_is_paired_by_trial():
    def group(*hits):
        return [
            comparison(trial, "#" * 10, "#" * hit + "." * (10 - hit), range(10))
            for trial, hit in enumerate(hits)
        ]

    first, second = group(4, 6, 9, 5, 7), group(3, 5, 8, 4, 6)
    pool = Pool([*first, *second], 5, 100.0)
    paired, (low, high) = pool.f1_difference(first, second), pool.measure(first).f1_95
    value, ends = paired.f1_difference, paired.f1_difference_95
    # F1 = 2 hits / (hits + 10)
    assert value == pytest.approx(62 / 81 - 52 / 76)
    assert ends[0] < value < ends[1]
    assert ends[1] - ends[0] < (high - low) / 4
    assert pool.f1_difference(first, first) == Pair(f1_difference=0.0, f1_difference_95=None)


def test_nothing_valid_gives_numbers_that_do_not_exist():
    found = Pool([], 3, 100.0).measure([])
    assert found.f1 is found.auc is found.missed_per_m is found.f1_95 is None
    assert found.onset.n == 0
    assert roc([], 0.5, reached).default.f1 is None
