"""Is the robot stuck? A reading that repeats itself from one gait cycle to the next says so.

A walking robot that gets on meets something new in every cycle, so its antennae read something new.
A robot that walks on the spot feels the same cycle again and again. The measure is the mean over a
cycle of |y(t) - y(t - T)|, T the gait period and y the deflection of an antenna (0 straight, 1
fully bent). Where it stays small while an antenna is pressed, the robot is stuck. In free air it is
small too, but nothing is pressed.

Only the antennae and the gait's own phase enter.
"""

from __future__ import annotations

import numpy as np

from antennate.params import RepetitionParams
from antennate.records import Bools, Floats, Ints


class RepetitionDetector:
    """Compares every sample with the one a gait cycle before, per row and side."""

    def __init__(
        self, params: RepetitionParams, batch: int, period: float, frequency: float
    ) -> None:
        self._params = params
        self._length = max(1, round(1.0 / (frequency * period)))
        self._cycle: Floats = np.zeros((self._length, batch, 2))
        self._next = 0
        self._gain = 1.0 / (params.averaging_cycles * self._length)
        self._walked: Ints = np.zeros(batch, dtype=np.int64)
        self.change: Floats = np.ones((batch, 2))
        self.pressure: Floats = np.zeros((batch, 2))

    def reset(self, rows: Ints | Bools) -> None:
        """Some rows forget everything."""
        self._cycle[:, rows] = 0.0
        self.pressure[rows] = 0.0
        self._restart(rows)

    def _restart(self, rows: Ints | Bools) -> None:
        """Some rows begin to walk: nothing has repeated yet."""
        self._walked[rows] = 0
        self.change[rows] = 1.0

    def step(self, deflection: Floats, walking: Bools) -> Bools:
        """Take one sample and say which rows are stuck.

        Args:
            deflection: 0 straight, 1 fully bent, shape (B, 2); NaN counts as straight.
            walking: Rows whose gait runs forward undisturbed, shape (B,).

        Returns:
            Rows that walk, are pressed, and whose readings repeat, shape (B,).
        """
        self._restart(~walking)
        sample = np.nan_to_num(deflection)
        before = self._cycle[self._next]
        change = np.abs(sample - before)
        self._cycle[self._next] = sample
        self._next = (self._next + 1) % self._length
        self.change += (change - self.change) * self._gain
        self.pressure += (np.abs(sample) - self.pressure) * self._gain
        self._walked += walking
        return (
            (self._walked > self._params.settling_cycles * self._length)
            & (self.change < self._params.change).all(axis=1)
            & (self.pressure > self._params.pressure).any(axis=1)
        )
