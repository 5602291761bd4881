"""Controllers that feel nothing: what an escape is worth without touch.

Whoever claims that touch helps has to beat them: they back off and turn, too, but by the clock or
by chance. All walk, back off and turn, again and again; the rules differ in the times:

- `timed` walks for a time, then makes the escape of `closed-1` as if nothing had touched before, to
  the right and left alternately;
- `schedule` turns right and left alternately, farther and farther from its first heading;
- `zigzag` turns right and left alternately, always by the same angle;
- `random` walks, backs off and turns for random times, to random sides.

A reading that cannot be used still means HOLD. While it holds, the time of a maneuver stands still
(in `timed` that of walking).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable

import numpy as np

from antennate.control.escape import Escape
from antennate.control.kind import ControllerKind
from antennate.control.knowledge import Knowledge
from antennate.control.rule_controller import RuleController
from antennate.params.control import (
    ControlParams,
    EscapeParams,
    RandomParams,
    ScheduleParams,
    ZigzagParams,
)
from antennate.robots.spec import RobotSpec
from antennate.types import Bools, Contact, Floats, Ints, Maneuver

Plan = Callable[[Ints, Ints], tuple[Floats, Floats, Floats]]
"""Takes rows and the numbers of their rounds, from 0, both (n,); times to walk, to back off and to
turn in that round [s], each (n,), a turn to the right positive."""


_BLIND_ESCAPE = ("reverse_time", "turn_time", "alternate", "second_turn")
"""What an escape depends on where nothing was touched before."""
_KNOWING_ESCAPE = ("lost_time", "return_time")
"""What else it depends on where a simulation tells it a map, or that it faces the entrance."""


class TimedRule:
    """Walks for a time, then the escape of `closed-1` with nothing touched, again and again.

    Each turn but the first goes the other way, however long it walks between them.
    """

    knows = Escape.knows

    def __init__(self, control: ControlParams, batch: int) -> None:
        self.turn_offset = control.escape.turn_offset
        self._ticks = max(1, round(control.timed.walk_time / control.period))
        self._escape_params, self._told = control.escape, False
        self._escape = Escape(self._read(_BLIND_ESCAPE), batch, control.period)
        self._walked: Ints = np.zeros(batch, dtype=np.int64)

    def reset(self, rows: Ints | Bools) -> None:
        """Start rows anew, walking."""
        self._escape.reset(rows)
        self._walked[rows] = 0

    def know(self, knowledge: Knowledge) -> None:
        """Take what a simulation knows, for the escape."""
        self._escape.knowledge = knowledge
        if not self._told and (knowledge.facing is not None or knowledge.map is not None):
            self._escape.params = self._read((*_BLIND_ESCAPE, *_KNOWING_ESCAPE))
            self._told = True

    def _read(self, names: Iterable[str]) -> EscapeParams:
        """An escape with some numbers of the control, whose turns always alternate."""
        read = EscapeParams(**{name: getattr(self._escape_params, name) for name in names})
        return read.model_copy(update={"retry_time": math.inf})

    def step(self, t: Floats, level: Floats, contact: Ints, flex: Floats) -> Ints:
        """Maneuvers of this tick; a row whose readings cannot be used holds."""
        known = _known(contact)
        walking = known & (self._escape.maneuver == int(Maneuver.FORWARD))
        stuck = walking & (self._walked >= self._ticks)
        nothing = np.where(known[:, None], np.zeros_like(level), np.nan)
        # pressed, so that `Escape` never looks for walls which it has lost
        maneuver = self._escape.step(t, nothing, stuck, np.ones_like(known))
        walks = maneuver == int(Maneuver.FORWARD)
        self._walked = np.where(known, np.where(walks, self._walked + 1, 0), self._walked)
        return maneuver


class RoundRule:
    """Rounds of walking, backing off and turning, of the times that a plan says.

    Args:
        plan: The times of a round.
        control: All numbers of the control.
        batch: Number of robots B.
    """

    def __init__(self, plan: Plan, control: ControlParams, batch: int) -> None:
        self.turn_offset = control.escape.turn_offset
        self._plan, self._period = plan, control.period
        self._every: Ints = np.arange(batch)
        self._left: Ints = np.zeros((3, batch), dtype=np.int64)
        """Ticks left to walk, to back off and to turn."""
        self._turn: Ints = np.full(batch, int(Maneuver.TURN_R))
        self._rounds: Ints = np.zeros(batch, dtype=np.int64)

    def reset(self, rows: Ints | Bools) -> None:
        """Start rows anew with their first round."""
        self._left[:, rows] = 0
        self._rounds[rows] = 0

    def step(self, t: Floats, level: Floats, contact: Ints, flex: Floats) -> Ints:
        """Maneuvers of this tick, by the plan; a row whose readings cannot be used holds."""
        known = _known(contact)
        over = np.flatnonzero(known & ~self._left.any(axis=0))
        if len(over):
            self._begin(over)
        stage = np.argmax(self._left > 0, axis=0)
        self._left[stage, self._every] -= known
        backing = np.where(stage == 1, int(Maneuver.REVERSE), self._turn)
        maneuver = np.where(stage == 0, int(Maneuver.FORWARD), backing)
        return np.where(known, maneuver, int(Maneuver.HOLD))

    def _begin(self, rows: Ints) -> None:
        """Begin the next round of some rows; it walks for a tick at least."""
        walk, reverse, turn = self._plan(rows, self._rounds[rows])
        self._rounds[rows] += 1
        ticks = np.rint(np.array([walk, reverse, np.abs(turn)]) / self._period).astype(np.int64)
        ticks[0] = np.maximum(ticks[0], 1)
        self._left[:, rows] = ticks
        self._turn[rows] = np.where(turn > 0, int(Maneuver.TURN_R), int(Maneuver.TURN_L))


def _known(contact: Ints) -> Bools:
    return (contact != int(Contact.UNKNOWN)).all(axis=1)


def scheduled(params: ScheduleParams) -> Plan:
    """Right and left by turns, farther and farther from the first heading.

    After the last heading the schedule begins anew from the heading of that time.
    """
    signs = np.where(np.arange(len(params.headings)) % 2 == 0, 1.0, -1.0)
    headings = np.array(params.headings) * signs
    turns = np.diff(headings, prepend=0.0) / params.turn_rate
    backing = np.array(params.reverse_times)

    def plan(rows: Ints, number: Ints) -> tuple[Floats, Floats, Floats]:
        place = number % len(turns)
        reverse = backing[np.minimum(place, len(backing) - 1)]
        return np.full(len(rows), params.walk_time), reverse, turns[place]

    return plan


def zigzagging(params: ZigzagParams) -> Plan:
    """Right and left by turns, always by as much; the first turn is half of one."""

    def plan(rows: Ints, number: Ints) -> tuple[Floats, Floats, Floats]:
        turn = params.turn_time * np.where(number % 2 == 0, 1.0, -1.0)
        turn = np.where(number == 0, 0.5 * turn, turn)
        walk, reverse = (
            np.full(len(rows), time) for time in (params.walk_time, params.reverse_time)
        )
        return walk, reverse, turn

    return plan


class Chance:
    """The plan of `random`: a generator for each row, from the seed and its phase at the start."""

    def __init__(self, params: RandomParams, batch: int) -> None:
        self._params = params
        self._generators = [self._generator(0.0)] * batch

    def _generator(self, phase: float) -> np.random.Generator:
        bits = np.float64(phase + 0.0).view(np.uint64)
        return np.random.default_rng([self._params.seed, int(bits)])

    def reset(self, row: int, phase: float) -> None:
        """A row begins anew at a gait phase [rad]."""
        self._generators[row] = self._generator(phase)

    def __call__(self, rows: Ints, number: Ints) -> tuple[Floats, Floats, Floats]:
        """Times to walk, to back off and to turn, drawn for these rows [s]."""
        params = self._params
        drawn = [
            (g.exponential(), *g.uniform(size=2)) for g in map(self._generators.__getitem__, rows)
        ]
        walk, reverse, turn = np.array(drawn).T
        turn = params.turn_time * (2.0 * turn - 1.0)
        return params.walk_time * walk, 2.0 * params.reverse_time * reverse, turn


class RandomController(RuleController):
    """`random`: the same seed and gait phase at the start give the same choices.

    Args:
        control: All numbers of the control.
        robot: The robot.
        batch: Number of robots B.
    """

    def __init__(self, control: ControlParams, robot: RobotSpec, batch: int) -> None:
        self._chance = Chance(control.random, batch)
        super().__init__(RoundRule(self._chance, control, batch), control, robot, batch)
        self.reset(np.arange(batch))

    def reset(self, rows: Ints | Bools, phase: Floats | float = 0.0) -> None:
        """Begin some rows anew, their gait and their chance at a phase [rad]."""
        super().reset(rows, phase)
        for row in np.arange(len(self.phase))[rows].tolist():
            self._chance.reset(row, float(self.phase[row]))


def timed(control: ControlParams, robot: RobotSpec, batch: int) -> RuleController:
    """`timed`: walks for a time, then escapes as `closed-1` does."""
    return RuleController(TimedRule(control, batch), control, robot, batch)


def schedule(control: ControlParams, robot: RobotSpec, batch: int) -> RuleController:
    """`schedule`: turns right and left by turns, farther and farther."""
    return RuleController(
        RoundRule(scheduled(control.schedule), control, batch), control, robot, batch
    )


def zigzag(control: ControlParams, robot: RobotSpec, batch: int) -> RuleController:
    """`zigzag`: turns right and left by turns, always by as much."""
    return RuleController(
        RoundRule(zigzagging(control.zigzag), control, batch), control, robot, batch
    )


def _timed_reads(control: ControlParams, knows: Collection[str]) -> tuple[str, ...]:
    """Parameters that `timed` reads: no clock where it is told of a jam."""
    names = {"facing": _KNOWING_ESCAPE, "map": _KNOWING_ESCAPE[1:]}
    escape = (
        *_BLIND_ESCAPE,
        "turn_offset",
        *(name for kind in knows for name in names.get(kind, ())),
    )
    clock = () if "jam" in knows else ("timed",)
    return *clock, *(f"escape.{name}" for name in escape)


KINDS = (
    ControllerKind(
        name="timed",
        about="backs off and turns by the clock, whatever it feels",
        make=timed,
        reads=_timed_reads,
        colour="#E69F00",
        line=(0, (6, 1, 1, 1, 1, 1)),
    ),
    ControllerKind(
        name="schedule",
        about="blind: backs off by the clock and turns right and left, farther and farther",
        make=schedule,
        reads=("schedule", "escape.turn_offset"),
        colour="#D55E00",
        line=(0, (5, 1.5)),
    ),
    ControllerKind(
        name="zigzag",
        about="blind: turns right and left by the clock, always by as much",
        make=zigzag,
        reads=("zigzag", "escape.turn_offset"),
        colour="#009E73",
        line=(0, (1, 1.2)),
    ),
    ControllerKind(
        name="random",
        about="blind: backs off and turns at random times, to random sides, by random angles",
        make=RandomController,
        reads=("random", "escape.turn_offset"),
        colour="#56B4E9",
        line=(0, (2, 2)),
    ),
)
