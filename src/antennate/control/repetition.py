"""Is the robot stuck? It is if its readings repeat from one gait cycle to the next.

A robot that advances touches new things in every cycle, so its readings change. A robot that walks
on the spot gets the same readings in every cycle. The measure is the mean over a
window of |y(t) - y(t - T)|, T the gait period and y the flex of an antenna as a fraction of its
calibrated range (0 straight, 1 fully bent). Where it stays small while an antenna is pressed, the
robot is stuck. In free air it is small too, but nothing is pressed.

Only the antennae and the gait's own phase enter.
"""

from __future__ import annotations

import numpy as np

from antennate.params.control import RepetitionParams
from antennate.types import Bools, Floats, Ints


class RepetitionDetector:
    """Compares every sample with the one a gait cycle before, per row and side."""

    def __init__(
        self, params: RepetitionParams, batch: int, period: float, frequency: float
    ) -> None:
        self._params = params
        cycle = max(1, round(1.0 / (frequency * period)))
        window = max(1, round(params.window_cycles * cycle))
        self._needed = cycle + window
        self._last: Floats = np.zeros((cycle, batch, 2))
        self._change: Floats = np.zeros((window, batch, 2))
        self._press: Floats = np.zeros((window, batch, 2))
        self._ticks = 0
        self._walked: Ints = np.zeros(batch, dtype=np.int64)

    def reset(self, rows: Ints | Bools) -> None:
        """Some rows forget everything."""
        for memory in (self._last, self._change, self._press):
            memory[:, rows] = 0.0
        self._walked[rows] = 0

    def step(self, flex: Floats, walking: Bools) -> Bools:
        """Take one sample and say which rows are stuck.

        Args:
            flex: 0 straight, 1 fully bent, shape (B, 2); NaN counts as straight.
            walking: Rows whose gait runs forward undisturbed, shape (B,).

        Returns:
            Rows that walk, are pressed, and whose readings repeat, shape (B,). Only samples taken
            while walking are compared, so nothing repeats before a cycle and a window are over.
        """
        sample = np.where(np.isnan(flex), 0.0, flex)
        in_cycle, in_window = self._ticks % len(self._last), self._ticks % len(self._change)
        self._change[in_window] = np.abs(sample - self._last[in_cycle])
        self._press[in_window] = np.abs(sample)
        self._last[in_cycle] = sample
        self._ticks += 1
        self._walked = np.where(walking, self._walked + 1, 0)
        ready = self._walked >= self._needed
        if not np.count_nonzero(ready):
            return ready
        pressed = ready & (_largest_mean(self._press) > self._params.pressure)
        if not np.count_nonzero(pressed):  # the other mean costs as much as the rest of a step
            return pressed
        return pressed & (_largest_mean(self._change) < self._params.change)


def _largest_mean(memory: Floats) -> Floats:
    """Mean over the window (ticks, B, 2) of the side where it is larger, shape (B,)."""
    left, right = (np.add.reduce(memory, axis=0) / len(memory)).T
    return np.maximum(left, right)
