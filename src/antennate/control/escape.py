"""What to do when stuck: back off, turn to one side, and to the other if that fails.

The first turn goes away from the side that was touched more while the robot still walked. Readings
of a robot that is stuck say little about where the passage goes on. If it is stuck again within
`retry_time`, it turns the other way, and farther. Turning to alternate sides searches both.

A wrong turn can lead the robot back out of a passage, where its antennae touch no wall. So a robot
that has turned and then touches nothing for `lost_time` turns round, back towards the walls.

In a study a simulation may tell it what it knows: the side to turn to, whether the robot is jammed
(in place of the rule that calls it stuck), whether it faces the entrance (then it turns round),
whether the way ahead is free (then it does not escape), or the angle by which to turn.
"""

from __future__ import annotations

import numpy as np

from antennate.control.knowledge import KNOWABLE, Knowledge, aligned, right_by, stuck_by
from antennate.params.control import EscapeParams
from antennate.types import LEFT, RIGHT, Bools, Floats, Ints, Maneuver


class Escape:
    """The escape of each row: its maneuver, when that ends, and the side of the last turn.

    Attributes:
        params: Its numbers.
        knowledge: What a simulation knows of the rows; nothing on a robot.
    """

    knows = KNOWABLE

    def __init__(self, params: EscapeParams, batch: int, period: float) -> None:
        self.params = params
        self._memory_gain = period / params.memory_time
        self.maneuver: Ints = np.full(batch, int(Maneuver.FORWARD))
        self._until: Floats = np.zeros(batch)
        self._ended: Floats = np.full(batch, -np.inf)
        self._right: Bools = np.zeros(batch, dtype=bool)
        self._again: Bools = np.zeros(batch, dtype=bool)
        self._turned: Bools = np.zeros(batch, dtype=bool)
        self._felt: Floats = np.zeros(batch)
        delay = max(1, round(params.memory_delay / period))
        self._past: Floats = np.zeros((delay, batch, 2))
        self._ticks = 0
        self.touch: Floats = np.zeros((batch, 2))
        self.knowledge = Knowledge()

    def reset(self, rows: Ints | Bools) -> None:
        """Some rows begin anew, walking, with no memory."""
        self.maneuver[rows] = Maneuver.FORWARD
        self._ended[rows] = -np.inf
        self._until[rows] = 0.0
        self._right[rows] = self._turned[rows] = False
        self._past[:, rows] = 0.0
        self.touch[rows] = 0.0

    def step(self, t: Floats, level: Floats, stuck: Bools, pressed: Bools) -> Ints:
        """The maneuver of every row.

        Args:
            t: Time [s], shape (B,).
            level: Bending levels, shape (B, 2); a row with NaN holds and keeps its state.
            stuck: Rows found stuck, shape (B,).
            pressed: Rows with at least one pressed antenna, shape (B,).

        Returns:
            One `Maneuver` a row, shape (B,).
        """
        known = ~np.isnan(level[:, LEFT] + level[:, RIGHT])
        walking = known & (self.maneuver == int(Maneuver.FORWARD))
        self.touch += np.where(walking[:, None], level - self.touch, 0.0) * self._memory_gain
        before = self._remember()
        self._felt = np.where(walking & ~pressed, self._felt, t)
        over = known & ~walking & ((t >= self._until) | self._aligned())
        if np.count_nonzero(over):
            backed = over & (self.maneuver == int(Maneuver.REVERSE))
            self._to(over & ~backed, int(Maneuver.FORWARD), t)
            self._turn(backed, t)
        stuck = walking & stuck_by(self.knowledge, stuck)
        if np.count_nonzero(stuck):
            self._back_off(stuck, before, t)
        lost = walking & self._turned & (t - self._felt > self.params.lost_time)
        if self.knowledge.facing is not None:
            walked = t - self._until > self.params.lost_time
            lost = lost | (walking & ~stuck & self.knowledge.facing & walked)
        if np.count_nonzero(lost):
            self._return(lost, t)
        return np.where(known, self.maneuver, int(Maneuver.HOLD))

    def _to(self, rows: Bools, maneuver: Ints | int, until: Floats) -> None:
        self.maneuver = np.where(rows, maneuver, self.maneuver)
        self._until = np.where(rows, until, self._until)

    def _remember(self) -> Floats:
        """Store the mean touch; return that of `memory_delay` ago, the present one at the start."""
        at = self._ticks % len(self._past)
        self._ticks += 1
        before = self._past[at].copy()
        self._past[at] = self.touch
        return np.where((before == 0.0).all(axis=1, keepdims=True), self.touch, before)

    def _back_off(self, rows: Bools, touch: Floats, t: Floats) -> None:
        params = self.params
        again = (t - self._ended < params.retry_time) & params.alternate
        away = touch[:, LEFT] >= touch[:, RIGHT]
        if params.first_turn == "right":
            away = np.ones_like(away)
        self._right = np.where(rows, np.where(again, ~self._right, away), self._right)
        self._again = np.where(rows, again, self._again)
        self._to(rows, int(Maneuver.REVERSE), t + params.reverse_time)

    def _turn(self, rows: Bools, t: Floats) -> None:
        params = self.params
        until = t + params.turn_time * np.where(self._again, params.second_turn, 1.0)
        if self.knowledge.map is not None:
            until = t + params.return_time
        self._right = np.where(rows, self._known_side(self._right), self._right)
        self._to(rows, _turn_to(self._right), until)
        self._ended = np.where(rows, until, self._ended)
        self._turned |= rows

    def _return(self, rows: Bools, t: Floats) -> None:
        """Turn back, opposite to the last turn, and forget that turn."""
        right = self._known_side(~self._right)
        self._to(rows, _turn_to(right), t + self.params.return_time)
        self._ended = np.where(rows, -np.inf, self._ended)
        self._turned &= ~rows

    def _known_side(self, right: Bools) -> Bools:
        """Whether to turn right: as is known, else as given."""
        known = self.knowledge
        return right_by(known.side if known.map is None else known.map, right)

    def _aligned(self) -> Bools:
        """Rows that turn, and have turned far enough by what is known."""
        if self.knowledge.map is None:
            return np.zeros(len(self.maneuver), dtype=bool)
        return aligned(self.maneuver, self.knowledge.map)


def _turn_to(right: Bools) -> Ints:
    return np.where(right, int(Maneuver.TURN_R), int(Maneuver.TURN_L))
