"""What to do when stuck: back off and turn, as `closed-1` does, or search, as `closed` does.

`Escape`: the first turn goes away from the side that was touched more while the robot still walked.
Readings of a robot that is stuck say little about where the passage goes on. If it is stuck again
within `retry_time`, it turns the other way, and farther. Turning to alternate sides searches both.
A wrong turn can lead the robot back out of a passage, where its antennae touch no wall. So a robot
that has turned and then touches nothing for `lost_time` turns round, back towards the walls.

`Search`: touch says when: the robot escapes once its readings repeat, though not before `patience`,
since an escape that comes too early repeats itself. Touch says where to: the first turn goes away
from the antenna that stays bent while the robot backs off, when the wall ahead is left behind and
only the walls beside it are felt. And touch says when a search is over: nothing felt for
`free_time`, or a walk of `proof_time` that was not stuck, proves that the robot gets on, and the
next jam is a new one. Until then turns go to both sides by turns, each farther from the heading in
which the robot was stuck first, and it backs off for longer each time, so that no try repeats
another. Where it feels nothing for `lost_time` after a turn that goes far, it turns round, also
when it has got on for long since: until the next jam nothing says where it looks. Where a reading
cannot be used, it holds, and time stands still.

In a study a simulation may tell both what it knows: the side to turn to, whether the robot is
jammed (in place of the rule that calls it stuck), whether it faces the entrance (then it turns
round), whether the way ahead is free (then it does not escape), or the angle by which to turn.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from antennate.control.conditioning import RepetitionDetector
from antennate.control.knowledge import Kind, Knowledge, aligned, right_by, stuck_by
from antennate.params.control import ControlParams, EscapeParams, SearchParams
from antennate.types import LEFT, RIGHT, Bools, Floats, Ints, Maneuver


class Escape:
    """The escape of each row: its maneuver, when that ends, and the side of the last turn.

    Attributes:
        params: Its numbers.
        knowledge: What a simulation knows of the rows; nothing on a robot.
    """

    knows: tuple[Kind, ...] = ("side", "jam", "facing", "free", "map")

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
        """Start rows anew, walking, with no memory."""
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


_FORWARD, _REVERSE = int(Maneuver.FORWARD), int(Maneuver.REVERSE)
"""As plain integers: comparing an array with an enum costs four times as much."""


class Sizes(NamedTuple):
    """Times and sizes of a search that are not those of `SearchParams`, by the same names."""

    patience: float
    reverse_time: float
    reverse_most: float
    turn_time: float
    growth: float
    free_time: float
    proof_time: float
    lost_turn: float
    lost_time: float
    return_time: float


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

    def __init__(self, params: SearchParams | Sizes, batch: int) -> None:
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
        """Start rows anew, walking, with no memory."""
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
        backing = known & (self.maneuver == _REVERSE)
        if np.count_nonzero(backing):
            self._lean += np.where(backing, lean, 0.0)
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
        if np.count_nonzero(known) < len(known):
            pause = np.where(known | np.isnan(self._last), 0.0, t - self._last)
            self._begun += pause
            self._until += pause
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
    """FORWARD until readings repeat; then the search.

    Args:
        control: All numbers of the control.
        batch: Number of rows B.
        sizes: Times and sizes in place of those of `control.search`.
    """

    knows: tuple[Kind, ...] = ("side", "jam", "facing", "free")
    needs: tuple[Kind, ...] = ()

    def __init__(self, control: ControlParams, batch: int, sizes: Sizes | None = None) -> None:
        self.turn_offset = control.escape.turn_offset
        self._pressure = control.repetition.pressure
        self._detector = RepetitionDetector(
            control.repetition, batch, control.period, control.gait.frequency
        )
        self._search = Search(sizes or control.search, batch)

    def reset(self, rows: Ints | Bools) -> None:
        """Forget everything about some rows."""
        self._detector.reset(rows)
        self._search.reset(rows)

    def know(self, knowledge: Knowledge) -> None:
        """Take what a simulation knows, for the search."""
        self._search.knowledge = knowledge

    def step(self, t: Floats, level: Floats, contact: Ints, flex: Floats) -> Ints:
        """Maneuvers of this tick: FORWARD until readings repeat, then those of the search."""
        unknown = np.isnan(flex[:, LEFT] + flex[:, RIGHT])
        walking = (self._search.maneuver == _FORWARD) & ~unknown
        left, right = (flex > self._pressure).T
        return self._search.step(t, flex, self._detector.step(flex, walking), left | right)
