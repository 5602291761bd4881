"""Our controllers: a frame of readings goes in, a command for the joints comes out.

Conditioning, contact and gait are the same in all. The rule that chooses the maneuver differs:

- `open` always walks FORWARD;
- `paper` follows the published table and holds each maneuver for a time;
- `closed-1` walks FORWARD until its readings repeat, then escapes;
- `closed` does so with patience, and searches for the way on;
- `map` walks along the route, which only a simulation can tell it.
"""

from __future__ import annotations

import math
from collections.abc import Collection

import numpy as np

from antennate.control.conditioning import RepetitionDetector
from antennate.control.escape import Escape, SearchRule
from antennate.control.kind import ControllerKind, all_but
from antennate.control.knowledge import ALIGNED, Kind, Knowledge, aligned
from antennate.control.rule_controller import RuleController
from antennate.params.control import ControlParams, EscapeParams, RuleParams, SearchParams
from antennate.robots.spec import RobotSpec
from antennate.types import LEFT, RIGHT, Bools, Contact, Floats, Ints, Maneuver


def decide(params: RuleParams, contact: Ints, level: Floats) -> Ints:
    """The paper's table.

    No side in contact: FORWARD. Both strong and similar: REVERSE. Otherwise turn away from the side
    that touches, or that touches more; right if both touch alike. A side that is UNKNOWN: HOLD.

    Args:
        params: Bounds of strong and similar.
        contact: One `Contact` a side, shape (B, 2).
        level: Bending levels, shape (B, 2).

    Returns:
        One `Maneuver` a row, shape (B,).
    """
    touch = contact == Contact.CONTACT
    difference = level[:, LEFT] - level[:, RIGHT]
    strong = (level >= params.strong).all(axis=1)
    blocked = touch.all(axis=1) & strong & (np.abs(difference) < params.similar)
    lean = np.where(touch.all(axis=1), difference, touch[:, LEFT] * 1.0 - touch[:, RIGHT])
    turn = np.where(lean >= 0, int(Maneuver.TURN_R), int(Maneuver.TURN_L))
    chosen = np.where(touch.any(axis=1), turn, int(Maneuver.FORWARD))
    chosen = np.where(blocked, int(Maneuver.REVERSE), chosen)
    return np.where((contact == Contact.UNKNOWN).any(axis=1), int(Maneuver.HOLD), chosen)


class Hold:
    """Keeps a maneuver for its time.

    HOLD is left at once; FORWARD as soon as something touches, or is kept (`forward`), too.
    """

    def __init__(self, batch: int, forward: bool = False) -> None:
        self._forward = forward
        self.current: Ints = np.full(batch, int(Maneuver.FORWARD))
        self.until: Floats = np.full(batch, -np.inf)

    def reset(self, rows: Ints | Bools) -> None:
        """Start rows FORWARD and free to change."""
        self.current[rows] = Maneuver.FORWARD
        self.until[rows] = -np.inf

    def step(self, t: Floats, wanted: Ints, duration: Floats | float) -> Ints:
        """The maneuver in force at t [s], shape (B,); a new one is kept for `duration` [s]."""
        stop = wanted == Maneuver.HOLD
        held = (t < self.until) & (self.current != Maneuver.HOLD) & ~stop
        chosen = np.where(held, self.current, wanted)
        renewed = ~held & (self._forward | (wanted != Maneuver.FORWARD)) & ~stop
        self.until = np.where(renewed, t + duration, np.where(stop, -np.inf, self.until))
        self.current = chosen
        return chosen


TURN_FROM = math.radians(45.0)
"""Angle to the point ahead from which on it turns [rad]; the head itself swings by 25 degrees."""


