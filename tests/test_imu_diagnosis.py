"""What the readings of an inertial sensor are worth, from invented readings."""

from __future__ import annotations

import numpy as np
import pytest

from antennate.hardware.safety.imu import ImuDiagnosis, ImuFinding
from antennate.robots.spec import RobotSpec
from antennate.types import Floats

ROBOT = RobotSpec.named("scuttle3d")
RNG = np.random.default_rng(6)


def noisy(count: int) -> Floats:
    """Readings of a sensor at rest, with noise of some counts, shape (count, 6)."""
    return RNG.integers(-50, 50, (count, 6)).astype(float)


def judged(readings: Floats, rate: float = 100.0) -> tuple[ImuDiagnosis, Floats]:
    """A sensor that has read these [1/s], and what it handed on, shape (n, 6)."""
    sensor, handed = ImuDiagnosis(ROBOT.imu), list[Floats]()
    for tick, counts in enumerate(readings):
        sensor.step(tick / rate, counts)
        handed.append(np.concatenate([sensor.angular_velocity, sensor.linear_acceleration]).ravel())
    return sensor, np.array(handed)


def withheld(readings: Floats, rate: float = 100.0) -> list[bool]:
    """Which of these readings were not handed on; never in part."""
    unknown = np.isnan(judged(readings, rate)[1])
    assert (unknown.all(axis=1) == unknown.any(axis=1)).all()
    return [bool(row.all()) for row in unknown]


def test_sound_readings_are_what_their_counts_mean() -> None:
    """LSM6DSOX: 35 mdeg/s and 0.244 mg a count."""
    counts = np.array([[1000.0, -1000.0, 0.0, 0.0, 4098.0, -4098.0]])
    assert withheld(counts) == [False]
    sensor, _ = judged(counts)
    np.testing.assert_allclose(sensor.angular_velocity, np.radians([[35.0, -35.0, 0.0]]))
    g = 0.244e-3 * 4098 * 9.81
    np.testing.assert_allclose(sensor.linear_acceleration, [[0.0, g, -g]])


@pytest.mark.parametrize("rate", [50, 100, 200])
def test_one_that_repeats_itself_is_withheld_after_100_ms(rate: int) -> None:
    first, last, after = rate, 2 * rate, rate + rate // 10
    readings = noisy(3 * rate)
    readings[first:last] = readings[first]
    expected = [after <= tick < last for tick in range(3 * rate)]
    assert withheld(readings, rate) == expected
    assert judged(readings, rate)[0].counted[ImuFinding.STUCK] == last - after


def test_few_equal_readings_are_no_fault_however_seldom_they_come() -> None:
    readings = noisy(20)
    readings[5:8] = readings[5]
    assert not any(withheld(readings, 10.0))
    readings[5:9] = readings[5]
    assert withheld(readings, 10.0) == [tick == 8 for tick in range(20)]


@pytest.mark.parametrize("rate", [50, 100, 200])
@pytest.mark.parametrize("end", [1.0, -1.0])
def test_an_axis_at_its_end_is_withheld_at_once_and_the_others_after_100_ms(
    rate: int, end: float
) -> None:
    first, last, after = rate, 2 * rate, rate + rate // 10
    readings = noisy(3 * rate)
    readings[first:last, 4] = end * ROBOT.imu.most[4]
    sensor, handed = judged(readings, rate)
    expected = np.zeros((3 * rate, 6), bool)
    expected[first:last, 4] = True
    expected[after:last] = True
    np.testing.assert_array_equal(np.isnan(handed), expected)
    assert sensor.counted[ImuFinding.RAILED] == last - after
    assert judged(readings[:after], rate)[0].fault == ""
    assert judged(readings[: after + 1], rate)[0].fault == "readings at the end of the range"


@pytest.mark.parametrize("rate", [50, 100, 200])
def test_what_is_missing_is_withheld_at_once_and_named_after_100_ms(rate: int) -> None:
    first, after = rate, rate + rate // 10
    readings = noisy(2 * rate)
    readings[first:] = np.nan
    assert withheld(readings, rate) == [False] * first + [True] * rate
    assert judged(readings[:after], rate)[0].fault == ""
    assert judged(readings[: after + 1], rate)[0].fault == "no answer"


def test_readings_of_a_silent_board_are_its_own_fault_alone() -> None:
    sensor = ImuDiagnosis(ROBOT.imu)
    sensor.step(0.0, np.zeros(6))
    for tick in range(1, 50):
        sensor.step(0.01 * tick, None)
    assert np.isnan(sensor.angular_velocity).all()
    assert sensor.fault == ""
    assert sensor.counted[ImuFinding.MISSING] == 0


def test_a_knock_beyond_the_range_is_no_fault_and_single_misses_are_not_named() -> None:
    sensor, rng = ImuDiagnosis(ROBOT.imu), np.random.default_rng(5)
    for tick in range(60):
        counts = rng.integers(-50, 50, 6).astype(float)
        if tick % 20 < 9:
            counts[3] = ROBOT.imu.most[3]
        if tick % 20 == 15:
            counts[:] = np.nan
        sensor.step(0.01 * tick, counts)
        assert np.isnan(sensor.angular_velocity).all() == (tick % 20 == 15)
        unknown = np.isnan(sensor.linear_acceleration[0]).tolist()
        assert unknown == [tick % 20 < 9 or tick % 20 == 15, tick % 20 == 15, tick % 20 == 15]
        assert sensor.fault == ""
    assert sensor.counted == {
        ImuFinding.OK: 57,
        ImuFinding.MISSING: 3,
        ImuFinding.STUCK: 0,
        ImuFinding.RAILED: 0,
    }
    sensor.step(0.59, np.zeros(6))  # a sample that was there before
    assert sum(sensor.counted.values()) == 60
