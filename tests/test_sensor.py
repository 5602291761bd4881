"""Flex to counts: facts section 2 gives the counts, the formula the resistances."""

from __future__ import annotations

import math

import numpy as np
import pytest

from antennate import sensor
from antennate.params import SensorParams

FLAT, GAIN = 10e3, 1.2 / math.pi


@pytest.mark.parametrize(
    ("resistance", "expected"), [(10e3, 1872), (15e3, 1462), (22e3, 1104), (40e3, 643)]
)
def test_film_resistances_give_the_counts_of_the_divider(resistance: float, expected: int) -> None:
    flex = (resistance / FLAT - 1) / GAIN
    assert sensor.counts(SensorParams(), np.array([flex])) == pytest.approx([expected], abs=1)


def test_counts_fall_strictly_over_bends_a_degree_apart() -> None:
    flex = np.radians(np.arange(0.0, 181.0))
    assert (np.diff(sensor.counts(SensorParams(), flex)) < 0).all()


def test_counts_stay_within_twelve_bits() -> None:
    noise = np.array([-1e6, 1e6])
    assert sensor.counts(SensorParams(), np.zeros(2), noise).tolist() == [0.0, 4095.0]


def test_an_endless_bend_reads_zero() -> None:
    assert sensor.counts(SensorParams(), np.array([1e9])).tolist() == [0.0]


def test_counts_are_whole_numbers() -> None:
    read = sensor.counts(SensorParams(), np.linspace(-2, 2, 50), 0.3)
    assert (read == np.round(read)).all()


def test_a_film_of_one_direction_ignores_bends_towards_the_head() -> None:
    params = SensorParams(directions="one")
    straight, tail, head = sensor.counts(params, np.array([0.0, 1.0, -1.0]))
    assert head == straight
    assert tail < straight


def test_a_film_of_both_directions_sees_both_alike() -> None:
    tail, head = sensor.counts(SensorParams(directions="both"), np.array([1.0, -1.0]))
    assert head == tail
