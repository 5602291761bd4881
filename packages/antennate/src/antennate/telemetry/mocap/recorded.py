"""What a log says of the head: how far it had turned, and in a simulation where it was."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import accumulate
from pathlib import Path

import numpy as np

from antennate.errors import BadInputError
from antennate.telemetry.mocap.clock import with_gaps
from antennate.telemetry.reader import LogReader
from antennate.telemetry.topics import COORDINATES
from antennate.types import Floats

GYRO, JOINTS = "gyro", "joints"
"""Where the yaw rate of a log comes from."""
ERRORS, WEAKEST = {GYRO: 0.001, JOINTS: 0.02}, {GYRO: 0.97, JOINTS: 0.85}
"""What each adds to the error of a clock [s], and the correlation of yaw rates that tables of other
logs do not reach: by 42 simulated logs, with their own tables and those of others."""


@dataclass(frozen=True)
class Recorded:
    """The head over a log.

    Attributes:
        reader: The log as it was read.
        source: `GYRO`, or `JOINTS` where there is no inertial sensor.
        t: Times [s], shape (n,).
        turned: How far the head had turned [rad], by the joints against the mean of all links, NaN
            in gaps, shape (n,).
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
        yaw, rows, truth = log.header.robot.places("yaw"), list[list[float]](), list[list[float]]()
        links = yaw.stop - yaw.start + 1
        for records, tick in log.groups():
            if tick is None:
                continue
            behind = sum(accumulate(tick.positions[yaw])) / links if tick.positions else math.nan
            rate = tick.angular_velocity[2] if tick.angular_velocity else math.nan
            rows.append([tick.now, tick.age, rate, behind])
            for record in records:
                if record.topic is COORDINATES:
                    state = COORDINATES.decode(record.data)
                    x, y, _, w, _, _, z = state["position"][state["robot"] :][:7]
                    truth.append([tick.now, x, y, 2.0 * math.atan2(z, w)])
        log.require_ticks()
    course = np.array(truth).reshape(-1, 4)
    course[:, 3] = np.unwrap(course[:, 3])
    t, late, rate, behind = np.array(rows).T
    source = GYRO if np.isfinite(rate).any() else JOINTS
    t, turned = _by_gyro(t - np.nan_to_num(late), rate) if source == GYRO else (t, -behind)
    known = np.isfinite(turned)
    if links < 2 or not known.any():
        raise BadInputError(
            f"{path}: expected an inertial sensor, or measured yaw joints, found neither: nothing "
            "tells how the head turned"
        )
    t, turned = with_gaps(t[known], turned[known])
    return Recorded(log, source, t, turned, course)


def _by_gyro(t: Floats, rate: Floats) -> tuple[Floats, Floats]:
    """Times and turn by the gyroscope: a sample is the mean rate since the one before."""
    new = np.isfinite(rate) & (np.diff(t, prepend=-np.inf) > 0)
    t, rate = t[new], rate[new]
    return t, np.concatenate([[0.0], np.cumsum(rate[1:] * np.diff(t))])
