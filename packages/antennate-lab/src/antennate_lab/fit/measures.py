"""What a step comes to in a few numbers: how late joints are, how far the head goes and turns."""

from __future__ import annotations

import itertools
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


def strides(course: Course) -> Floats:
    """Speed [m] and turn to the left [rad] of the cycles of a walk by motion capture.

    Returns:
        A row for each whole cycle, NaN if it has a gap, shape (cycles, 2); none without poses.
    """
    if course.poses is None or not course.cycle:
        return np.zeros((0, 2))
    last = len(course.poses) - 1
    count = math.floor(len(course.poses) * course.period / course.cycle + 1e-6)
    ends = np.rint(np.arange(count + 1) * course.cycle / course.period).astype(int)
    rows = []
    for begin, end in itertools.pairwise(np.minimum(ends, last).tolist()):
        sound = np.isfinite(course.poses[begin : end + 1]).all()
        x, y, turned = course.poses[end] - course.poses[begin]
        rows.append((math.hypot(x, y), turned) if sound else (math.nan, math.nan))
    return np.array(rows).reshape(-1, 2)


def speed(course: Course, measured: Course) -> float:
    """Mean speed of the cycles that motion capture has seen whole [m/cycle], NaN without."""
    seen = np.isfinite(strides(measured)[:, 0])
    return float(strides(course)[seen, 0].mean()) if seen.any() else math.nan


def error(course: Course, measured: Course) -> float:
    """Root of the mean square difference of the moving joints' angles [rad]."""
    joints = moving(measured)
    return float(np.sqrt(((course.positions - measured.positions)[:, joints] ** 2).mean()))
