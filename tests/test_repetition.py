"""Stuck: pressed, and feeling the same cycle again and again."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from antennate.control.conditioning import RepetitionDetector
from antennate.params.control import RepetitionParams

PERIOD, FREQUENCY = 0.01, 0.5
CYCLE = 200
PARAMS = RepetitionParams(change=0.08, pressure=0.2, window_cycles=0.5)

Signal = Callable[[float], tuple[float, float]]


def periodic(cycle: float) -> tuple[float, float]:
    return 0.5 + 0.3 * math.sin(2 * math.pi * cycle), 0.1


def alternating(cycle: float) -> tuple[float, float]:
    """Half as fast as the gait: every cycle is the opposite of the one before."""
    return 0.5 + 0.3 * math.sin(math.pi * cycle), 0.1


def free(cycle: float) -> tuple[float, float]:
    return 0.1 * math.sin(2 * math.pi * cycle), 0.05


def detector(batch: int = 1) -> RepetitionDetector:
    found = RepetitionDetector(PARAMS, batch, PERIOD, FREQUENCY)
    found.reset(np.arange(batch))
    return found


def stuck(
    signal: Signal, cycles: float, walking: Callable[[float], bool] = lambda _: True
) -> list[bool]:
    """Whether one row is stuck at each tick."""
    found = detector()
    times = np.arange(round(cycles * CYCLE)) / CYCLE
    return [bool(found.step(np.array([signal(c)]), np.array([walking(c)]))[0]) for c in times]


def test_a_pressed_reading_that_repeats_is_stuck_after_a_cycle_and_a_window() -> None:
    said = stuck(periodic, 6)
    assert not any(said[: int(1.5 * CYCLE) - 1])
    assert all(said[int(1.5 * CYCLE) :])


def test_either_antenna_alone_is_enough_to_be_pressed() -> None:
    assert stuck(lambda c: periodic(c)[::-1], 6)[-1]


def test_a_pressed_reading_that_is_new_in_every_cycle_is_not_stuck() -> None:
    assert not any(stuck(alternating, 12))


def test_one_side_that_feels_something_new_is_enough_to_go_on() -> None:
    assert not any(stuck(lambda c: (periodic(c)[0], alternating(c)[0]), 12))


def test_antennae_that_swing_in_free_air_are_not_stuck() -> None:
    assert not any(stuck(free, 12))


def test_a_robot_that_does_not_walk_is_not_stuck() -> None:
    assert not any(stuck(periodic, 6, walking=lambda _: False))


def test_walking_anew_starts_the_comparison_anew() -> None:
    said = stuck(periodic, 10, walking=lambda c: not 5.0 <= c < 5.02)
    assert said[5 * CYCLE - 1]
    assert not any(said[5 * CYCLE : int(6.5 * CYCLE)])
    assert said[-1]


def test_a_missing_reading_does_not_last() -> None:
    found = detector()
    for i in range(6 * CYCLE):
        bend = np.full((1, 2), np.nan) if i == 10 else np.array([periodic(i / CYCLE)])
        said = found.step(bend, np.array([i != 10]))
    assert said[0]


def test_a_mean_change_at_the_bound_decides() -> None:
    # a reading that grows by a fixed step in every cycle changes by exactly that step
    def rising(step: float) -> Signal:
        return lambda c: (0.5 + step * math.floor(c), 0.1)

    assert stuck(rising(0.079), 6)[-1]
    assert not stuck(rising(0.081), 6)[-1]


def test_a_mean_reading_at_the_bound_decides() -> None:
    """Both signals repeat, and their mean over the window of half a cycle is `mean`."""

    def constant(mean: float) -> Signal:
        return lambda c: (0.0, mean)

    def square(mean: float) -> Signal:
        return lambda c: (2.0 * mean if 4.0 * c % 2.0 < 1.0 else 0.0, 0.0)

    for signal in (constant, square):
        assert stuck(signal(1.01 * PARAMS.pressure), 6)[-1]
        assert not any(stuck(signal(0.99 * PARAMS.pressure), 6))


def test_a_row_that_is_reset_answers_like_a_new_one() -> None:
    used, new = detector(), detector()
    for i in range(3 * CYCLE):
        used.step(np.full((1, 2), 3.0 + i), np.array([True]))
    used.reset(np.array([0]))
    for i in range(3 * CYCLE):
        sample = np.array([periodic(i / CYCLE)])
        assert (used.step(sample, np.array([True])) == new.step(sample, np.array([True]))).all()
