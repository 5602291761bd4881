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

STUCK = 0.1
"""Time for which all six axes say the same that means a stuck sensor [s] (assumed), in `EQUAL`
readings at least. With the noise of the datasheet two in a row are once in 10^4 (computed)."""
EQUAL = 4
"""Equal readings in a row without which none is called stuck, however seldom they come."""
RAILED = 0.1
"""Time for which an axis is at the end of its range that means a broken one [s]; a knock is over
sooner (assumed)."""
SILENT = 0.1
"""Time without a reading from which on it is named [s] (assumed)."""
_TOLERANCE = 1e-3
"""Times of readings are no rounder than that [s]."""


class ImuFinding(Enum):
    """What the inertial sensor is found to be."""

    OK = "ok"
    MISSING = "no answer"
    STUCK = "always the same readings"
    RAILED = "readings at the end of the range"


class ImuDiagnosis:
    """Judges the readings of one inertial sensor.

    An axis at the end of its range is NaN at once: it may turn, or be knocked, by any more.

    Args:
        params: The sensor.

    Attributes:
        finding: Of the newest reading; MISSING before the first.
        counted: Readings by what they were found to be.
        angular_velocity: For the controller [rad/s], shape (1, 3); NaN where it cannot be used.
        linear_acceleration: The same of the specific force [m/s²].
        misses: Readings that the sensor has not given since the board began, as the board counts
            them modulo 65536; 0 before the first sample.
    """

    def __init__(self, params: ImuParams) -> None:
        self._params = params
        self.finding = ImuFinding.MISSING
        self.counted = dict.fromkeys(ImuFinding, 0)
        self._unknown: Floats = np.full((1, AXES), math.nan)
        self.angular_velocity = self.linear_acceleration = self._unknown
        self.misses = 0
        self._t = -math.inf
        self._counts: Floats = np.full(2 * AXES, math.nan)
        self._equal = 0
        self._missing_since = self._equal_since = math.inf
        self._railed_since: Floats = np.full(2 * AXES, math.inf)

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
            self._judge(t, counts)
            self.counted[self.finding] += 1
        known = (self.finding is ImuFinding.OK) & (abs(counts) < self._params.most)
        good = np.where(known, counts, math.nan)
        self.angular_velocity, self.linear_acceleration = measured(self._params, good[None])

    def _judge(self, t: float, counts: Floats) -> None:
        missing = bool(np.isnan(counts).any())
        self._missing_since = min(self._missing_since, t) if missing else math.inf
        if np.array_equal(counts, self._counts):
            self._equal += 1
        else:
            self._equal, self._equal_since, self._counts = 1, t, counts
        at_end = abs(counts) >= self._params.most
        self._railed_since = np.where(at_end, np.minimum(self._railed_since, t), math.inf)
        self.finding = (
            ImuFinding.MISSING
            if missing
            else ImuFinding.RAILED
            if self._lasts(float(self._railed_since.min()), RAILED)
            else ImuFinding.STUCK
            if self._equal >= EQUAL and self._lasts(self._equal_since, STUCK)
            else ImuFinding.OK
        )

    def _lasts(self, since: float, limit: float) -> bool:
        """Whether something has lasted from a time [s] until now for as long as a limit [s]."""
        return self._t - since >= limit - _TOLERANCE

    @property
    def fault(self) -> str:
        """What is wrong with it for longer than a moment, empty if nothing is."""
        missing = self.finding is ImuFinding.MISSING
        if missing and not self._lasts(self._missing_since, SILENT):
            return ""
        return "" if self.finding is ImuFinding.OK else self.finding.value

    def result(self) -> Mapping[str, int]:
        """Number of readings by finding, and how many the board has missed."""
        counted = {finding.name.lower(): count for finding, count in self.counted.items()}
        return {**counted, "missed_by_board": self.misses}
