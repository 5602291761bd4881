"""Noise of a flex sensor's readings: how large it is, and whether it is a hum.

A hum is a sine far faster than an antenna bends. Any sine y satisfies y[n] + y[n-2] = c y[n-1]
with c = 2 cos(2 pi f / rate), so c is fitted to ten readings, and what it leaves says how much of
them is one sine (Prony's method). Sampling hides the true frequency: f, rate - f and so on give the
same readings, which is what the words say.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

_REST = 0.01
"""Share of the energy that a hum leaves; white noise leaves less once in 30,000 (computed)."""
_SLOWEST = 0.25
"""Slowest hum [samples^-1]: 25 Hz at 100 Hz. Antennae ring at 2.4 Hz and bend fully in 30 ms."""
_SAME = 0.025
"""Frequencies nearer than this to half the rate are written as one [samples^-1]; ten readings, some
from before the hum, tell no finer."""
_WINDOW = 10
"""Readings of a window."""


@dataclass(frozen=True, slots=True)
class Noise:
    """Noise of some readings.

    Attributes:
        size: Half of what lies between the lowest and the highest [counts].
        frequency: Of a hum [samples^-1], 0.25 to 0.5; NaN if it is none.
    """

    size: float
    frequency: float = math.nan

    @property
    def hums(self) -> bool:
        """Whether it is one sine."""
        return math.isfinite(self.frequency)

    def text(self, rate: float) -> str:
        """Size and frequency in words, at so many samples a second [Hz]."""
        size = f"±{self.size:.0f} counts"
        if not self.hums:
            return f"{size} of no one frequency"
        slow, fast = self.frequency * rate, (1.0 - self.frequency) * rate
        if fast - slow < 2.0 * _SAME * rate:
            return f"{size} at {0.5 * rate:.0f} Hz or an alias of it"
        return f"{size} at {slow:.0f} or {fast:.0f} Hz or an alias of them"


def noise_of(readings: Sequence[float]) -> Noise:
    """Noise of ten readings in a row [counts], which are finite."""
    y = np.array(readings)
    size = 0.5 * float(np.ptp(y))
    outer, middle = y[2:] + y[:-2], y[1:-1]
    outer, middle = outer - outer.mean(), middle - middle.mean()
    energy = float(middle @ middle)
    if energy == 0.0:
        return Noise(size)
    c = float(outer @ middle) / energy
    rest = outer - c * middle
    y = y - y.mean()
    whole = float(y[2:] @ y[2:] + y[:-2] @ y[:-2]) + c * c * energy
    frequency = math.acos(min(max(0.5 * c, -1.0), 1.0)) / (2.0 * math.pi)
    half = len(y) // 2
    steady = min(float(np.ptp(y[:half])), float(np.ptp(y[half:]))) > size
    hums = steady and float(rest @ rest) < _REST * whole and frequency > _SLOWEST
    return Noise(size, frequency if hums else math.nan)


def usual_noise(readings: Sequence[float]) -> Noise:
    """Noise of many readings at rest: of a hum if most windows have one, else of them all."""
    starts = range(0, len(readings) - _WINDOW + 1, _WINDOW)
    parts = [noise_of(readings[start : start + _WINDOW]) for start in starts]
    humming = [part for part in parts if part.hums]
    if parts and 2 * len(humming) > len(parts):
        return Noise(
            max(part.size for part in humming),
            float(np.median([part.frequency for part in humming])),
        )
    return Noise(0.5 * float(np.ptp(readings)) if readings else 0.0)
