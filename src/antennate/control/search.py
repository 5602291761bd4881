"""The search of `closed`: walk with patience, back off when stuck, and look for the way on.

Touch says when: the robot escapes once its readings repeat, though not before `patience`, since an
escape that comes too early repeats itself. Touch says where to: the first turn goes away from the
antenna that stays bent while the robot backs off, when the wall ahead is left behind and only the
walls beside it are felt. And touch says when a search is over: nothing felt for `free_time`, or a
walk of `proof_time` that was not stuck, proves that the robot gets on, and the next jam is a new
one.

Until then turns go to both sides by turns, each farther from the heading in which the robot was
stuck first, and it backs off for longer each time, so that no try repeats another. A turn that goes
far can lead the robot back out of a passage. So where it feels nothing for `lost_time` after one,
it turns round, also when it has got on for long since: until the next jam nothing says where it
looks.

Where a reading cannot be used, it holds, and time stands still.

In a study a simulation may tell it what it knows: the side to turn to, from where it looks; whether
the robot is jammed, in place of readings that repeat and of patience; whether the way ahead is
free, so that it does not back off; or that it faces the entrance, so that it turns round.
"""

from __future__ import annotations

import numpy as np

from antennate.control.knowledge import Kind, Knowledge, right_by, stuck_by
from antennate.control.repetition import RepetitionDetector
from antennate.params.control import ControlParams, SearchParams
from antennate.types import LEFT, RIGHT, Bools, Floats, Ints, Maneuver

_FORWARD, _REVERSE = int(Maneuver.FORWARD), int(Maneuver.REVERSE)
"""As plain integers: comparing an array with an enum costs four times as much."""