class MapRule:
    """Turns to a point ahead and walks there."""

    knows: tuple[Kind, ...] = ("jam", "map")
    needs: tuple[Kind, ...] = knows

    def __init__(self, control: ControlParams, batch: int) -> None:
        self._params: EscapeParams = control.escape
        self.turn_offset = control.escape.turn_offset
        self._maneuver: Ints = np.full(batch, int(Maneuver.FORWARD))
        self._until: Floats = np.zeros(batch)
        self._jam: Bools = np.zeros(batch, dtype=bool)
        self._map: Floats = np.full(batch, math.nan)

    def reset(self, rows: Ints | Bools) -> None:
        """Start rows anew, walking."""
        self._maneuver[rows] = Maneuver.FORWARD
        self._until[rows] = 0.0

    def know(self, knowledge: Knowledge) -> None:
        """Take what holds now."""
        if knowledge.jam is not None:
            self._jam = knowledge.jam
        if knowledge.map is not None:
            self._map = knowledge.map

    def step(self, t: Floats, level: Floats, contact: Ints, flex: Floats) -> Ints:
        """Maneuvers of this tick; a row without a heading, or with an UNKNOWN reading, holds."""
        known = ~(contact == int(Contact.UNKNOWN)).any(axis=1) & ~np.isnan(self._map)
        walking = known & (self._maneuver == int(Maneuver.FORWARD))
        backing = known & (self._maneuver == int(Maneuver.REVERSE))
        turning = known & ~walking & ~backing
        over = t >= self._until
        off = np.abs(np.nan_to_num(self._map))
        ahead = aligned(self._maneuver, self._map)
        self._to(turning & ahead, int(Maneuver.FORWARD), t)
        back = (walking & self._jam) | (turning & over & ~ahead)
        self._to(back, int(Maneuver.REVERSE), t + self._params.reverse_time)
        turn = (walking & ~back & (off > TURN_FROM)) | (backing & over & (off > ALIGNED))
        side = np.where(self._map > 0, int(Maneuver.TURN_L), int(Maneuver.TURN_R))
        self._to(turn, side, t + self._params.return_time)
        self._to(backing & over & ~turn, int(Maneuver.FORWARD), t)
        return np.where(known, self._maneuver, int(Maneuver.HOLD))

    def _to(self, rows: Bools, maneuver: Ints | int, until: Floats) -> None:
        self._maneuver = np.where(rows, maneuver, self._maneuver)
        self._until = np.where(rows, until, self._until)


class _OpenRule:
    """FORWARD, unless a reading cannot be used."""

    turn_offset = 0.0
    """Yaw offset of turns [rad]; this rule never turns."""

    def reset(self, rows: Ints | Bools) -> None:
        pass

    def step(self, t: Floats, level: Floats, contact: Ints, flex: Floats) -> Ints:
        unknown = (contact == int(Contact.UNKNOWN)).any(axis=1)
        return np.where(unknown, int(Maneuver.HOLD), int(Maneuver.FORWARD))


class _PaperRule:
    """The published table, each maneuver held for T_hold."""

    def __init__(self, control: ControlParams, batch: int) -> None:
        self.turn_offset = control.gait.turn_offset
        self._params = control.rule
        self._hold = Hold(batch, control.rule.hold_forward)

    def reset(self, rows: Ints | Bools) -> None:
        self._hold.reset(rows)

    def step(self, t: Floats, level: Floats, contact: Ints, flex: Floats) -> Ints:
        wanted = decide(self._params, contact, level)
        return self._hold.step(t, wanted, self._params.hold_time)


