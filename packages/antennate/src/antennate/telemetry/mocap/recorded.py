"""What a log says of the head: how far it had turned, and in a simulation where it was."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from antennate.errors import BadInputError
from antennate.robots.spec import RobotSpec
from antennate.telemetry.reader import LogReader
from antennate.telemetry.ticks import Tick
from antennate.telemetry.topics import COORDINATES
from antennate.types import Floats

GYRO, JOINTS = "gyro", "joints"
"""Where the yaw rate of a log comes from."""
ERRORS = {GYRO: 0.001, JOINTS: 0.02}
"""What each adds to the error of a clock [s]: 41 simulated logs, with and without a gyroscope."""


@dataclass(frozen=True)
class Recorded:
    """The head over a log.

    Attributes:
        reader: The log as it was read.
        source: `GYRO`, or `JOINTS` where there is no inertial sensor.
        t: Times [s], shape (n,).
        turned: How far the head had turned since the first of them [rad], shape (n,).
        truth: In a simulation times [s], x, y [m] and heading [rad] of the head, shape (m, 4), 0
            rows else.
    """

    reader: LogReader
    source: str
    t: Floats
    turned: Floats
    truth: Floats


def recorded(path: Path) -> Recorded:
    """What a log says of the head.

    Raises:
        BadInputError: Nothing tells how the head turned.
        LogError: The log cannot be read.
    """
    with LogReader(path) as log:
        robot, ticks, truth = log.header.robot, list[Tick](), list[list[float]]()
        for records, tick in log.groups():
            if tick is None:
                continue
            ticks.append(tick)
            for record in records:
                if record.topic is COORDINATES:
                    state = COORDINATES.decode(record.data)
                    x, y, _, w, _, _, z = state["position"][state["robot"] :][:7]
                    truth.append([tick.now, x, y, 2.0 * math.atan2(z, w)])
        log.require_ticks()
    course = np.array(truth).reshape(-1, 4)
    course[:, 3] = np.unwrap(course[:, 3])
    gyro = robot.has_imu and any(tick.angular_velocity for tick in ticks)
    t, turned = _by_gyro(ticks) if gyro else _by_joints(path, robot, ticks)
    return Recorded(log, GYRO if gyro else JOINTS, t, turned, course)


def _by_gyro(ticks: Sequence[Tick]) -> tuple[Floats, Floats]:
    """Times and turn by the gyroscope: a sample is the mean rate since the one before."""
    felt = [
        tick for tick in ticks if tick.angular_velocity and math.isfinite(tick.angular_velocity[2])
    ]
    late = np.nan_to_num([tick.age for tick in felt])
    t = np.array([tick.now for tick in felt]) - late
    new = np.diff(t, prepend=-np.inf) > 0
    t, rate = t[new], np.array([tick.angular_velocity[2] for tick in felt])[new]
    return t, np.concatenate([[0.0], np.cumsum(rate[1:] * np.diff(t))])


def _by_joints(path: Path, robot: RobotSpec, ticks: Sequence[Tick]) -> tuple[Floats, Floats]:
    """Times and turn by the yaw joints: the head turns against the mean of all links."""
    yaw = robot.places("yaw")
    told = [(tick.now, tick.positions[yaw]) for tick in ticks if tick.positions]
    angles = np.array([angles for _, angles in told]).reshape(len(told), yaw.stop - yaw.start)
    known = np.isfinite(angles).all(axis=1)
    if not angles.size or not known.any():
        raise BadInputError(
            f"{path}: expected an inertial sensor, or measured yaw joints, found neither: nothing "
            "tells how the head turned"
        )
    behind = np.cumsum(angles[known], axis=1).sum(axis=1) / (yaw.stop - yaw.start + 1)
    return np.array([t for t, _ in told])[known], -behind
