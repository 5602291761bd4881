"""An inertial sensor on the antenna board: three gyroscopes and three accelerometers.

Its axes are those of the head: x forward, y to the left, z up (REP 103). An accelerometer measures
specific force: at rest it shows the acceleration of gravity upwards. Defaults are those of ST's
LSM6DSOX at 1000 deg/s and 8 g: typical values of its datasheet DS12814, and what a count is by ST's
own driver, lsm6dsox_reg.c.
"""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
from pydantic import model_validator

from antennate.params.base import Params, number
from antennate.params.scene import GRAVITY
from antennate.types import Floats

AXES = 3
MOST_COUNTS = 32767
"""Largest reading of an axis [counts]: 16 bits with a sign."""
_DEGREE = math.pi / 180.0
_ROUNDED = 1.01
"""Datasheets round the step of a count: 0.244 mg at 8 g is 7.995 g in all."""


class ImuParams(Params):
    """The inertial sensor of the head; readings of 16 bits."""

    kind: Literal["none", "head"] = number("none", "1", "paper: the robot has antennae alone")
    """Whether the antenna board in the head carries one."""
    gyro_range: float = number(
        1000.0 * _DEGREE, "rad/s", "datasheet: LSM6DSOX, 1000 deg/s of 125 to 2000", gt=0, le=100
    )
    """Largest angular velocity about an axis that it measures."""
    gyro_step: float = number(
        0.035 * _DEGREE,
        "rad/s",
        "datasheet: LSM6DSOX, 35 mdeg/s at 1000 deg/s, as in ST's driver",
        gt=0,
        le=0.1,
    )
    """Angular velocity of one count."""
    gyro_noise: float = number(
        0.0038 * _DEGREE, "rad/s/√Hz", "datasheet: LSM6DSOX, 3.8 mdeg/s/√Hz", ge=0, le=0.1
    )
    """Density of the noise of the angular velocity."""
    gyro_bias: float = number(
        1.0 * _DEGREE, "rad/s", "datasheet: LSM6DSOX, zero-rate level of 1 deg/s", ge=0, le=1
    )
    """Standard deviation of the zero of a gyroscope, drawn for each trial."""
    accel_range: float = number(
        8.0 * GRAVITY, "m/s²", "datasheet: LSM6DSOX, 8 g of 2 to 16", gt=GRAVITY, le=1000
    )
    """Largest specific force along an axis that it measures."""
    accel_step: float = number(
        0.244e-3 * GRAVITY,
        "m/s²",
        "datasheet: LSM6DSOX, 0.244 mg at 8 g, as in ST's driver",
        gt=0,
        le=1,
    )
    """Specific force of one count."""
    accel_noise: float = number(
        80e-6 * GRAVITY,
        "m/s²/√Hz",
        "assumed: 75 µg/√Hz at 4 g (datasheet LSM6DSOX), more at 8 g",
        ge=0,
        le=1,
    )
    """Density of the noise of the specific force."""
    accel_bias: float = number(
        0.020 * GRAVITY, "m/s²", "datasheet: LSM6DSOX, zero-g level of 20 mg", ge=0, le=GRAVITY
    )
    """Standard deviation of the zero of an accelerometer, drawn for each trial."""

    @model_validator(mode="after")
    def _sixteen_bits(self) -> ImuParams:
        for name in ("gyro", "accel"):
            largest, step = getattr(self, f"{name}_range"), getattr(self, f"{name}_step")
            if not step <= largest <= _ROUNDED * (MOST_COUNTS + 1) * step:
                raise ValueError(
                    f"{name}_range: expected 1 to {MOST_COUNTS + 1} times {name}_step, "
                    f"{step:.4g} to {(MOST_COUNTS + 1) * step:.4g}, found {largest:g}"
                )
        return self

    @property
    def steps(self) -> Floats:
        """What one count of each axis is, gyroscopes [rad/s] first, then [m/s²], shape (6,)."""
        return np.repeat([self.gyro_step, self.accel_step], AXES)

    @property
    def most(self) -> Floats:
        """Largest reading of each axis [counts], shape (6,)."""
        ranges = np.repeat([self.gyro_range, self.accel_range], AXES)
        return np.minimum(np.floor(ranges / self.steps + 1e-9), MOST_COUNTS)

    @property
    def noises(self) -> Floats:
        """Noise densities of the axes [rad/s/√Hz], then [m/s²/√Hz], shape (6,)."""
        return np.repeat([self.gyro_noise, self.accel_noise], AXES)

    @property
    def biases(self) -> Floats:
        """Standard deviations of the zeros of the axes [rad/s], then [m/s²], shape (6,)."""
        return np.repeat([self.gyro_bias, self.accel_bias], AXES)


def in_counts(params: ImuParams, angular_velocity: Floats, linear_acceleration: Floats) -> Floats:
    """Readings of these measurements: what `measured` takes [counts], NaN for NaN, shape (B, 6)."""
    values = np.concatenate([angular_velocity, linear_acceleration], axis=1)
    return np.rint(values / params.steps)


def measured(params: ImuParams, counts: Floats) -> tuple[Floats, Floats]:
    """What readings mean.

    Args:
        params: The sensor.
        counts: Gyroscopes first, then accelerometers [counts], NaN for none, shape (B, 6).

    Returns:
        Angular velocity [rad/s] and specific force [m/s²], both of shape (B, 3).
    """
    values = counts * params.steps
    return values[:, :AXES], values[:, AXES:]


def noise_of(params: ImuParams, rng: np.random.Generator, count: int, period: float) -> Floats:
    """Noise of samples with this period [s]: [rad/s], then [m/s²], shape (count, 6).

    A mean over a time T of white noise whose density is N has the standard deviation N / sqrt(2 T).
    """
    return params.noises / np.sqrt(2.0 * period) * rng.standard_normal((count, 2 * AXES))


def bias_of(params: ImuParams, rng: np.random.Generator) -> Floats:
    """Zeros of the axes in one trial: [rad/s], then [m/s²], shape (6,)."""
    return params.biases * rng.standard_normal(2 * AXES)
