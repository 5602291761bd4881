"""The shape of an antenna that touches: bent forward, bent backward, straight, or in between.

One classifier serves the simulated antenna of `sweep` and the tracked one of `tracks`. Angles are
positive outwards, away from the robot or animal on the antenna's own side; 0 is straight ahead.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Protocol

import numpy as np

from antennate.types import Bools, Floats, Ints


class Shape(IntEnum):
    """Shape of an antenna that touches."""

    FORWARD = 0
    BACKWARD = 1
    STRAIGHT = 2
    TRANSITION = 3


class BendLimits(Protocol):
    """What is called bent.

    Attributes:
        flex: Bend below which the antenna is straight [rad].
        offset: Angle of the tip off the base's direction below which it is straight [rad].
    """

    @property
    def flex(self) -> float: ...  # noqa: D102

    @property
    def offset(self) -> float: ...  # noqa: D102


@dataclass(frozen=True, slots=True)
class Outline:
    """Angles of an antenna of k points, sample by sample.

    Attributes:
        direction: From the base to the tip [rad], shape (n,).
        end: Of the last segment [rad], without a jump from pi to -pi along the antenna, shape (n,).
        flex: Sum of the turns at the inner points [rad], shape (n,).
        offset: Direction less that of the first segment [rad], shape (n,).
        curvature: Turn at each inner point over the mean length of both segments, times the length
            of the antenna [rad], shape (n, k - 2).
        length: Sum of the lengths of the segments, shape (n,).
    """

    direction: Floats
    end: Floats
    flex: Floats
    offset: Floats
    curvature: Floats
    length: Floats


def outline(points: Floats) -> Outline:
    """The angles of an antenna from points along it.

    Args:
        points: From base to tip, ahead and outwards, shape (n, k, 2) with k of at least 2; where
            one is NaN, what follows from it is NaN.
    """
    segments = np.diff(points, axis=1)
    lengths = np.hypot(segments[..., 0], segments[..., 1])
    headings = np.arctan2(segments[..., 1], segments[..., 0])
    turns = wrapped(np.diff(headings, axis=1))
    whole = points[:, -1] - points[:, 0]
    direction = np.arctan2(whole[:, 1], whole[:, 0])
    flex, length = turns.sum(axis=1), lengths.sum(axis=1)
    near = (lengths[:, 1:] + lengths[:, :-1]) / 2.0
    curvature = turns / np.where(near > 0, near, np.nan) * length[:, None]
    offset = wrapped(direction - headings[:, 0])
    return Outline(direction, headings[:, 0] + flex, flex, offset, curvature, length)


def wrapped(angle: Floats) -> Floats:
    """Angles in [-pi, pi) [rad]."""
    return (angle + np.pi) % (2.0 * np.pi) - np.pi


def classify(limits: BendLimits, flex: Floats, offset: Floats) -> Ints:
    """Shape of a touching antenna, one `Shape` for every flex and offset of the tip [rad].

    FORWARD points ahead: flex sensor and tip both bend towards the heading. BACKWARD points to the
    tail: both bend there. STRAIGHT does neither. All else is a TRANSITION, like an S.
    """
    straight = (abs(flex) < limits.flex) & (abs(offset) < limits.offset)
    forward = (flex <= -limits.flex) & (offset <= -limits.offset)
    backward = (flex >= limits.flex) & (offset >= limits.offset)
    return np.select(
        [straight, forward, backward],
        [Shape.STRAIGHT, Shape.FORWARD, Shape.BACKWARD],
        Shape.TRANSITION,
    ).astype(np.int64)


def pointing(direction: Floats, angle: float) -> Ints:
    """FORWARD where a direction lies ahead of `angle` [rad] on either side, else BACKWARD."""
    ahead = abs(wrapped(direction)) < angle
    return np.where(ahead, Shape.FORWARD, Shape.BACKWARD).astype(np.int64)


def held(shape: Ints, samples: int) -> Ints:
    """Shapes, with those held for fewer samples in a row as TRANSITION; negative ones stay."""
    if len(shape) == 0:
        return shape
    starts = np.flatnonzero(np.concatenate([[True], np.diff(shape) != 0]))
    lengths = np.diff(np.append(starts, len(shape)))
    brief: Bools = np.repeat(lengths < samples, lengths)
    return np.where(brief & (shape >= 0), Shape.TRANSITION, shape).astype(np.int64)