class Search:
    """The search of each row.

    Args:
        params: Times and sizes.
        batch: Number of rows B.

    Attributes:
        maneuver: `Maneuver` of each row, shape (B,).
        tries: Turns since the last proof that it gets on, shape (B,).
        knowledge: What a simulation knows of the rows; nothing on a robot.
    """

    def __init__(self, params: SearchParams, batch: int) -> None:
        self._params = params
        self.maneuver: Ints = np.full(batch, _FORWARD)
        self.tries: Ints = np.zeros(batch, dtype=np.int64)
        self._begun: Floats = np.full(batch, np.nan)
        self._last: Floats = np.full(batch, np.nan)
        self._until: Floats = np.zeros(batch)
        self._felt: Floats = np.zeros(batch)
        self._lean: Floats = np.zeros(batch)
        self._turned: Floats = np.zeros(batch)
        self._right: Bools = np.zeros(batch, dtype=bool)
        self.knowledge = Knowledge()

    def reset(self, rows: Ints | Bools) -> None:
        """Some rows begin anew, walking, with no memory."""
        self.maneuver[rows] = _FORWARD
        self.tries[rows] = 0
        self._begun[rows] = self._last[rows] = np.nan
        self._turned[rows] = 0.0

    def step(self, t: Floats, flex: Floats, stuck: Bools, pressed: Bools) -> Ints:
        """The maneuver of every row.

        Args:
            t: Time [s], shape (B,).
            flex: 0 straight, 1 fully bent, shape (B, 2); a row with NaN holds and keeps its state.
            stuck: Rows found stuck, shape (B,).
            pressed: Rows with at least one pressed antenna, shape (B,).

        Returns:
            One `Maneuver` a row, shape (B,).
        """
        params, lean = self._params, flex[:, LEFT] - flex[:, RIGHT]
        known = ~np.isnan(lean)
        walking = known & (self.maneuver == _FORWARD)
        self._pause(known, t)
        new = np.isnan(self._begun)
        self._begun = np.where(new, t, self._begun)
        self._felt = np.where(walking & ~pressed & ~new, self._felt, t)
        self._lean += np.where(known & (self.maneuver == _REVERSE), lean, 0.0)
        over = known & ~walking & (t >= self._until)
        if np.count_nonzero(over):
            self._go_on(over, t)
        walked, free = t - self._begun, t - self._felt
        proved = walking & ((free >= params.free_time) | (walked >= params.proof_time))
        self.tries = np.where(proved, 0, self.tries)
        stuck = walking & stuck_by(self.knowledge, stuck & (walked >= params.patience))
        if np.count_nonzero(stuck):
            self._back_off(stuck, t)
        astray = np.abs(self._turned) >= params.lost_turn
        lost = walking & astray & (free > params.lost_time)
        if self.knowledge.facing is not None:
            lost |= walking & ~stuck & self.knowledge.facing & (walked > params.lost_time)
        if np.count_nonzero(lost):
            self._return(lost, t)
        return np.where(known, self.maneuver, int(Maneuver.HOLD))

    def _pause(self, known: Bools, t: Floats) -> None:
        """Move the times of rows that hold by the time for which they have held."""
        held = np.where(known | np.isnan(self._last), 0.0, t - self._last)
        self._begun += held
        self._until += held
        self._last = t.copy()

    def _go_on(self, over: Bools, t: Floats) -> None:
        """Turn after backing off, and walk after a turn."""
        backed = over & (self.maneuver == _REVERSE)
        turned = over & ~backed
        self.maneuver = np.where(turned, _FORWARD, self.maneuver)
        self._begun = np.where(turned, t, self._begun)
        if np.count_nonzero(backed):
            self._turn(backed, t)

    def _back_off(self, rows: Bools, t: Floats) -> None:
        params = self._params
        self._turned = np.where(rows & (self.tries == 0), 0.0, self._turned)
        self._lean = np.where(rows, 0.0, self._lean)
        time = np.minimum(params.reverse_time * params.growth**self.tries, params.reverse_most)
        self.maneuver = np.where(rows, _REVERSE, self.maneuver)
        self._until = np.where(rows, t + time, self._until)

    def _turn(self, rows: Bools, t: Floats) -> None:
        """Turn to the next heading; each is farther from the first one than the last."""
        params = self._params
        right = np.where(self.tries == 0, self._lean >= 0.0, ~self._right)
        self._right = np.where(rows, right_by(self.knowledge.side, right), self._right)
        size = np.minimum(params.turn_time * params.growth**self.tries, params.return_time)
        turn = np.where(self._right, size, -size) - self._turned
        side = self.knowledge.side
        if side is not None:
            turn = np.where(side == 0, turn, -np.sign(side) * params.turn_time)
        self._turn_by(rows, turn, t)
        self._turned += np.where(rows, turn, 0.0)
        self.tries = self.tries + rows

    def _return(self, rows: Bools, t: Floats) -> None:
        """Turn back, opposite to the last turn, and begin the search anew."""
        time = self._params.return_time
        self._turn_by(rows, np.where(self._right, -time, time), t)
        self._turned = np.where(rows, 0.0, self._turned)
        self.tries = np.where(rows, 0, self.tries)

    def _turn_by(self, rows: Bools, turn: Floats, t: Floats) -> None:
        """Turn for a time [s], to the right if it is positive."""
        side = np.where(turn > 0.0, int(Maneuver.TURN_R), int(Maneuver.TURN_L))
        self.maneuver = np.where(rows, side, self.maneuver)
        self._until = np.where(rows, t + np.abs(turn), self._until)


class SearchRule:
    """FORWARD until readings repeat; then the search."""

    knows: tuple[Kind, ...] = ("side", "jam", "facing", "free")
    needs: tuple[Kind, ...] = ()

    def __init__(self, control: ControlParams, batch: int) -> None:
        self.turn_offset = control.escape.turn_offset
        self._pressure = control.repetition.pressure
        self._detector = RepetitionDetector(
            control.repetition, batch, control.period, control.gait.frequency
        )
        self._search = Search(control.search, batch)

    def reset(self, rows: Ints | Bools) -> None:
        """Forget everything about some rows."""
        self._detector.reset(rows)
        self._search.reset(rows)

    def know(self, knowledge: Knowledge) -> None:
        """Take what a simulation knows, for the search."""
        self._search.knowledge = knowledge

    def step(self, t: Floats, level: Floats, contact: Ints, flex: Floats) -> Ints:
        """As of a `Rule`."""
        unknown = np.isnan(flex[:, LEFT] + flex[:, RIGHT])
        walking = (self._search.maneuver == _FORWARD) & ~unknown
        left, right = (flex > self._pressure).T
        return self._search.step(t, flex, self._detector.step(flex, walking), left | right)
