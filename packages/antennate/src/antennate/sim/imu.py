"""The inertial sensor of simulated heads, from attitudes and velocities at two samples.

A real one filters what it measures to half its sample rate. Here a sample is the mean since the one
before: of the angular velocity, the turn over the time; of the specific force, the change of the
velocity over the time, and gravity, in the mean attitude. So samples summed over time give the turn
of the head, and the bounce of legs between two samples does not fold back.
"""

from __future__ import annotations

import math

import numpy as np

from antennate.params.scene import GRAVITY
from antennate.robots.imu import AXES, ImuParams
from antennate.types import Bools, Floats


class Imu:
    """Inertial sensors of B heads, each in the middle of its head.

    Rows are worked out one by one: for few of them that is ten times faster than by arrays.

    Args:
        params: The sensor.
        batch: Number of rows B.
    """

    def __init__(self, params: ImuParams, batch: int) -> None:
        self._steps, self._most = params.steps, params.most
        self._last: list[tuple[float, list[float]] | None] = [None] * batch
        self._mean = [(0.0,) * 2 * AXES] * batch

    def reset(self, row: int) -> None:
        """Let a row begin anew: its next sample is of that moment, as if unaccelerated before."""
        self._last[row] = None

    def step(self, t: Floats, state: Floats, error: Floats, rows: Bools | None = None) -> Floats:
        """Sample all sensors.

        Args:
            t: Time of each row [s], shape (B,). Where it has not gone on, nothing new is measured.
            state: As `states.HEAD` says, shape (B, 10); zeros where there is no head.
            error: Bias and noise, gyroscopes [rad/s] first, then [m/s²], shape (B, 6).
            rows: Rows that remember this sample, shape (B,); all if not given.

        Returns:
            Readings [counts], gyroscopes first, then accelerometers, shape (B, 6).
        """
        means = self._mean if rows is None else self._mean.copy()
        for i, now in enumerate(zip(t.tolist(), state.tolist(), strict=True)):
            before = self._last[i]
            if before is None or now[0] > before[0]:
                means[i] = _mean(before or now, now)
                if rows is None or rows[i]:
                    self._mean[i], self._last[i] = means[i], now
        return np.clip(np.rint((means + error) / self._steps), -self._most, self._most)


def _mean(before: tuple[float, list[float]], now: tuple[float, list[float]]) -> tuple[float, ...]:
    """Mean angular velocity and specific force between two times and states.

    Without time between them, those of the later one, unaccelerated.
    """
    w0, x0, y0, z0, vx0, vy0, vz0, *_ = before[1]
    w, x, y, z, vx, vy, vz, *rate = now[1]
    dt = now[0] - before[0]
    if dt > 0.0:  # the turn from one attitude to the other, as its axis times its angle
        real = w0 * w + x0 * x + y0 * y + z0 * z
        turn = (
            w0 * x - w * x0 - y0 * z + z0 * y,
            w0 * y - w * y0 - z0 * x + x0 * z,
            w0 * z - w * z0 - x0 * y + y0 * x,
        )
        sine = math.hypot(*turn)
        share = 2.0 * math.atan2(sine, abs(real)) / sine if sine > 1e-12 else 2.0
        share = math.copysign(share, real) / dt
        rate = [share * part for part in turn]
        if real < 0.0:  # the same attitude, on the same side
            w0, x0, y0, z0 = -w0, -x0, -y0, -z0
        fx, fy, fz = (vx - vx0) / dt, (vy - vy0) / dt, (vz - vz0) / dt + GRAVITY
    else:
        fx, fy, fz = 0.0, 0.0, GRAVITY
    w, x, y, z = w + w0, x + x0, y + y0, z + z0
    two = 2.0 / ((w * w + x * x + y * y + z * z) or 1.0)
    return (
        *rate,
        fx - two * ((y * y + z * z) * fx - (x * y + w * z) * fy - (x * z - w * y) * fz),
        fy - two * ((x * x + z * z) * fy - (x * y - w * z) * fx - (y * z + w * x) * fz),
        fz - two * ((x * x + y * y) * fz - (x * z + w * y) * fx - (y * z - w * x) * fy),
    )
