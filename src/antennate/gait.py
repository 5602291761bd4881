"""Maneuver and phase to joint targets.

The body carries the serpenoid wave of the paper, alpha_j = A sin(2 pi xi j / 5 - P + delta) +
offset
with P the gait phase: as P grows the crest travels from head to tail and the robot advances. Leg i
turns with P - 2 pi xi i / 6, the right one half a turn later. The lead delta of the body over the
legs decides the speed: it is best where the feet are down on the side towards which the body bends.

A positive offset bends every joint to the right-hand turn: joint j rotates the rear link against
the front one, so the head points right of the tail.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from antennate.anatomy import LINK_COUNT, YAW_COUNT
from antennate.params import GaitParams
from antennate.records import Bools, Floats, Ints, Pose

_DIRECTION = np.array([1.0, 1.0, 1.0, -1.0, 0.0])
"""Sense in which the phase runs in each maneuver: REVERSE runs body and legs backwards."""
_STEER = np.array([0.0, -1.0, 1.0, 0.0, 0.0])
"""Sign of the yaw offset in each maneuver."""
_STEERS = np.array([1.0, 1.0, 1.0, 1.0, 0.0])
"""Whether the offset moves in each maneuver."""
_SIDES = np.array([0.0, math.pi])


@lru_cache
def _lags(wave_number: float, body_phase: float) -> tuple[Floats, Floats]:
    """Phase of each yaw joint and lag of each link [rad], shapes (5,) and (6,)."""
    lag = 2.0 * math.pi * wave_number
    joints = lag * np.arange(1, YAW_COUNT + 1) / YAW_COUNT + body_phase
    return joints, lag * np.arange(LINK_COUNT) / LINK_COUNT


def targets(params: GaitParams, phase: Floats, offset: Floats) -> Pose:
    """Joint targets at a gait phase.

    Args:
        params: Wave and timing of the gait.
        phase: Gait phase P [rad], shape (B,), unwrapped.
        offset: Yaw offset [rad], shape (B,); positive turns right.

    Returns:
        The pose, antenna bases at their mounting angle.
    """
    joints, links = _lags(params.wave_number, params.body_phase)
    yaw = params.amplitude * np.sin(joints - phase[:, None]) + offset[:, None]
    leg = (phase[:, None] - links)[:, :, None] + _SIDES
    return Pose(yaw=yaw, leg=leg, antenna=np.zeros((phase.shape[0], 2)))


class Gait:
    """The gait's memory: phase and offset. Both are continuous whatever the maneuvers."""

    def __init__(self, params: GaitParams, batch: int, period: float) -> None:
        self.params = params
        self.phase: Floats = np.zeros(batch)
        self.offset: Floats = np.zeros(batch)
        self._advance = 2.0 * math.pi * params.frequency * period
        self._slew = params.offset_rate * period

    def reset(self, rows: Ints | Bools, phase: Floats | float = 0.0) -> None:
        """Start some rows anew at the given phase [rad], straight."""
        self.phase[rows] = phase
        self.offset[rows] = 0.0

    def step(self, maneuver: Ints, turn_offset: Floats | float | None = None) -> Pose:
        """Advance one control period and return the targets.

        Args:
            maneuver: One `Maneuver` a row, shape (B,). HOLD keeps the pose.
            turn_offset: Yaw offset of the turns [rad], the gait's own if absent.
        """
        size = self.params.turn_offset if turn_offset is None else turn_offset
        change = _STEER[maneuver] * size - self.offset
        change = np.minimum(np.maximum(change, -self._slew), self._slew)
        self.offset += change * _STEERS[maneuver]
        self.phase += _DIRECTION[maneuver] * self._advance
        return targets(self.params, self.phase, self.offset)
