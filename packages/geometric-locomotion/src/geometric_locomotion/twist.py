"""The twist map: which gait gives a forward speed and a curvature, in microseconds.

A map holds, for one frequency, the twists of a table of gaits: amplitudes of the body wave against
yaw offsets, each amplitude with its own lead. Both ways are bilinear interpolations. Curvature is
yaw over forward distance [1/m], positive to the left; a positive offset turns right.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from geometric_locomotion.arguments import numbers, scalar, whole
from geometric_locomotion.errors import BadInputError
from geometric_locomotion.types import Floats


class Wave(NamedTuple):
    """A body wave, or as many as its arrays are long.

    Attributes:
        amplitude: Amplitude of a yaw joint [rad].
        wave_number: Waves along the body.
        lead: Lead of the body wave over the legs [rad].
        offset: Yaw offset [rad]; positive turns right.
    """

    amplitude: Floats | float
    wave_number: Floats | float
    lead: Floats | float
    offset: Floats | float


_Rows = list[list[float]]
_SPEEDS, _CURVATURES = 25, 33
"""Size of the table from twist to gait."""


def _columns(at: float, first: float, width: float, count: int) -> tuple[int, float]:
    """Cell of an even grid and place in it; the nearest one outside."""
    place = (at - first) / width
    cell = min(max(int(place), 0), count - 2)
    return cell, min(max(place - cell, 0.0), 1.0)


@dataclass(frozen=True)
class TwistMap:
    """Forward speed and curvature to gait, and back, at one frequency.

    Attributes:
        amplitude: Amplitudes from 0 on [rad], rising evenly, shape (A,).
        offset: Offsets from 0 on [rad], rising evenly, shape (O,).
        lead: Lead of each amplitude [rad], shape (A,).
        wave_number: Waves along the body.
        speed: Forward speed of each gait [m/s], shape (A, O).
        curvature: Curvature to the right of each [1/m], not negative, shape (A, O).
    """

    amplitude: Floats
    offset: Floats
    lead: Floats
    wave_number: float
    speed: Floats
    curvature: Floats
    _inverse: tuple[_Rows, _Rows, list[tuple[float, float]], float] = field(
        init=False, repr=False, compare=False
    )
    _forward: tuple[_Rows, _Rows, list[float], float, float] = field(
        init=False, repr=False, compare=False
    )

    def __post_init__(self) -> None:
        """Invert the table: at each curvature, amplitude and offset over the speeds it allows."""
        size = [len(numbers(name, getattr(self, name), None)) for name in ("amplitude", "offset")]
        for name, count in zip(("amplitude", "offset"), size, strict=True):
            whole(f"number of {name}s", count, 2)
            numbers(f"steps of {name}", np.diff(getattr(self, name)), count - 1, above=0.0)
        numbers("lead", self.lead, size[0])
        scalar("wave_number", self.wave_number)
        numbers("speed", self.speed, *size)
        numbers("curvature", self.curvature, *size)
        amplitudes, offsets, ranges = [], [], []
        bent = np.maximum.accumulate(self.curvature, 1)
        for wanted in np.linspace(0.0, self.sharpest, _CURVATURES):
            at = np.array([np.interp(wanted, row, self.offset) for row in bent])
            rows = zip(at, self.speed, strict=True)
            speeds = np.array([np.interp(o, self.offset, row) for o, row in rows])
            able = bent[:, -1] >= wanted - 1e-12
            fast, first = speeds[able], int(np.flatnonzero(able)[0])
            rising = np.maximum.accumulate(fast)
            even = np.linspace(rising[0], rising[-1], _SPEEDS)
            chosen = np.interp(even, rising + 1e-9 * np.arange(len(rising)), np.flatnonzero(able))
            index = np.arange(len(at))
            amplitudes.append(np.interp(chosen, index, self.amplitude).tolist())
            offsets.append(np.interp(chosen, index[first:], at[first:]).tolist())
            ranges.append((float(even[0]), max(float(even[1] - even[0]), 1e-9)))
        inverse = amplitudes, offsets, ranges, self.sharpest / (_CURVATURES - 1)
        object.__setattr__(self, "_inverse", inverse)
        table = self.speed.tolist(), self.curvature.tolist(), self.lead.tolist()
        widths = (float(grid[1] - grid[0]) for grid in (self.amplitude, self.offset))
        object.__setattr__(self, "_forward", (*table, *widths))

    @property
    def sharpest(self) -> float:
        """Largest curvature either way [1/m]."""
        return float(self.curvature.max())

    def speeds(self, curvature: float) -> tuple[float, float]:
        """Slowest and fastest forward speed [m/s] at a curvature [1/m]."""
        scalar("curvature", curvature)
        _, _, ranges, height = self._inverse
        row, part = _columns(abs(curvature), 0.0, height, len(ranges))
        slowest, width = _mixed(ranges[row], ranges[row + 1], part)
        return slowest, slowest + width * (_SPEEDS - 1)

    def gait(self, speed: float, curvature: float) -> Wave:
        """The gait of a forward speed [m/s] and a curvature [1/m]; else the nearest there is.

        Of what cannot be had together the curvature is kept, and the speed gives way.

        Raises:
            BadInputError: One is not finite.
        """
        if not math.isfinite(speed + curvature):
            raise BadInputError(
                f"twist map: expected a finite speed and curvature, found {speed} and {curvature}"
            )
        amplitudes, offsets, ranges, height = self._inverse
        count = len(ranges)
        row, part = _columns(abs(curvature), 0.0, height, count)
        slowest, width = _mixed(ranges[row], ranges[row + 1], part)
        column, share = _columns(speed, slowest, width, _SPEEDS)
        amplitude = _between(amplitudes, row, part, column, share)
        offset = _between(offsets, row, part, column, share)
        return Wave(
            amplitude,
            self.wave_number,
            self._lead(amplitude),
            -offset if curvature > 0.0 else offset,
        )

    def twist(self, amplitude: float, offset: float) -> tuple[float, float]:
        """Forward speed [m/s] and curvature [1/m] of a gait of the map."""
        scalar("amplitude", amplitude)
        scalar("offset", offset)
        speed, curvature, _, high, wide = self._forward
        row, part = _columns(amplitude, 0.0, high, len(speed))
        column, share = _columns(abs(offset), 0.0, wide, len(speed[0]))
        bent = _between(curvature, row, part, column, share)
        return _between(speed, row, part, column, share), -bent if offset > 0.0 else bent

    def _lead(self, amplitude: float) -> float:
        _, _, leads, high, _ = self._forward
        row, part = _columns(amplitude, 0.0, high, len(leads))
        return leads[row] + part * (leads[row + 1] - leads[row])


def _mixed(low: tuple[float, float], high: tuple[float, float], part: float) -> tuple[float, float]:
    return low[0] + part * (high[0] - low[0]), low[1] + part * (high[1] - low[1])


def _between(table: list[list[float]], row: int, part: float, column: int, share: float) -> float:
    """A value within a cell of a table."""
    low, high = table[row], table[row + 1]
    first = low[column] + share * (low[column + 1] - low[column])
    second = high[column] + share * (high[column + 1] - high[column])
    return first + part * (second - first)
