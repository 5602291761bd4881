"""What to do when stuck: back off, turn to one side, and to the other if that fails.

The first turn goes away from the side that was touched more while walking. If the robot is stuck
again soon after, it turns the other way and twice as far, so that it now points as far to that side
of its first course as it had pointed to this one. Alternating like this, it searches both sides and
never turns round.
"""

from __future__ import annotations

import numpy as np

from antennate.anatomy import LEFT, RIGHT
from antennate.params import EscapeParams
from antennate.records import Bools, Floats, Ints, Maneuver


class Escape:
    """The state of one escape per row: what it does, until when, and which way it turned last."""

    def __init__(self, params: EscapeParams, batch: int, period: float) -> None:
        self._params = params
        self._memory_gain = period / params.memory_time
        self.maneuver: Ints = np.full(batch, int(Maneuver.FORWARD))
        self._until: Floats = np.zeros(batch)
        self._ended: Floats = np.full(batch, -np.inf)
        self._right: Bools = np.zeros(batch, dtype=bool)
        self._again: Bools = np.zeros(batch, dtype=bool)
        self.touch: Floats = np.zeros((batch, 2))

    def reset(self, rows: Ints | Bools) -> None:
        """Some rows begin anew, walking, with no memory."""
        self.maneuver[rows] = Maneuver.FORWARD
        self._ended[rows] = -np.inf
        self.touch[rows] = 0.0

    def step(self, t: Floats, b: Floats, stuck: Bools) -> Ints:
        """The maneuver of every row.

        Args:
            t: Time [s], shape (B,).
            b: Bending levels, shape (B, 2); a row with NaN answers HOLD and keeps its state.
            stuck: Rows found stuck, shape (B,).

        Returns:
            One `Maneuver` a row, shape (B,).
        """
        known = ~np.isnan(b).any(axis=1)
        walking = known & (self.maneuver == Maneuver.FORWARD)
        self.touch += np.where(walking[:, None], b - self.touch, 0.0) * self._memory_gain
        over = known & ~walking & (t >= self._until)
        backed = over & (self.maneuver == Maneuver.REVERSE)
        self._to(over & ~backed, int(Maneuver.FORWARD), t)
        turn = np.where(self._right, int(Maneuver.TURN_R), int(Maneuver.TURN_L))
        length = self._params.turn_time * np.where(self._again, 2.0, 1.0)
        self._to(backed, turn, t + length)
        self._ended = np.where(backed, t + length, self._ended)
        self._begin(walking & stuck, t)
        return np.where(known, self.maneuver, int(Maneuver.HOLD))

    def _to(self, rows: Bools, maneuver: Ints | int, until: Floats) -> None:
        self.maneuver = np.where(rows, maneuver, self.maneuver)
        self._until = np.where(rows, until, self._until)

    def _begin(self, rows: Bools, t: Floats) -> None:
        again = t - self._ended < self._params.retry_time
        away = self.touch[:, LEFT] >= self.touch[:, RIGHT]
        self._right = np.where(rows, np.where(again, ~self._right, away), self._right)
        self._again = np.where(rows, again, self._again)
        self._to(rows, int(Maneuver.REVERSE), t + self._params.reverse_time)
