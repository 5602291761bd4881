"""The inertial sensor of simulated heads, from attitudes and velocities at two samples.

A real one filters what it measures to half its sample rate. Here a sample is the mean since the one
before: of the angular velocity, the turn over the time; of the specific force, the change of the
velocity over the time, and gravity, in the mean attitude. So samples summed over time give the turn
of the head, and the bounce of legs between two samples does not fold back. A mean over a time T of
white noise whose density is N has the standard deviation N / sqrt(2 T).
"""

from __future__ import annotations

import numpy as np

from antennate.params.scene import GRAVITY
from antennate.robots.imu import AXES, ImuParams
from antennate.types import Bools, Floats, Ints

STATE = 10
"""Numbers that a sample is made of: quaternion, real part first, velocity in the axes of the world
[m/s], angular velocity in those of the head [rad/s]."""


class Imu:
    """Inertial sensors of B heads, each in the middle of its head.

    Args:
        params: The sensor.
        batch: Number of rows B.
    """

    def __init__(self, params: ImuParams, batch: int) -> None:
        self._steps, self._most = params.steps, params.most
        self._t: Floats = np.full(batch, np.nan)
        self._state: Floats = np.zeros((batch, STATE))
        self._mean: Floats = np.zeros((batch, 2 * AXES))

    def reset(self, rows: int | Ints | Bools) -> None:
        """Let some rows begin anew: their next sample is of that moment, as if at rest before."""
        self._t[rows] = np.nan

    def step(self, t: Floats, state: Floats, error: Floats, rows: Bools | None = None) -> Floats:
        """Sample all sensors.

        Args:
            t: Time of each row [s], shape (B,). Where it has not gone on, nothing new is measured.
            state: As `STATE` says, shape (B, 10); zeros where there is no head.
            error: Bias and noise, gyroscopes [rad/s] first, then [m/s²], shape (B, 6).
            rows: Rows that remember this sample, shape (B,); all if not given.

        Returns:
            Readings [counts], gyroscopes first, then accelerometers, shape (B, 6).
        """
        first = np.isnan(self._t)
        dt = np.where(first, 0.0, t - self._t)
        new = first | (dt > 0.0)
        mean = np.where(new[:, None], _mean(self._state, state, dt), self._mean)
        kept = new if rows is None else new & rows
        self._mean[kept], self._state[kept], self._t[kept] = mean[kept], state[kept], t[kept]
        return np.clip(np.rint((mean + error) / self._steps), -self._most, self._most)


def noise_of(params: ImuParams, rng: np.random.Generator, count: int, period: float) -> Floats:
    """Noise of samples with this period [s]: [rad/s], then [m/s²], shape (count, 6)."""
    return params.noises / np.sqrt(2.0 * period) * rng.standard_normal((count, 2 * AXES))


def bias_of(params: ImuParams, rng: np.random.Generator) -> Floats:
    """Zeros of the axes in one trial: [rad/s], then [m/s²], shape (6,)."""
    return params.biases * rng.standard_normal(2 * AXES)


def _mean(before: Floats, now: Floats, dt: Floats) -> Floats:
    """Mean angular velocity and specific force between two states, shape (B, 6).

    Without time between them, those of the later one, unaccelerated.
    """
    still = dt <= 0.0
    before = np.where(still[:, None], now, before)
    dt = np.where(still, 1.0, dt)[:, None]
    p, q = before[:, :4], now[:, :4]
    turn = _product(p * [1.0, -1.0, -1.0, -1.0], q)
    sign = np.where(turn[:, :1] < 0.0, -1.0, 1.0)
    sine = np.linalg.norm(turn[:, 1:], axis=1, keepdims=True)
    angle = 2.0 * np.arctan2(sine, abs(turn[:, :1]))
    share = np.where(sine > 1e-12, angle / np.maximum(sine, 1e-12), 2.0)
    rate = np.where(still[:, None], now[:, 7:], sign * share * turn[:, 1:] / dt)
    force = (now[:, 4:7] - before[:, 4:7]) / dt + [0.0, 0.0, GRAVITY]
    return np.concatenate([rate, _turned_back(p + sign * q, force)], axis=1)


def _product(p: Floats, q: Floats) -> Floats:
    """Quaternions p q, shape (B, 4)."""
    a, u, b, v = p[:, :1], p[:, 1:], q[:, :1], q[:, 1:]
    real = a * b - (u * v).sum(axis=1, keepdims=True)
    return np.concatenate([real, a * v + b * u + np.cross(u, v)], axis=1)


def _turned_back(q: Floats, vector: Floats) -> Floats:
    """Vectors of the world in the axes of bodies with attitudes q, of any length, shape (B, 3)."""
    length = np.maximum(np.linalg.norm(q, axis=1, keepdims=True), 1e-12)
    w, u = q[:, :1] / length, -q[:, 1:] / length
    across = 2.0 * np.cross(u, vector)
    return vector + w * across + np.cross(u, across)
