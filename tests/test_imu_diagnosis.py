"""What the readings of an inertial sensor are worth, from invented readings."""

from __future__ import annotations

import numpy as np

from antennate.hardware.safety.imu import ImuDiagnosis, ImuFinding
from antennate.robots.spec import RobotSpec
from antennate.types import Floats

ROBOT = RobotSpec.named("scuttle3d")
RNG = np.random.default_rng(6)


def noisy(count: int) -> Floats:
    """Readings of a sensor at rest, with noise of some counts, shape (count, 6)."""
    return RNG.integers(-50, 50, (count, 6)).astype(float)


def judged(readings: Floats) -> tuple[ImuDiagnosis, list[bool]]:
    """A sensor that has read these, 100 a second, and whether each was withheld."""
    sensor, withheld = ImuDiagnosis(ROBOT.imu), list[bool]()
    for tick, counts in enumerate(readings):
        sensor.step(0.01 * tick, counts)
        motion = np.concatenate([sensor.angular_velocity, sensor.linear_acceleration])
        assert np.isnan(motion).all() or np.isfinite(motion).all()
        withheld.append(bool(np.isnan(motion).any()))
    return sensor, withheld


def test_sound_readings_are_what_their_counts_mean() -> None:
    """LSM6DSOX: 35 mdeg/s and 0.244 mg a count."""
    counts = np.array([[1000.0, -1000.0, 0.0, 0.0, 4098.0, -4098.0]])
    sensor, withheld = judged(counts)
    assert withheld == [False]
    np.testing.assert_allclose(sensor.angular_velocity, np.radians([[35.0, -35.0, 0.0]]))
    g = 0.244e-3 * 4098 * 9.81
    np.testing.assert_allclose(sensor.linear_acceleration, [[0.0, g, -g]])


def test_one_that_repeats_itself_is_withheld_after_100_ms() -> None:
    readings = noisy(40)
    readings[10:30] = readings[10]
    sensor, withheld = judged(readings)
    assert withheld == [False] * 19 + [True] * 11 + [False] * 10
    assert sensor.counted[ImuFinding.STUCK] == 11


def test_an_axis_at_its_end_is_withheld_after_100_ms() -> None:
    readings = noisy(40)
    readings[10:30, 4] = -ROBOT.imu.most[4]
    sensor, withheld = judged(readings)
    assert withheld == [False] * 19 + [True] * 11 + [False] * 10
    assert sensor.counted[ImuFinding.RAILED] == 11


def test_what_is_missing_is_withheld_at_once_and_named_after_100_ms() -> None:
    readings = noisy(40)
    readings[20:] = np.nan
    assert judged(readings)[1] == [False] * 20 + [True] * 20
    assert judged(readings[:29])[0].fault == ""
    assert judged(readings[:30])[0].fault == "no answer"


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
        assert sensor.fault == ""
    assert sensor.counted == {
        ImuFinding.OK: 57,
        ImuFinding.MISSING: 3,
        ImuFinding.STUCK: 0,
        ImuFinding.RAILED: 0,
    }
    sensor.step(0.59, np.zeros(6))  # a sample that was there before
    assert sum(sensor.counted.values()) == 60
