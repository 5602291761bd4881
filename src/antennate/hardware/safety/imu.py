"""Diagnosis of the inertial sensor: are its readings worth anything?

They come in the samples of the board, so their age is that of the antennae's. A robot walks without
them: what is wrong makes its numbers NaN, is counted and named, and stops nothing.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from enum import Enum

import numpy as np

from antennate.robots.imu import AXES, ImuParams, measured
from antennate.types import Floats

STUCK = 10
"""Equal readings of all six axes in a row that mean a stuck sensor: 100 ms. With the noise of the
datasheet two in a row are equal once in 10^4 (computed)."""
RAILED = 10
"""Readings in a row at the end of the range of an axis that mean a broken one; a knock is over
sooner (assumed)."""
SILENT = 10
"""Readings missing in a row from which on it is named (assumed)."""


class ImuFinding(Enum):
    """What the inertial sensor is found to be."""

    OK = "ok"
    MISSING = "no answer"
    STUCK = "always the same readings"
    RAILED = "readings at the end of the range"


class ImuDiagnosis:
    """Judges the readings of one inertial sensor.

    Args:
        params: The sensor.

    Attributes:
        finding: Of the newest reading; MISSING before the first.
        counted: Readings by what they were found to be.
        angular_velocity: For the controller [rad/s], shape (1, 3); NaN where it cannot be used.
        linear_acceleration: The same of the specific force [m/s²].
    """

    def __init__(self, params: ImuParams) -> None:
        self._params = params
        self.finding = ImuFinding.MISSING
        self.counted = dict.fromkeys(ImuFinding, 0)
        self._unknown: Floats = np.full((1, AXES), math.nan)
        self.angular_velocity = self.linear_acceleration = self._unknown
        self._t = -math.inf
        self._counts: Floats = np.full(2 * AXES, math.nan)
        self._missing = self._equal = 0
        self._at_end: Floats = np.zeros(2 * AXES)

    def step(self, t: float, counts: Floats | None) -> None:
        """Take the newest reading.

        Args:
            t: Time at which it was taken [s]; one not newer than the last is not counted again.
            counts: The six readings [counts], gyroscopes first; NaN where the sensor did not
                answer; None where the sample itself is missing or too old, which is not its fault.
        """
        if counts is None:
            self.angular_velocity = self.linear_acceleration = self._unknown
            return
        if t > self._t:
            self._t = t
            self._judge(counts)
            self.counted[self.finding] += 1
        good = counts if self.finding is ImuFinding.OK else np.full_like(counts, math.nan)
        self.angular_velocity, self.linear_acceleration = measured(self._params, good[None])

    def _judge(self, counts: Floats) -> None:
        missing = bool(np.isnan(counts).any())
        self._missing = self._missing + 1 if missing else 0
        self._equal = self._equal + 1 if np.array_equal(counts, self._counts) else 1
        self._at_end = np.where(abs(counts) >= self._params.most, self._at_end + 1, 0)
        self._counts = counts
        self.finding = (
            ImuFinding.MISSING
            if missing
            else ImuFinding.RAILED
            if self._at_end.max() >= RAILED
            else ImuFinding.STUCK
            if self._equal >= STUCK
            else ImuFinding.OK
        )

    @property
    def fault(self) -> str:
        """What is wrong with it for longer than a moment, empty if nothing is."""
        soon = self.finding is ImuFinding.MISSING and self._missing < SILENT
        if soon or self.finding is ImuFinding.OK:
            return ""
        return self.finding.value

    def result(self) -> Mapping[str, int]:
        """How many readings were found to be what."""
        return {finding.name.lower(): count for finding, count in self.counted.items()}
