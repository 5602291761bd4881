"""Recordings of a pushed antenna: CSV with declared columns and units, in and out.

Clocks that wrap are unwrapped, and rows out of place are left out. A board counts micro- or
milliseconds in 30 bits (MicroPython's ticks) or 32 (Arduino's micros and millis, this project's own
board) and begins at 0 again.
"""

from __future__ import annotations

import csv
import hashlib
import io
import math
import re
from dataclasses import dataclass, fields
from datetime import date
from pathlib import Path

import numpy as np

from antennate.antenna.curves import Samples
from antennate.csv_files import LARGEST_WHOLE, column, csv_rows, number_of, unit_of, wrong_count
from antennate.errors import CalibrationError
from antennate.experiments.calibrate.readings import (
    BEND,
    BEND_UNITS,
    READING,
    READING_UNITS,
    SPEED,
    SPEED_UNITS,
    TIME,
    TRIAL,
    Conversion,
    Outlier,
    RecordingParams,
    expectation,
    outliers,
    to_counts,
    unit_named,
    usual,
)
from antennate.files import read_limited
from antennate.robots.antenna import SensorParams
from antennate.studies.columns import tabular
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
_MOST_SPEEDS = 12
"""More different speeds than this were measured and not commanded."""
_LARGEST_FILE = 50_000_000
_NAMED = 20
"""Most rows that are named one by one."""
COLUMNS = ("trial", "speed_m_s", "time", "counts", "bend")


@tabular
class Wrap:
    """A clock that began at 0 again."""

    row: int
    clock: str
    """Kind of the clock."""


@tabular
class Handled:
    """What was wrong with a file, and what was done about it."""

    rows: int
    """Rows of the file below its header."""
    damaged: int
    """Rows that were left out: too many or few cells, no number, a time out of place."""
    damages: tuple[tuple[int, str], ...]
    """First damaged rows: the row, and the reason."""
    outliers: tuple[Outlier, ...]
    """Readings that were left out, or kept if they are more than `most_lost`."""
    outliers_kept: bool
    """Whether the outliers are kept."""
    wraps: tuple[Wrap, ...]
    """Rows at which the clock began at 0 again and was unwrapped."""
    conversion: Conversion | None
    """How readings became counts; `null` if they are counts."""
    units: tuple[str, ...] = ()
    """Units taken as declared, against the name of their column, in a sentence each."""


@dataclass(frozen=True)
class Recording:
    """A recording and where it came from.

    Attributes:
        t: Time of each reading [s], shape (n,).
        samples: Readings and bends.
        sha256: Hash of the file's bytes.
        handled: What was wrong with the file; None of a rig.
    """

    t: Floats
    samples: Samples
    sha256: str
    handled: Handled | None = None


def read(
    path: Path,
    params: RecordingParams,
    rate: float | None = None,
    sensor: SensorParams | None = None,
) -> Recording:
    """Read a recording.

    Args:
        path: The file.
        params: Its columns and units.
        rate: Readings a second [Hz] of a file without a column of time.
        sensor: Divider and converter, for readings that are no counts; the default ones if None.
    """
    data = read_limited(path, _LARGEST_FILE, CalibrationError)
    table, lines, damages, units = _rows(path, data, params, rate)
    total = len(table) + len(damages)
    trial = _numbered(path, table[:, TRIAL], lines, params.trial_column)
    if rate is None:
        t, wraps = _unwrapped(table[:, TIME] * TIME_UNITS[params.time_unit], trial, lines)
        astray = _out_of_place(t, trial)
        if astray.mean() <= params.most_lost:
            why = f"expected time to rise within a push, found {params.time_column} out of place"
            damages = sorted([*damages, *((int(line), why) for line in lines[astray])])
            table, t = table[~astray], t[~astray]
            lines, trial = lines[~astray], trial[~astray]
        _check_time(path, t, trial, lines, params.time_unit)
    else:
        t, wraps = _counted(trial) / rate, []
    _check_share(path, damages, total, params.most_lost)
    readings, bend = table[:, READING], _normalised(path, lines, table[:, BEND], params)
    counts, conversion = to_counts(
        path, params.reading_unit, readings, lines, sensor or SensorParams()
    )
    speed = _of_pushes(np.abs(table[:, SPEED]) * SPEED_UNITS[params.speed_unit], trial)
    samples = Samples(counts, bend, trial, speed, lines)
    far, off = outliers(samples), usual(samples)
    strays = zip(lines[far].tolist(), counts[far].tolist(), off[far].tolist(), strict=True)
    many = bool(far.mean() > params.most_lost)
    if not many:
        samples = Samples(*(getattr(samples, field.name)[~far] for field in fields(Samples)))
        t = t[~far]
    handled = Handled(
        rows=total,
        damaged=len(damages),
        damages=tuple(damages[:_NAMED]),
        outliers=tuple(Outlier(row=row, counts=one, usual=near) for row, one, near in strays),
        outliers_kept=many,
        wraps=tuple(wraps),
        conversion=conversion,
        units=units,
    )
    return Recording(t, samples, hashlib.sha256(data).hexdigest(), handled)


