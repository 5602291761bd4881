"""Where a body points, as an inertial sensor in its head and its joints tell it."""

from __future__ import annotations

import math

import numpy as np

from antennate.params.climb import HeadingParams
from antennate.types import AntennaFrame, Bools, Floats, Ints

_UP = np.array([0.0, 0.0, 1.0])
_AHEAD = np.array([1.0, 0.0, 0.0])
_LEAST = 1.0
"""Specific force under which a sensor tells no direction [m/s²]: it falls."""
_SHORT = 1e-6
"""Length under which a vector has no direction."""


class Heading:
    """How far B bodies have turned.

    Two directions of the world are carried along in the axes of the head by its angular velocity:
    the vertical, which is drawn to the specific force, and one across it, which nothing corrects. A
    gyroscope is wrong by a constant: what it tells of a robot that is at rest. Where rates or
    joints are missing for longer than a moment, nothing is known, and a mark is gone.

    Args:
        params: Its numbers.
        batch: Number of robots B.
        period: Control period [s].

    Attributes:
        turned: How far the body has turned since `mark` [rad], positive to the left, shape (B,); 0
            without a mark, and where nothing is known.
    """

    def __init__(self, params: HeadingParams, batch: int, period: float) -> None:
        self._params, self._period = params, period
        self._up: Floats = np.tile(_UP, (batch, 1))
        self._across: Floats = np.tile(_AHEAD, (batch, 1))
        self._bias: Floats = np.zeros((batch, 3))
        self._rested, self._averaged, self._lost = np.zeros((3, batch))
        self._now: Floats = np.zeros(batch)
        self._from: Floats = np.full(batch, np.nan)

    def reset(self, rows: Ints | Bools) -> None:
        """Start rows anew, upright, without a mark."""
        self._up[rows], self._across[rows] = _UP, _AHEAD
        self._bias[rows] = 0.0
        for memory in (self._rested, self._averaged, self._lost, self._now):
            memory[rows] = 0.0
        self._from[rows] = np.nan

    @property
    def turned(self) -> Floats:
        """See above."""
        away = np.nan_to_num(self._now - self._from)
        turned: Floats = (away + math.pi) % (2.0 * math.pi) - math.pi
        return turned

    def mark(self, rows: Bools) -> None:
        """Measure from here on in those of these rows, shape (B,), that are known and unmarked."""
        rows = rows & np.isnan(self._from) & (self._lost == 0.0)
        self._from[rows] = self._now[rows]

    def forget(self, rows: Bools) -> None:
        """Measure nothing in these rows, shape (B,)."""
        self._from[rows] = np.nan

    def step(self, frame: AntennaFrame, body: Floats, stands: Bools) -> None:
        """Take one reading.

        Args:
            frame: The reading, NaN where the sensor gave none.
            body: Direction of the body in the axes of the head, of any length, shape (B, 3); NaN
                where it is not known.
            stands: Rows whose joints have been told to stand, shape (B,).
        """
        if frame.angular_velocity.size == 0:
            return
        dt = self._period
        told, seen = np.isfinite(frame.angular_velocity), np.isfinite(body)
        known: Bools = np.logical_and.reduce(told & seen, axis=1)
        self._lost = np.where(known, 0.0, self._lost + dt)
        self.forget(self._lost > self._params.gap_time)
        rate = np.where(known[:, None], frame.angular_velocity, self._bias)
        self._learn(rate, stands & known)
        turn = (rate - self._bias) * dt
        self._level(turn, frame.linear_acceleration)
        across = self._across + _cross(self._across, turn)
        across -= (across * self._up).sum(axis=1, keepdims=True) * self._up
        self._across = _unit(across, self._across)
        side = _cross(self._up, self._across)
        now = np.arctan2((body * side).sum(axis=1), (body * self._across).sum(axis=1))
        self._now = np.where(known, now, self._now)

    def _learn(self, rate: Floats, stands: Bools) -> None:
        """Average what gyroscopes tell of rows at rest [rad/s], over all rests."""
        rests = stands & np.logical_and.reduce(abs(rate) < self._params.rest_rate, axis=1)
        self._rested = np.where(rests, self._rested + self._period, 0.0)
        settled = self._rested > self._params.rest_time
        longer = np.minimum(self._averaged + self._period, self._params.memory_time)
        self._averaged = np.where(settled, longer, self._averaged)
        share = np.where(settled, self._period / np.maximum(self._averaged, self._period), 0.0)
        self._bias += share[:, None] * (rate - self._bias)

    def _level(self, turn: Floats, force: Floats) -> None:
        """Carry the vertical along, and draw it to a force that is known whole [m/s²]."""
        whole = np.logical_and.reduce(np.isfinite(force), axis=1)
        force = np.where(whole[:, None], force, 0.0)
        up = self._up + _cross(self._up, turn)
        size = np.sqrt((force**2).sum(axis=1, keepdims=True))
        share = np.where(size > _LEAST, min(self._period / self._params.level_time, 1.0), 0.0)
        self._up = _unit(up + share * (force / np.maximum(size, _LEAST) - up), self._up)


def _cross(a: Floats, b: Floats) -> Floats:
    """Cross products, shape (B, 3), to the bit those of numpy, whose function takes longer."""
    (ax, ay, az), (bx, by, bz) = a.T, b.T
    return np.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], axis=1)


def _unit(vectors: Floats, before: Floats) -> Floats:
    """Vectors of length 1; where one has none, that of before."""
    size = np.sqrt((vectors**2).sum(axis=1, keepdims=True))
    return np.where(size > _SHORT, vectors / np.maximum(size, _SHORT), before)


def direction(yaw: Floats, pitch: Floats) -> Floats:
    """Sum of the directions of all links in the axes of the head, shape (B, 3).

    Args:
        yaw: Yaw joints, head first [rad], shape (B, Y).
        pitch: Pitch joints [rad], shape (B, Y).
    """
    x, y, z = np.ones(len(yaw)), np.zeros(len(yaw)), np.zeros(len(yaw))
    cosines, sines = np.cos([yaw, pitch]), np.sin([yaw, pitch])
    for joint in reversed(range(yaw.shape[1])):
        (c, up), (s, down) = cosines[:, :, joint], sines[:, :, joint]
        x, z = up * x + down * z, up * z - down * x
        x, y = c * x - s * y + 1.0, s * x + c * y
    return np.column_stack([x, y, z])


def steer(params: HeadingParams, turned: Floats) -> Floats:
    """Yaw offset that turns a body back [rad], positive to the right; arrays of one shape."""
    return np.clip(params.gain * turned, -params.largest, params.largest)
