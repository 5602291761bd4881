"""The search of `closed`: walk with patience, back off when stuck, and look for the way on.

Turns are counted from the heading in which the robot got stuck first. They go to both sides in
turn, each farther than the last, and the robot backs off for longer each time, so that no try
repeats another. What it feels while it walks ends the search: nothing for `free_time`, or a walk of
`proof_time` that was not stuck, proves that the robot gets on. The next jam is then a new one.

The robot looks at its readings only after `patience`, since it needs a while to get away from where
it was, and an escape that comes too early repeats itself.
"""

from __future__ import annotations

import numpy as np

from antennate.control.repetition import RepetitionDetector
from antennate.params.control import ControlParams, SearchParams
from antennate.robots.sides import LEFT, RIGHT
from antennate.types import Bools, Floats, Ints, Maneuver

_FORWARD, _REVERSE = int(Maneuver.FORWARD), int(Maneuver.REVERSE)
"""As plain integers: comparing an array with an enum costs four times as much."""


class Search:
    """The search of each row.

    Attributes:
        maneuver: `Maneuver` of each row, shape (B,).
        touch: Mean bending levels while walking, shape (B, 2).
        tries: Turns since the last proof of getting on, shape (B,).
    """

    def __init__(self, params: SearchParams, batch: int, period: float) -> None:
        self._params = params
        self._gain = period / params.memory_time
        self.maneuver: Ints = np.full(batch, _FORWARD)
        self.touch: Floats = np.zeros((batch, 2))
        self.tries: Ints = np.zeros(batch, dtype=np.int64)
        self._begun: Floats = np.full(batch, np.nan)
        self._until: Floats = np.zeros(batch)
        self._felt: Floats = np.zeros(batch)
        self._right: Bools = np.zeros(batch, dtype=bool)
        self._turned: Floats = np.zeros(batch)
        self._searching: Bools = np.zeros(batch, dtype=bool)

    def reset(self, rows: Ints | Bools) -> None:
        """Some rows begin anew, walking, with no memory."""
        self.maneuver[rows] = _FORWARD
        self.touch[rows] = 0.0
        self.tries[rows] = 0
        self._begun[rows] = np.nan
        self._turned[rows] = 0.0
        self._searching[rows] = False

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
        params = self._params
        known = ~np.isnan(level[:, LEFT] + level[:, RIGHT])
        walking = known & (self.maneuver == _FORWARD)
        self.touch += np.where(walking[:, None], level - self.touch, 0.0) * self._gain
        self._felt = np.where(walking & ~pressed, self._felt, t)
        self._begun = np.where(np.isnan(self._begun), t, self._begun)
        over = known & ~walking & (t >= self._until)
        if np.count_nonzero(over):
            backed = over & (self.maneuver == _REVERSE)
            self._walk(over & ~backed, t)
            self._turn(backed, t)
        walked, free = t - self._begun, t - self._felt
        proved = walking & ((free >= params.free_time) | (walked >= params.proof_time))
        self.tries = np.where(proved, 0, self.tries)
        stuck = walking & stuck & (walked >= params.patience)
        if np.count_nonzero(stuck):
            self._back_off(stuck, t)
        lost = walking & self._searching & (free > params.lost_time)
        if np.count_nonzero(lost):
            self._return(lost, t)
        return np.where(known, self.maneuver, int(Maneuver.HOLD))

    def _walk(self, rows: Bools, t: Floats) -> None:
        self.maneuver = np.where(rows, _FORWARD, self.maneuver)
        self._begun = np.where(rows, t, self._begun)

    def _back_off(self, rows: Bools, t: Floats) -> None:
        """Back off, and choose the side to turn to then."""
        params, first = self._params, rows & (self.tries == 0)
        away = self.touch[:, LEFT] >= self.touch[:, RIGHT]
        self._right = np.where(rows, np.where(first, away, ~self._right), self._right)
        self._turned = np.where(first, 0.0, self._turned)
        time = np.minimum(params.reverse_time * params.growth**self.tries, params.reverse_most)
        self.maneuver = np.where(rows, _REVERSE, self.maneuver)
        self._until = np.where(rows, t + time, self._until)

    def _turn(self, rows: Bools, t: Floats) -> None:
        """Turn to the next heading; each is farther from the first one than the last."""
        params = self._params
        size = np.minimum(params.turn_time * params.growth**self.tries, params.return_time)
        turn = np.where(self._right, size, -size) - self._turned
        self._turn_by(rows, turn, t)
        self._turned += np.where(rows, turn, 0.0)
        self.tries += rows
        self._searching |= rows

    def _return(self, rows: Bools, t: Floats) -> None:
        """Turn back, opposite to the last turn, and begin the search anew."""
        time = self._params.return_time
        self._turn_by(rows, np.where(self._right, -time, time), t)
        self._searching &= ~rows
        self.tries = np.where(rows, 0, self.tries)

    def _turn_by(self, rows: Bools, turn: Floats, t: Floats) -> None:
        """Turn for a time [s], to the right if it is positive."""
        side = np.where(turn > 0, int(Maneuver.TURN_R), int(Maneuver.TURN_L))
        self.maneuver = np.where(rows, side, self.maneuver)
        self._until = np.where(rows, t + np.abs(turn), self._until)


class SearchRule:
    """FORWARD until readings repeat; then the search."""

    def __init__(self, control: ControlParams, batch: int) -> None:
        self.turn_offset = control.escape.turn_offset
        self._pressure = control.repetition.pressure
        self._detector = RepetitionDetector(
            control.repetition, batch, control.period, control.gait.frequency
        )
        self._search = Search(control.search, batch, control.period)

    def reset(self, rows: Ints | Bools) -> None:
        """Forget everything about some rows."""
        self._detector.reset(rows)
        self._search.reset(rows)

    def step(self, t: Floats, level: Floats, contact: Ints, flex: Floats) -> Ints:
        """As of a `Rule`."""
        unknown = np.isnan(level[:, LEFT] + level[:, RIGHT])
        walking = (self._search.maneuver == _FORWARD) & ~unknown
        left, right = (flex > self._pressure).T
        return self._search.step(t, level, self._detector.step(flex, walking), left | right)