def _of_pushes(speed: Floats, trial: Ints) -> Floats:
    """Speeds [m/s], shape (n,); measured ones as the median of their trial, by two digits."""
    if len(np.unique(speed[np.isfinite(speed)])) <= _MOST_SPEEDS:
        return speed
    medians = np.zeros_like(speed)
    for push in np.unique(trial):
        medians[trial == push] = float(f"{np.median(speed[trial == push]):.2g}")
    return medians


def _numbered(path: Path, trial: Floats, lines: Ints, name: str) -> Ints:
    """Numbers of pushes as whole numbers, 0 without such a column, shape (n,)."""
    whole = np.where(np.isnan(trial), 0.0, trial)
    bad = (whole != np.round(whole)) | (abs(whole) > LARGEST_WHOLE)
    if bad.any():
        i = int(np.argmax(bad))
        raise CalibrationError(
            f"{path}: row {lines[i]}: expected a whole number up to {LARGEST_WHOLE:g} in {name}, "
            f"found {whole[i]:g}; number the pushes 0, 1, 2"
        )
    return whole.astype(np.int64)


def _counted(trial: Ints) -> Ints:
    """How many readings of the same push came before each, shape (n,)."""
    before = np.zeros_like(trial)
    for push in np.unique(trial):
        readings = trial == push
        before[readings] = np.arange(readings.sum())
    return before


def _rows(
    path: Path, data: bytes, params: RecordingParams, rate: float | None
) -> tuple[Floats, Ints, list[tuple[int, str]], tuple[str, ...]]:
    """Numbers of the rows that are whole, their lines, and lines and reasons of those that are not.

    Last comes what is to be said of their units.

    Rows may be damaged: a serial line merges two, cuts one, or mixes in what a board says at boot.
    """
    needed = [params.time_column] * (rate is None) + [params.counts_column, params.bend_column]
    cure = "; name yours with --columns.*-column"
    cure += ", or give --rate if there is no time" if rate is None else ""
    lines = csv_rows(path, data, needed, CalibrationError, cure, ended=True)
    _, header = next(lines)
    if rate is not None and column(header, params.time_column) is not None:
        raise CalibrationError(
            f"{path}: row 1: expected no column {params.time_column} beside --rate, found one; "
            "leave out --rate"
        )
    names = (params.trial_column, params.speed_column, params.time_column, *needed[-2:])
    for name in names:
        if header.count(name) > 1:
            raise CalibrationError(f"{path}: row 1: expected one column {name}, found several")
    places = [column(header, name) for name in names]
    units = _units(path, header, places, params)
    rows, numbers, damages = list[list[float]](), list[int](), list[tuple[int, str]]()
    for line, cells in lines:
        values = _values(header, cells, places, params)
        if isinstance(values, str):
            damages.append((line, values))
        else:
            rows.append(values)
            numbers.append(line)
    if not rows and not damages:
        raise CalibrationError(f"{path}: row 2: expected readings, found none; record longer")
    _check_share(path, damages, len(rows) + len(damages), params.most_lost)
    return np.array(rows), np.array(numbers, dtype=np.int64), damages, units


def _check_share(path: Path, damages: list[tuple[int, str]], rows: int, most: float) -> None:
    """Refuse a file of which too large a share is damaged, by its first damaged row."""
    if len(damages) <= most * rows:
        return
    line, why = damages[0]
    more = f" ({len(damages)} of {rows} rows are like it)" if len(damages) > 1 else ""
    raise CalibrationError(f"{path}: row {line}: {why}{more}")


