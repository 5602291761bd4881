"""Monotone curves and the variance they explain, against known truth."""

import numpy as np
import pytest

from antennate.experiments.force.explained import Curve, by_group, explained
from antennate.jackknife import jackknife95, median95
from antennate.studies.statistics import mean95


def test_curve_through_rising_points_is_the_points():
    x = np.array([3.0, 1.0, 2.0])
    curve = Curve.through(x, x**2)
    np.testing.assert_allclose(curve(np.array([1.0, 1.5, 2.0, 3.0])), [1.0, 2.5, 4.0, 9.0])
    np.testing.assert_allclose(curve(np.array([-5.0, 50.0])), [1.0, 9.0])


def test_curve_through_falling_points_is_their_mean():
    curve = Curve.through(np.array([1.0, 2.0, 3.0]), np.array([5.0, 4.0, 0.0]))
    np.testing.assert_allclose(curve(np.array([1.0, 2.7])), [3.0, 3.0])


def test_points_of_equal_x_weigh_by_their_number():
    """Pool the two blocks by hand: (1 + 1 + 1 + 0) / 4."""
    curve = Curve.through(np.array([1.0, 1.0, 1.0, 2.0]), np.array([1.0, 1.0, 1.0, 0.0]))
    np.testing.assert_allclose(curve(np.array([1.0, 2.0])), 0.75)


def test_truth_explains_all_and_the_mean_nothing():
    truth = np.array([1.0, 2.0, 4.0, 9.0])
    groups = np.arange(4)
    assert explained(truth, truth, groups).r2 == pytest.approx(1.0)
    mean = explained(truth, np.full(4, 4.0), groups)
    assert mean.r2 == pytest.approx(0.0)
    assert mean.rmse == pytest.approx(np.std(truth))
    assert explained(truth, np.full(4, 9.0), groups).r2 < 0


def test_noise_of_known_size_leaves_its_share_and_the_interval_holds_it():
    """y = x + e with variances 1 and 1/4: a prediction by x explains 4/5."""
    rng = np.random.default_rng(3)
    held = 0
    for _ in range(40):
        x = rng.normal(size=400)
        found = explained(x + 0.5 * rng.normal(size=400), x, np.arange(400))
        low, high = found.r2_95
        held += low <= 0.8 <= high
    assert held >= 33  # P(X < 33) is under 1 % at 95 % coverage
    assert found.n == 400


@pytest.mark.parametrize("groups", [5, 6, 12])
def test_few_groups_hold_the_truth_as_often_as_they_say(groups: int) -> None:
    """y = x + e, where e is one number for all 30 points of a group: variances 1/12 and 1/25.

    Of 200 sets 190 are expected; fewer than 180 have a chance below 0.1 % at 95 % coverage. A
    percentile bootstrap over groups holds 168 with 6.
    """
    rng, held = np.random.default_rng(7), 0
    truth_r2 = 1.0 - (1 / 25) / (1 / 12 + 1 / 25)
    for _ in range(200):
        guess = rng.uniform(size=(groups, 30))
        truth = guess + 0.2 * rng.normal(size=(groups, 1))
        found = explained(truth.ravel(), guess.ravel(), np.repeat(np.arange(groups), 30))
        low, high = found.r2_95
        held += low <= truth_r2 <= high
        assert found.groups == groups
        assert high < 1.0
    assert held >= 180


def test_points_of_one_trial_are_not_counted_as_many():
    rng = np.random.default_rng(5)
    x, e = rng.normal(size=(2, 20))
    truth, guess = np.repeat(x + e, 50), np.repeat(x, 50)
    trials = np.repeat(np.arange(20), 50)
    widths = [
        np.subtract(*explained(truth, guess, groups).r2_95[::-1])
        for groups in (trials, np.arange(1000))
    ]
    assert widths[0] > 4 * widths[1]  # sqrt(50) with many trials


def test_groups_have_their_own_curves_and_unknown_groups_none():
    x, y, group = np.array([0.0, 1.0, 0.0, 1.0]), np.array([0.0, 1.0, 5.0, 3.0]), [0, 0, 1, 1]
    at = np.array([0.5, 0.5, 0.5])
    guess = by_group((x, y, np.array(group)), at, np.array([0, 1, 2]))
    np.testing.assert_allclose(guess, [0.5, 4.0, np.nan])
    falling = by_group((x, y, np.array(group)), at, np.array([0, 1, 2]), falling=True)
    np.testing.assert_allclose(falling, [0.5, 4.0, np.nan])


def test_nothing_to_predict_explains_nothing():
    found = explained(np.zeros(0), np.zeros(0), np.zeros(0, np.int64))
    assert found.n == 0
    assert np.isnan(found.r2)


def test_the_jackknife_of_a_mean_is_students_interval() -> None:
    values = np.random.default_rng(1).normal(size=(7, 2))
    left = (values.sum(axis=0) - values) / 6
    ends = jackknife95(values.mean(axis=0), left)
    for column, (low, high) in zip(values.T, ends.T, strict=True):
        assert (low, high) == pytest.approx(mean95(column)[1])
    assert np.isnan(jackknife95(3.0, np.full(7, 3.0))).all()


@pytest.mark.parametrize("groups", [[0, 0, 0], [0, 1, 2]])
def test_few_groups_have_no_interval(groups: list[int]) -> None:
    found = explained(np.array([1.0, 2.0, 4.0]), np.array([1.0, 2.0, 3.0]), np.array(groups))
    assert found.r2 == pytest.approx(1.0 - 1.0 / (14.0 / 3.0))
    assert np.isnan(found.r2_95).all()


@pytest.mark.parametrize(("groups", "each"), [(10, 1), (40, 1), (40, 3)])
@pytest.mark.parametrize("tick", [0.0, 0.1])
def test_the_interval_of_a_median_holds_it_as_often_as_it_says(
    groups: int, each: int, tick: float
) -> None:
    """Exponential values, as they are or to a tenth of their mean: their median is log(2), or 0.7.

    Of 200 sets 190 are expected; fewer than 180 have a chance below 0.1 % at 95 % coverage. The
    jackknife of the median holds it in 95 to 170 and gives no interval for many sets with ticks.
    """
    rng, held = np.random.default_rng(11), 0
    number = np.repeat(np.arange(groups), each)
    for _ in range(200):
        values = rng.exponential(size=groups * each)
        low, high = median95(np.round(values / tick) * tick if tick else values, number)
        held += low - 1e-9 <= (0.7 if tick else np.log(2.0)) <= high + 1e-9
    assert held >= 180


def test_the_interval_of_a_median_over_five_groups_is_the_jackknife() -> None:
    values, number = np.array([1.0, 2.0, 4.0, 8.0, 16.0]), np.arange(5)
    left = np.array([6.0, 6.0, 5.0, 3.0, 3.0])  # medians of four, by hand
    assert median95(values, number) == pytest.approx(jackknife95(4.0, left))


@pytest.mark.parametrize("groups", [1, 5, 20])
def test_values_that_are_all_alike_tell_no_interval_of_the_median(groups: int) -> None:
    assert np.isnan(median95(np.full(groups, 3.0), np.arange(groups))).all()
