"""The rate of samples, and whether it is the expected one."""

from __future__ import annotations

import math
from collections import deque


class RateMeter:
    """Measures a rate over a sliding window.

    Args:
        expected: Rate agreed [Hz].
        error: Relative error allowed.
        window: Window [s]; also the time for which the rate must be wrong.

    Attributes:
        rate: Samples per second over the window [Hz], NaN while it fills.
    """

    def __init__(self, expected: float, error: float, window: float) -> None:
        self._low = expected * (1.0 - error)
        self._high = expected * (1.0 + error)
        self._window = window
        self._ticks: deque[tuple[float, int]] = deque()
        self._sum = 0
        self._start = math.nan
        self._right = math.nan
        self.rate = math.nan
        self.wrong = False

    def step(self, now: float, samples: int) -> None:
        """Count the samples that arrived since the tick before, at time now [s]."""
        if math.isnan(self._start):
            self._start = self._right = now
            return
        self._ticks.append((now, samples))
        self._sum += samples
        while self._ticks and self._ticks[0][0] <= now - self._window:
            self._sum -= self._ticks.popleft()[1]
        if now - self._start < self._window:
            self._right = now
            return
        self.rate = self._sum / self._window
        if self._low <= self.rate <= self._high:
            self._right = now
        self.wrong = now - self._right >= self._window