def _units(
    path: Path, header: list[str], places: list[int | None], params: RecordingParams
) -> tuple[str, ...]:
    """Sentences on units that are declared against those in the names of their columns."""
    units = (SPEED_UNITS, TIME_UNITS, (*READING_UNITS, "%"), BEND_UNITS)
    names = ("speed_unit", "time_unit", "reading_unit", "bend_unit")
    sentences = list[str]()
    for place, known, field in zip(places[SPEED:], units, names, strict=True):
        if place is None:
            continue
        named, declared = unit_of(header[place], known), getattr(params, field)
        plain = unit_named(named) if field == "reading_unit" else named
        if plain not in known or plain == declared:
            continue
        if field not in params.model_fields_set:
            raise CalibrationError(
                f"{path}: row 1: expected {header[place]} in {declared} unless declared, found "
                f"{named}; declare its unit with --columns.{field.replace('_', '-')}"
            )
        sentences.append(
            f"{header[place]} is taken in {declared} as declared, though its name says {named}."
        )
    return tuple(sentences)


def _values(
    header: list[str], cells: list[str], places: list[int | None], params: RecordingParams
) -> list[float] | str:
    """Numbers of a row, or what was expected of it and found."""
    surplus = "; is it merged with another, or a column without a name?"
    if why := wrong_count(header, cells, surplus):
        return why
    values = list[float]()
    for i, place in enumerate(places):
        if place is None:
            values.append(math.nan)
            continue
        cell = cells[place]
        where = f"in {header[place]}, found {cell[:40]!r}"
        try:
            value = number_of(cell)
        except ValueError as error:
            return f"expected {error} {where}"
        if i == TIME and (clock := _seconds(cell)) is not None:
            value = clock / TIME_UNITS[params.time_unit]
        if not math.isfinite(value):
            return f"expected a finite number {where}; delete the row"
        if why := expectation(i, value, header[place], params):
            return why
        values.append(value)
    return values


def _normalised(path: Path, lines: Ints, raw: Floats, params: RecordingParams) -> Floats:
    unit = params.bend_unit
    zero = float(raw.min()) if params.bend_zero is None else params.bend_zero
    full = float(raw.max()) if params.bend_full is None else params.bend_full
    if unit == "1" and params.bend_zero is None and params.bend_full is None:
        zero, full = 0.0, 1.0
    if zero == full:
        raise CalibrationError(
            f"{path}: row {lines[0]}: expected a bend that changes, found {zero:g} throughout; "
            "bend the antenna while recording"
        )
    return (raw - zero) / (full - zero)


def _seconds(cell: str) -> float | None:
    """The seconds of a time of day such as 13:08:29.5, with or without a date; None if it is none.

    With a date they count from its calendar's beginning, else from midnight.
    """
    clock = _CLOCK.fullmatch(cell.strip())
    if clock is None:
        return None
    day, hour, minute, second = clock.groups()
    try:
        days = date.fromisoformat(day).toordinal() if day else 0
    except ValueError:
        return None
    return DAY * days + 3600 * int(hour) + 60 * int(minute) + float(second)


def _unwrapped(t: Floats, trial: Ints, rows: Ints) -> tuple[Floats, list[Wrap]]:
    """Times [s] of a clock that wraps, made to rise within each trial, and where it wrapped."""
    added, wraps = np.zeros_like(t), list[Wrap]()
    falls = np.flatnonzero((np.diff(t) < 0) & (np.diff(trial) == 0)) + 1
    for at in falls.tolist():
        for clock, span in _WRAPS.items():
            gap = float(t[at] + span - t[at - 1])
            if t[at - 1] <= span and t[at] >= 0 and 0 < gap < _LONGEST_GAP:
                later = np.arange(len(t)) >= at
                added[later & (trial == trial[at])] += span
                wraps.append(Wrap(row=int(rows[at]), clock=clock))
                break
    return t + added, wraps


def _out_of_place(t: Floats, trial: Ints) -> Bools:
    """Rows whose time alone is out of order: both neighbours are in order without it, (n,)."""
    astray = np.zeros(len(t), bool)
    if len(t) > 2:
        same_push = (trial[:-2] == trial[1:-1]) & (trial[1:-1] == trial[2:])
        between = (t[:-2] < t[1:-1]) & (t[1:-1] < t[2:])
        astray[1:-1] = same_push & (t[:-2] < t[2:]) & ~between
        astray[1:-1] &= ~astray[:-2]
    return astray


def _check_time(path: Path, t: Floats, trial: Ints, rows: Ints, unit: str) -> None:
    """Refuse times that do not rise within a push, or lie too far apart."""
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


def write(recording: Recording) -> str:
    """A recording as CSV with the default columns and units."""
    file = io.StringIO()
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(COLUMNS)
    s = recording.samples
    columns = (s.trial, s.speed, recording.t, s.counts, s.level)
    for trial, speed, t, counts, bend in zip(*(c.tolist() for c in columns), strict=True):
        writer.writerow([trial, repr(speed), f"{t:.6f}", f"{counts:g}", repr(bend)])
    return file.getvalue()