class _ClosedRule:
    """FORWARD until readings repeat, or the published table says REVERSE; then escape."""

    knows = Escape.knows

    def __init__(self, control: ControlParams, batch: int) -> None:
        self.turn_offset = control.escape.turn_offset
        self._control = control
        self._detector = None
        if control.escape.trigger == "repetition":
            self._detector = RepetitionDetector(
                control.repetition, batch, control.period, control.gait.frequency
            )
        self._escape = Escape(control.escape, batch, control.period)

    def reset(self, rows: Ints | Bools) -> None:
        if self._detector is not None:
            self._detector.reset(rows)
        self._escape.reset(rows)

    def know(self, knowledge: Knowledge) -> None:
        self._escape.knowledge = knowledge

    def step(self, t: Floats, level: Floats, contact: Ints, flex: Floats) -> Ints:
        stuck = self._stuck(level, contact, flex)
        left, right = (flex > self._control.repetition.pressure).T
        return self._escape.step(t, level, stuck, left | right)

    def _stuck(self, level: Floats, contact: Ints, flex: Floats) -> Bools:
        if self._detector is None:
            return decide(self._control.rule, contact, level) == Maneuver.REVERSE
        unknown = np.isnan(level[:, LEFT] + level[:, RIGHT])
        walking = (self._escape.maneuver == int(Maneuver.FORWARD)) & ~unknown
        return self._detector.step(flex, walking)


def open_loop(control: ControlParams, robot: RobotSpec, batch: int) -> RuleController:
    """`open`: always walks FORWARD."""
    return RuleController(_OpenRule(), control, robot, batch)


def paper(control: ControlParams, robot: RobotSpec, batch: int) -> RuleController:
    """`paper`: the published table with its hold."""
    return RuleController(_PaperRule(control, batch), control, robot, batch)


def closed_1(control: ControlParams, robot: RobotSpec, batch: int) -> RuleController:
    """`closed-1`: walks FORWARD until its readings repeat, then escapes."""
    return RuleController(_ClosedRule(control, batch), control, robot, batch)


def closed_loop(control: ControlParams, robot: RobotSpec, batch: int) -> RuleController:
    """`closed`: walks FORWARD until its readings repeat, then searches for the way on."""
    return RuleController(SearchRule(control, batch), control, robot, batch)


def by_map(control: ControlParams, robot: RobotSpec, batch: int) -> RuleController:
    """`map`: walks along the route, which a simulation tells it."""
    return RuleController(MapRule(control, batch), control, robot, batch)


def _closed_reads(control: ControlParams, knows: Collection[str]) -> tuple[str, ...]:
    """Parameters that `closed` reads: no detector and patience where it is told of a jam."""
    if "jam" in knows:
        search = all_but(SearchParams, "search", "patience")
        return *search, "repetition.pressure", "escape.turn_offset"
    return "search", "repetition", "escape.turn_offset"


def _closed_1_reads(control: ControlParams, knows: Collection[str]) -> tuple[str, ...]:
    """Parameters that `closed-1` reads, by its trigger."""
    if "jam" in knows:
        return *all_but(EscapeParams, "escape", "trigger"), "repetition.pressure"
    if control.escape.trigger == "contact":
        return "escape", "repetition.pressure", "rule.strong", "rule.similar"
    return "escape", "repetition"


KINDS = (
    ControllerKind(
        name="open",
        about="walks forward whatever its antennae feel; it shows what a robot does without touch",
        make=open_loop,
        reads=(),
        colour="#8C8C8C",
        line=(0, (4, 1.5)),
    ),
    ControllerKind(
        name="paper",
        about="turns away from the side that touches, backs off where both do: the published table",
        make=paper,
        reads=("rule", "gait.turn_offset"),
        colour="#CC79A7",
        line=(0, (4, 1.5, 1, 1.5)),
    ),
    ControllerKind(
        name="closed",
        about="walks on until its readings repeat: then it backs off and searches for the way on",
        make=closed_loop,
        reads=_closed_reads,
        colour="#332288",
    ),
    ControllerKind(
        name="closed-1",
        about="the closed of former versions: stuck, it backs off and turns, then the other way",
        make=closed_1,
        reads=_closed_1_reads,
        colour="#882255",
        line=(0, (8, 2)),
    ),
    ControllerKind(
        name="map",
        about="walks along the route, which only a simulation can tell it, to show what that is "
        "worth",
        make=by_map,
        reads=("escape.reverse_time", "escape.return_time", "escape.turn_offset"),
        needs=MapRule.needs,
    ),
)
