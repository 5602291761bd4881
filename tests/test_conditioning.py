"""Counts to bending level, and level to contact: sigmoid, running mean, thresholds."""

from __future__ import annotations

import math

import numpy as np
import pytest

from antennate.control.conditioning import (
    ContactState,
    RunningMean,
    bending_level,
    contact_of,
    level_and_fraction,
)
from antennate.params.control import ConditioningParams, RuleParams
from antennate.types import Contact

PLAIN = ConditioningParams(counts_low=0.0, counts_high=1.0, polarity=1)
PERIOD = 0.01


def mean_of(*samples: float, window: float = 0.03) -> list[float]:
    """What the running mean says after each sample, seen on the left side."""
    mean = RunningMean(ConditioningParams(averaging_time=window), 1, PERIOD)
    return [float(mean.step(np.full((1, 2), s))[0, 0]) for s in samples]


def test_the_level_is_one_half_at_the_midpoint() -> None:
    assert bending_level(PLAIN, np.array([0.305])) == pytest.approx([0.5], abs=1e-12)


def test_the_rise_from_a_tenth_to_nine_tenths_is_as_wide_as_the_logistic_says() -> None:
    half = 2 * math.log(9) / 18.3 / 2
    levels = bending_level(PLAIN, np.array([0.305 - half, 0.305 + half]))
    assert levels == pytest.approx([0.1, 0.9], abs=1e-9)
    assert 2 * half == pytest.approx(4.394 / 18.3, rel=1e-3)


def test_polarity_mirrors_the_level_about_one_half() -> None:
    falling = PLAIN.model_copy(update={"polarity": -1})
    x = np.linspace(-0.5, 1.5, 21)
    assert bending_level(PLAIN, x) + bending_level(falling, x) == pytest.approx(np.ones(21))


def test_a_straight_antenna_is_free_and_a_right_angle_is_contact_by_default() -> None:
    straight, bent = bending_level(ConditioningParams(), np.array([1872.0, 1399.0]))
    assert straight < 0.1
    assert bent > 0.9


def test_no_exponent_however_large_leaves_the_unit_interval_or_warns() -> None:
    params = PLAIN.model_copy(update={"slope": 1.0, "midpoint": 0.0})
    decades = np.logspace(-308, 308, 1233)
    z = np.concatenate([-decades[::-1], [0.0], decades])
    levels = bending_level(params, z)
    assert (levels >= 0).all()
    assert (levels <= 1).all()
    assert (np.diff(levels) >= 0).all()


def test_a_missing_reading_has_no_level() -> None:
    assert np.isnan(bending_level(ConditioningParams(), np.array([np.nan]))).all()


@pytest.mark.parametrize("polarity", [1, -1])
def test_deflection_is_zero_straight_and_one_fully_bent(polarity: int) -> None:
    params = ConditioningParams(counts_low=1000.0, counts_high=2000.0, polarity=polarity)
    ends = np.array([1000.0, 2000.0])
    straight, bent = ends if polarity > 0 else ends[::-1]
    _, fraction = level_and_fraction(params, np.array([straight, bent]))
    assert fraction.tolist() == [0.0, 1.0]


def test_the_mean_runs_over_what_there_is_and_then_over_the_window() -> None:
    said = mean_of(3000, 3060, 3090, 3120, 3000)
    assert said == pytest.approx([3000, 3030, 3050, 3090, 3070])


def test_a_window_shorter_than_a_sample_passes_the_sample() -> None:
    assert mean_of(300, 600, 900, window=0.001) == [300, 600, 900]


def test_a_missing_sample_taints_its_side_until_the_window_has_passed() -> None:
    said = mean_of(100, 100, math.nan, 100, 100, 100, 100)
    assert [math.isnan(m) for m in said] == [False, False, True, True, True, False, False]


def test_a_missing_sample_does_not_taint_the_other_side() -> None:
    mean = RunningMean(ConditioningParams(), 1, PERIOD)
    assert mean.step(np.array([[math.nan, 500.0]]))[0, 1] == 500.0


def test_a_row_that_is_reset_forgets_and_the_others_do_not() -> None:
    mean = RunningMean(ConditioningParams(averaging_time=0.03), 2, PERIOD)
    mean.step(np.full((2, 2), 10.0))
    mean.step(np.array([[math.nan] * 2, [20.0] * 2]))
    mean.reset(np.array([0]))
    assert mean.step(np.full((2, 2), 30.0)).tolist() == [[30.0, 30.0], [20.0, 20.0]]


PARAMS = RuleParams(threshold=0.5, hysteresis=0.1)


def states(*levels: float) -> list[Contact]:
    """Contact of the left side for levels that follow one another."""
    state = ContactState(PARAMS, 1)
    return [Contact(int(state.step(np.array([[b, 0.0]]))[0, 0])) for b in levels]


def test_contact_begins_at_the_threshold_and_ends_below_the_hysteresis() -> None:
    free, touch = Contact.FREE, Contact.CONTACT
    assert states(0.45, 0.5, 0.45, 0.401, 0.399, 0.45) == [free, touch, touch, touch, free, free]


def test_nan_is_unknown_and_is_not_remembered_as_contact() -> None:
    assert states(0.9, math.nan, 0.45) == [Contact.CONTACT, Contact.UNKNOWN, Contact.FREE]


def test_a_side_does_not_know_of_the_other() -> None:
    said = contact_of(PARAMS, np.array([[0.9, math.nan]]), np.zeros((1, 2), dtype=np.int64))
    assert said.tolist() == [[Contact.CONTACT, Contact.UNKNOWN]]


def test_reset_forgets_contact_of_its_rows_only() -> None:
    state = ContactState(PARAMS, 2)
    state.step(np.ones((2, 2)))
    state.reset(np.array([True, False]))
    after = state.step(np.full((2, 2), 0.45))
    assert after.tolist() == [[Contact.FREE] * 2, [Contact.CONTACT] * 2]
