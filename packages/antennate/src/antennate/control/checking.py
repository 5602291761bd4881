"""Check of a controller, for the tests of one of your own."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

from antennate.control.loop import CheckedController, Wrapped
from antennate.control.registry import ControllerFactory, make_controller
from antennate.errors import FAILURES
from antennate.params.control import ConditioningParams, ControlParams
from antennate.params.scene import GRAVITY
from antennate.robots.spec import RobotSpec
from antennate.types import AntennaFrame, Contact, Floats, JointCommand, Maneuver

_ROWS = 5
_TICKS = 700
_RESET_AT = 350
"""Tick in which one row is reset while the others go on."""
_LEAPS = (0.0, 120.0, 3600.0)
"""Times from which readings are given [s]."""
_BLIND_FROM, _BLIND_TO = 400, 420
"""Ticks in which a row reads NaN."""


@dataclass(frozen=True, slots=True)
class _Trace:
    """All answers of a run, the first axis over ticks, the second over rows."""

    commands: dict[str, Floats]
    decisions: dict[str, Floats]

    def expect_same(
        self, what: str, other: _Trace, mine: Sequence[int], its: Sequence[int]
    ) -> None:
        """Expect the same answers in these rows of the two."""
        for name, values in (self.commands | self.decisions).items():
            here = values[:, list(mine)]
            there = (other.commands | other.decisions)[name][:, list(its)]
            equal = (here == there) | (np.isnan(here) & np.isnan(there))
            for tick in np.argwhere(~equal)[:1, 0].tolist():
                raise AssertionError(f"expected {what}, found another {name} at tick {tick}")


def check_controller(
    factory: str | ControllerFactory,
    robot: RobotSpec | None = None,
    control: ControlParams | None = None,
) -> None:
    """Check a controller.

    It can be made for one robot and for many. Its answers have the right shapes; angles are finite,
    maneuvers and contacts exist, levels are within 0 and 1. The same readings give the same answers
    again. Rows do not influence one another, whatever their order and number. A row that is reset
    answers as a new controller, and the others go on. A reading that is not finite makes its
    antenna UNKNOWN and its row HOLD, with joint targets that stand still. Frames are left as they
    are, in 700 steps from 0 s on and in as many from 2 and from 60 minutes on. A command that was
    returned does not change later, and changing it does not change later answers.

    Args:
        factory: The controller: its name, a class, or a function (control, robot, batch).
        robot: The robot, the default one if None.
        control: Numbers of the control, the defaults if None.

    Raises:
        AssertionError: It does not; the text says what was expected and found.
    """
    run = _Runs(factory, robot or RobotSpec(), control or ControlParams())
    counts, rows = run.counts, list(range(_ROWS))
    together = run.trace(counts, rows)
    again, spoiled = run.trace(counts, rows), run.trace(counts, rows, spoil=True)
    again.expect_same("the same answers to the same readings", together, rows, rows)
    what = "the same answers when a command that was returned is changed"
    spoiled.expect_same(what, together, rows, rows)
    turned = rows[::-1]
    other = run.trace(counts[:, turned], turned)
    other.expect_same("the same answers from rows in another order", together, rows, turned)
    for row in rows:
        alone = run.trace(counts[:, [row]], [row])
        alone.expect_same(f"row {row} alone to answer as in a batch", together, [0], [row])
    _check_reset(run, together)
    _check_blind(run, together)
    run.trace(np.concatenate([counts] * len(_LEAPS)), rows)


class _Runs:
    """Runs of fresh controllers over readings."""

    def __init__(
        self, factory: str | ControllerFactory, robot: RobotSpec, control: ControlParams
    ) -> None:
        self._factory, self._robot, self._control = factory, robot, control
        self._parts = tuple(robot.command_shapes(1))
        self.counts = _readings(control.conditioning, control.period, control.gait.frequency)

    def trace(
        self,
        counts: Floats,
        rows: Sequence[int],
        reset: int | None = None,
        first: int = 0,
        spoil: bool = False,
    ) -> _Trace:
        """Answers to counts (ticks, rows, 2) from tick `first` on; row `reset` is reset then.

        Time and phase of a row depend on its number in `rows`; after _TICKS time leaps to the next
        of _LEAPS. With `spoil` each command is overwritten after it was noted.
        """
        batch, period = len(rows), self._control.period
        offsets = 0.37 * np.array(rows, float)
        try:
            controller = make_controller(
                self._factory, self._control, self._robot, batch, walks=False
            )
            watched = _Watched(controller)
            checked = CheckedController(watched, self._robot, batch)
            checked.reset(np.arange(batch), offsets)
            commands: list[JointCommand] = []
            copies_of: list[list[Floats]] = []
            names = ("maneuver", "contact", "level")
            decisions: dict[str, list[Floats]] = {name: [] for name in names}
            for tick, reading in enumerate(counts[first:], first):
                if tick == _RESET_AT and reset is not None:
                    checked.reset(np.array([reset]), offsets[[reset]])
                t = offsets + period * (tick % _TICKS) + _LEAPS[tick // _TICKS]
                frame = AntennaFrame(t, reading, self._positions(t), *self._motion(t))
                commands.append(_step(checked, watched, frame))
                copies_of.append([getattr(commands[-1], part).copy() for part in self._parts])
                for part in self._parts if spoil else ():
                    getattr(commands[-1], part)[...] = math.nan
                for name, values in decisions.items():
                    values.append(np.array(getattr(controller, name), float))
        except FAILURES as error:
            raise AssertionError(f"{error} (with {batch} rows)") from error
        for tick, (command, copies) in enumerate(zip(commands, copies_of, strict=True)):
            if spoil:
                break
            for part, copy in zip(self._parts, copies, strict=True):
                expect(
                    np.array_equal(getattr(command, part), copy),
                    "a command that stays as it was returned",
                    f"another {part} in that of tick {tick} later",
                )
        arrays = {part: np.array([c[i] for c in copies_of]) for i, part in enumerate(self._parts)}
        trace = _Trace(arrays, {name: np.array(values) for name, values in decisions.items()})
        _check_values(trace)
        return trace

    def _positions(self, t: Floats) -> Floats:
        """Joint angles at the time of each row [rad], shape (rows, n): slow waves."""
        lags = np.arange(len(self._robot.joint_names))
        return 0.3 * np.sin(2.0 * math.pi * self._control.gait.frequency * t[:, None] - lags)

    def _motion(self, t: Floats) -> tuple[Floats, Floats]:
        """What an inertial sensor feels at the time of each row, shapes (rows, 3) or (rows, 0).

        A head that turns to and fro and stays level.
        """
        if not self._robot.has_imu:
            return np.zeros((len(t), 0)), np.zeros((len(t), 0))
        turning = np.sin(2.0 * math.pi * self._control.gait.frequency * t[:, None])
        return turning * [0.0, 0.0, 1.0], np.tile([0.0, 0.0, GRAVITY], (len(t), 1))


class _Watched(Wrapped):
    """A controller whose last command is kept as it gave it, and what it wrote into its frame."""

    def step(self, frame: AntennaFrame) -> JointCommand:
        before = frame.copy()
        self.command = super().step(frame)
        self.written = [
            part.name
            for part in fields(before)
            if not np.array_equal(*(getattr(f, part.name) for f in (before, frame)), equal_nan=True)
        ]
        return self.command


def _step(checked: CheckedController, watched: _Watched, frame: AntennaFrame) -> JointCommand:
    checked.step(frame)
    found = f"another {' and '.join(watched.written)} after a step at {frame.t[0]:.2f} s"
    expect(not watched.written, "a frame that is left as it is", f"{found}; change a copy")
    for row, fault in checked.faults.items():
        raise AssertionError(f"{fault} in row {row}")
    return watched.command


def _check_values(trace: _Trace) -> None:
    level = trace.decisions["level"]
    wrong = (level < 0.0) | (level > 1.0)
    expect(not wrong.any(), "levels of 0 to 1, or NaN", f"{level[wrong][:1]}")


def _check_reset(run: _Runs, together: _Trace) -> None:
    rows = list(range(_ROWS))
    after = run.trace(run.counts, rows, reset=1)
    others = [row for row in rows if row != 1]
    after.expect_same("the other rows to go on when one is reset", together, others, others)
    fresh = run.trace(run.counts[:, [1]], [1], first=_RESET_AT)
    parts = (after.commands, after.decisions)
    again = _Trace(*({name: v[_RESET_AT:] for name, v in part.items()} for part in parts))
    again.expect_same("a row that is reset to answer as a new one", fresh, [1], [0])


def _check_blind(run: _Runs, together: _Trace) -> None:
    rows = list(range(_ROWS))
    blind = slice(_BLIND_FROM, _BLIND_TO)
    for side in (0, 1):
        for bad in (math.nan, math.inf):
            counts = run.counts.copy()
            counts[blind, 2, side] = bad
            trace = run.trace(counts, rows)
            others = [row for row in rows if row != 2]
            what = f"the other rows to go on when one reads {bad}"
            trace.expect_same(what, together, others, others)
            maneuvers = trace.decisions["maneuver"][blind, 2]
            others = [Maneuver(int(each)).name for each in maneuvers if each != Maneuver.HOLD]
            unknown = trace.decisions["contact"][blind, 2, side] == int(Contact.UNKNOWN)
            expect(not others, f"HOLD while an antenna reads {bad}", "".join(others[:1]))
            expect(unknown.all(), f"UNKNOWN for a reading of {bad}", "another contact")
            for part, values in trace.commands.items():
                still = (values[blind, 2] == values[_BLIND_FROM - 1, 2]).all()
                expect(still, "joint targets that stand still in HOLD", f"{part} moves")


def _readings(conditioning: ConditioningParams, period: float, frequency: float) -> Floats:
    """Counts (ticks, rows, 2): free, pressed on either side, blocked, and changing at random."""
    rng = np.random.default_rng(0)
    low, high = conditioning.counts_low, conditioning.counts_high
    phase = 2.0 * math.pi * frequency * period * np.arange(_TICKS)
    flex = np.zeros((_TICKS, _ROWS, 2))
    flex[:, 1, 0] = 0.8 + 0.2 * np.sin(phase)
    flex[:, 2, 1] = 0.7 + 0.2 * np.cos(phase)
    flex[:, 3] = 0.95
    flex[:, 4] = rng.uniform(0.0, 1.0, (_TICKS // 50, 2)).repeat(50, axis=0)
    straight, bent = (high, low) if conditioning.polarity < 0 else (low, high)
    noise = rng.normal(0.0, 2.5, flex.shape)
    return np.rint(straight + (bent - straight) * flex + noise)


def expect(holds: bool, expected: str, found: str) -> None:
    """Raise an error that says what was expected and found."""
    if not holds:
        raise AssertionError(f"expected {expected}, found {found}")
