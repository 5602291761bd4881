"""Times of a recording: clocks that wrap are unwrapped, rows out of place are found.

A board counts micro- or milliseconds in 30 bits (MicroPython's ticks) or 32 (Arduino's micros and
millis, this project's own board) and begins at 0 again.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from datetime import date
from pathlib import Path

import numpy as np

from antennate.errors import CalibrationError
from antennate.types import Bools, Floats, Ints

TIME_UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6}
DAY = 86400.0
_CLOCK = re.compile(r"(?:(\d{4}-\d\d-\d\d)[T ])?(\d{1,2}):(\d\d):(\d\d(?:\.\d+)?)")
_WRAPS = {
    f"a clock of {bits} bits in {unit}": 2.0**bits * TIME_UNITS[unit]
    for bits in (30, 32)
    for unit in ("us", "ms")
} | {"a clock that begins anew at midnight": DAY}
"""After what time clocks begin at 0 again [s]."""
_LONGEST_GAP = 10.0
"""Longest time between two readings of which a wrap is believed [s]."""
_LONGEST_PERIOD = 1.0
"""Readings lie closer together in time [s]; 100 Hz in ms that is declared as s lies 10 s apart."""
_FEW = 0.02
"""Share of the rows at which time goes back from which on they are in no order."""


@dataclass(frozen=True, slots=True)
class Wrap:
    """A clock that began at 0 again in this row of the file, and which kind it is."""

    row: int
    clock: str


def seconds(cell: str) -> float | None:
    """The seconds of a time of day such as 13:08:29.5, with or without a date; None if it is none.

    With a date they count from its calendar's beginning, else from midnight.
    """
    found = _CLOCK.fullmatch(cell.strip())
    if found is None:
        return None
    day, hour, minute, second = found.groups()
    try:
        days = date.fromisoformat(day).toordinal() if day else 0
    except ValueError:
        return None
    return DAY * days + 3600 * int(hour) + 60 * int(minute) + float(second)


def unwrapped(t: Floats, trial: Ints, rows: Ints) -> tuple[Floats, list[Wrap]]:
    """Times [s] of a clock that wraps, made to rise within each trial, and where it wrapped."""
    added, wraps = np.zeros_like(t), list[Wrap]()
    falls = np.flatnonzero((np.diff(t) < 0) & (np.diff(trial) == 0)) + 1
    for at in falls.tolist():
        for clock, span in _WRAPS.items():
            gap = float(t[at] + span - t[at - 1])
            if t[at - 1] <= span and t[at] >= 0 and 0 < gap < _LONGEST_GAP:
                later = np.arange(len(t)) >= at
                added[later & (trial == trial[at])] += span
                wraps.append(Wrap(int(rows[at]), clock))
                break
    return t + added, wraps


def out_of_place(t: Floats, trial: Ints) -> Bools:
    """Rows whose time alone is out of order: both neighbours are in order without it, (n,)."""
    found = np.zeros(len(t), bool)
    if len(t) > 2:
        one = (trial[:-2] == trial[1:-1]) & (trial[1:-1] == trial[2:])
        between = (t[:-2] < t[1:-1]) & (t[1:-1] < t[2:])
        found[1:-1] = one & (t[:-2] < t[2:]) & ~between
        found[1:-1] &= ~found[:-2]
    return found


def check(path: Path, t: Floats, trial: Ints, rows: Ints, unit: str) -> None:
    """Refuse times that do not rise within a push, or lie too far apart.

    Raises:
        CalibrationError: Names the row and the cure.
    """
    same = np.diff(trial) == 0
    steps, at = np.diff(t)[same], rows[1:][same]
    if (steps <= 0).any():
        first = int(np.argmax(steps <= 0))
        before = t[:-1][same][first]
        if steps[first] == 0:
            why = f"standing at {before:g} s; write finer times, or leave them out and give --rate"
        elif (steps < 0).mean() > _FEW:
            why = "going up and down; sort the rows of each push"
        else:
            why = (
                f"going back from {before:g} to {before + steps[first]:g} s: another recording, or "
                "a board that began anew; number pushes in a column trial"
            )
        raise CalibrationError(
            f"{path}: row {at[first]}: expected time to rise within a push, found it {why}"
        )
    if len(steps) and np.median(steps) > _LONGEST_PERIOD:
        raise CalibrationError(
            f"{path}: row {at[0]}: expected readings less than {_LONGEST_PERIOD:g} s apart, found "
            f"{np.median(steps):g} s; is {unit} the right --columns.time-unit?"
        )
