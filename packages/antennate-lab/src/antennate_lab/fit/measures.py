"""What a step comes to in a few numbers: how late joints are, how far the head turns."""

from __future__ import annotations

import math

import numpy as np

from antennate.types import Floats
from antennate_lab.fit.residuals import YAW_AXIS, moving
from antennate_lab.fit.simulated import Course


def lags(course: Course) -> Floats:
    """Time by which each moving joint follows its commands late [s], shape (moving,).

    The shift of least squares: the way that a joint is behind, over the speed of its command.
    """
    joints = moving(course)
    speed = np.gradient(course.commands[:, joints], course.period, axis=0)
    behind = course.commands[:, joints] - course.positions[:, joints]
    return (behind * speed).sum(axis=0) / (speed**2).sum(axis=0)


def turn(course: Course) -> float:
    """Turn of the head to the left in a cycle of the gait [rad], NaN without a gyroscope."""
    if not course.gyro.size or not course.cycle:
        return math.nan
    cycles = max(1, math.floor(len(course.gyro) * course.period / course.cycle + 1e-6))
    ticks = round(cycles * course.cycle / course.period)
    return float(course.gyro[:ticks, YAW_AXIS].sum() * course.period / cycles)


def error(course: Course, measured: Course) -> float:
    """Root of the mean square difference of the moving joints' angles [rad]."""
    joints = moving(measured)
    return float(np.sqrt(((course.positions - measured.positions)[:, joints] ** 2).mean()))
