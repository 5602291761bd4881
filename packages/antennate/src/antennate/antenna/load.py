"""The load of an antenna's springs over a walk: extremes of the torque, and its cycles."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from antennate.types import Floats


@dataclass(frozen=True, slots=True)
class SpringLoad:
    """The load of the spring of a chain that bore the largest torque.

    Attributes:
        low: Smallest torque [N·m], negative where it was bent the other way too.
        high: Largest torque [N·m]; it counts as positive.
        cycles: Load cycles: half of the reversals that are larger than a tenth of its range.
    """

    low: float = 0.0
    high: float = 0.0
    cycles: int = 0


def largest_load(angles: Floats, stiffness: Sequence[float]) -> SpringLoad:
    """The load of the spring that bore the largest torque.

    Args:
        angles: Angles of all springs over time [rad], shape (t, n); n is a multiple of the next.
        stiffness: Stiffness of the springs of one chain [N·m/rad].
    """
    if not angles.size:
        return SpringLoad()
    torque = angles * np.resize(stiffness, angles.shape[1])
    worst = int(np.abs(torque).max(axis=0).argmax())
    course = torque[:, worst]
    course = course * np.sign(course[np.abs(course).argmax()])
    low, high = float(course.min()), float(course.max())
    return SpringLoad(low, high, _reversals(course, 0.1 * (high - low)) // 2)


def _reversals(course: Floats, least: float) -> int:
    """Turning points (n,) that the course leaves by more than `least`."""
    slope = np.sign(np.diff(course))
    turns = course[1:-1][slope[1:] * slope[:-1] <= 0.0].tolist()
    reversals, way, end = 0, 0, float(course[0])
    for value in [*turns, float(course[-1])]:
        if way * (value - end) > 0.0:
            end = value
        elif abs(value - end) > least:
            reversals += way != 0
            way, end = (1 if value > end else -1), value
    return reversals
