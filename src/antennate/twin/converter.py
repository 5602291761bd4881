"""The converter of the twin's antenna board: readings to codes, with faults on demand."""

from __future__ import annotations

import math

import numpy as np

from antennate.hardware.esp32.frame import FULL_SCALE
from antennate.types import Floats

SIDES = ("left", "right")
_STICKY_NOISE = 9.35
"""Noise of a converter whose codes stick [counts]: 45 readings of github.com/espressif/esp-idf
issue 164."""
_STICKY_SHARE = 0.8
"""Share of its readings that go to the nearest fourth code; with chance it makes the 38 of 45."""
_STICKY_CODE = 3
"""The remainder of those codes by 4."""


class Converter:
    """Makes codes of both readings.

    Args:
        seed: Of its chance.
        mains: Frequency of what hums [Hz].

    Attributes:
        mains: That frequency.
        wires: What is wrong with the wire of each antenna: "open", "short", "stuck", or nothing.
        held: Readings at which somebody holds the antennae [counts], NaN for none.
        hum: Amplitude of the hum on both readings [counts].
        drift: Change of both readings since it began [counts/s].
        plateau: Highest code; below the full scale as if an attenuation were not set.
        sticky: Noise of 9 counts, and most codes the same modulo 4.
        radio_noise: Standard deviation of the noise while the radio sends [counts].
        radio: Whether the board sends by radio.
    """

    def __init__(self, seed: int, mains: float) -> None:
        self._chance, self.mains = np.random.default_rng(seed), mains
        self.wires = ["", ""]
        self.held = [math.nan, math.nan]
        self.hum = self.radio_noise = self.drift = 0.0
        self.plateau = float(FULL_SCALE)
        self.sticky = self.radio = False
        self._drifted = self._t = 0.0
        self._stuck = [math.nan, math.nan]

    def set(self, what: str, size: float) -> None:
        """Begin a fault by its name, of a size [counts or counts/s]."""
        kind, _, side = what.rpartition("_")
        if what in SIDES:
            self.held[SIDES.index(what)] = size
        elif side in SIDES:
            self.wires[SIDES.index(side)] = kind
        else:
            setattr(self, what, True if what == "sticky" else size)

    def codes(self, t: float, readings: Floats, noise: Floats) -> tuple[int, int]:
        """Codes at the time t [s] of exact readings (2,) and their noise (2,) [counts]."""
        self._drifted += self.drift * (t - self._t)
        self._t = t
        readings = np.where(np.isnan(self.held), readings, self.held) + noise + self._drifted
        readings = readings + self.hum * math.sin(2 * math.pi * self.mains * t + 1.0)
        if self.radio and self.radio_noise:
            readings = readings + self._chance.normal(0.0, self.radio_noise, 2)
        left, right = readings.tolist()
        return self._code(0, left), self._code(1, right)

    def _code(self, place: int, counts: float) -> int:
        wire = self.wires[place]
        if wire == "open":
            return int(self._chance.integers(FULL_SCALE + 1))
        if wire == "short" or math.isnan(counts):
            return 0
        if self.sticky:
            counts = self._stick(counts + self._chance.normal(0.0, _STICKY_NOISE))
        if wire != "stuck":
            return self._clamped(counts)
        if math.isnan(self._stuck[place]):
            self._stuck[place] = self._clamped(counts)
        return self._clamped(self._stuck[place] + self._chance.integers(-1, 2))

    def _clamped(self, counts: float) -> int:
        return min(max(round(counts), 0), int(self.plateau))

    def _stick(self, counts: float) -> float:
        if self._chance.random() >= _STICKY_SHARE:
            return counts
        return 4 * round((counts - _STICKY_CODE) / 4) + _STICKY_CODE
