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


class Heading:
    """How far B bodies have turned.

    Two directions of the world are carried along in the axes of the head by its angular velocity:
    the vertical, which is drawn to the specific force, and one across it, which nothing corrects. A
    gyroscope is wrong by a constant: what it tells of a robot that is at rest.

    Args:
        params: Its numbers.
        batch: Number of robots B.
        period: Control period [s].

    Attributes:
        turned: How far the body has turned since `mark` [rad], positive to the left, shape (B,); 0
            without a mark, and where the robot has no such sensor.
    """

    def __init__(self, params: HeadingParams, batch: int, period: float) -> None:
        self._params, self._period = params, period
        self._up: Floats = np.tile(_UP, (batch, 1))
        self._across: Floats = np.tile(_AHEAD, (batch, 1))
        self._bias: Floats = np.zeros((batch, 3))
        self._rested: Floats = np.zeros(batch)
        self._now: Floats = np.zeros(batch)
        self._from: Floats = np.full(batch, np.nan)

    def reset(self, rows: Ints | Bools) -> None:
        """Some rows begin anew, upright, without a mark."""
        self._up[rows], self._across[rows] = _UP, _AHEAD
        self._bias[rows] = 0.0
        self._rested[rows] = self._now[rows] = 0.0
        self._from[rows] = np.nan

    @property
    def turned(self) -> Floats:
        """See above."""
        away = np.nan_to_num(self._now - self._from)
        turned: Floats = (away + math.pi) % (2.0 * math.pi) - math.pi
        return turned

    def mark(self, rows: Bools) -> None:
        """Measure from here on in those of these rows, shape (B,), that have no mark."""
        rows = rows & np.isnan(self._from)
        self._from[rows] = self._now[rows]

    def forget(self, rows: Bools) -> None:
        """Measure nothing in these rows, shape (B,)."""
        self._from[rows] = np.nan

    def step(self, frame: AntennaFrame, body: Floats, stands: Bools) -> None:
        """Take one reading; a rate that is missing counts as none.

        Args:
            frame: The reading.
            body: Direction of the body in the axes of the head, of any length, shape (B, 3).
            stands: Rows whose joints have been told to stand, shape (B,).
        """
        if frame.angular_velocity.size == 0:
            return
        known: Bools = np.logical_and.reduce(np.isfinite(frame.angular_velocity), axis=1)
        told = np.where(known[:, None], frame.angular_velocity, self._bias)
        rests = stands & known & (abs(told) < self._params.rest_rate).all(axis=1)
        self._rested = np.where(rests, self._rested + self._period, 0.0)
        over = self._rested - self._params.rest_time
        share = np.where(over > 0.0, self._period / np.maximum(over, self._period), 0.0)
        self._bias += share[:, None] * (told - self._bias)  # the mean since then
        turn = (told - self._bias) * self._period
        self._level(turn, np.nan_to_num(frame.linear_acceleration))
        across = self._across + np.cross(self._across, turn)
        across -= (across * self._up).sum(axis=1, keepdims=True) * self._up
        self._across = _unit(across)
        side = np.cross(self._up, self._across)
        self._now = np.arctan2((body * side).sum(axis=1), (body * self._across).sum(axis=1))

    def _level(self, turn: Floats, force: Floats) -> None:
        """Carry the vertical along, and draw it to the specific force [m/s²]."""
        up = self._up + np.cross(self._up, turn)
        size = np.sqrt((force**2).sum(axis=1, keepdims=True))
        share = np.where(size > _LEAST, min(self._period / self._params.level_time, 1.0), 0.0)
        self._up = _unit(up + share * (force / np.maximum(size, _LEAST) - up))


def _unit(vectors: Floats) -> Floats:
    return vectors / np.sqrt((vectors**2).sum(axis=1, keepdims=True))


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
