"""Recordings of a pushed antenna: CSV with declared columns and units, in and out."""

from __future__ import annotations

import csv
import hashlib
import io
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from antennate.antenna.curves import Samples
from antennate.csv_files import LARGEST_WHOLE, column, csv_rows, number_of, unit_of
from antennate.errors import CalibrationError
from antennate.files import read_limited
from antennate.params.base import Params, number
from antennate.types import Floats, Ints

TIME_UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6}
BEND_UNITS = {"1": 1.0, "rad": 1.0, "deg": math.pi / 180.0, "m": 1.0, "mm": 1e-3}
_LARGEST_BEND = {"1": 1.05, "rad": 2 * math.pi, "deg": 360.0, "m": 1.0, "mm": 1000.0}
"""Beyond these a value was hardly meant in its unit."""
_LARGEST_FILE = 50_000_000
_LONGEST_PERIOD = 1.0
"""Readings lie closer together in time [s]; 100 Hz in ms that is declared as s lies 10 s apart."""
COLUMNS = ("trial", "speed_m_s", "time", "counts", "bend")


class RecordingParams(Params):
    """Columns and units of a recording."""

    time_column: str = number("time", "1", "assumed: plain")
    """Column of time."""
    time_unit: Literal["s", "ms", "us"] = number("s", "1", "assumed: SI")
    """Its unit."""
    counts_column: str = number("counts", "1", "assumed: plain")
    """Column of readings [counts]."""
    bend_column: str = number("bend", "1", "assumed: plain")
    """Column of bend or position."""
    bend_unit: Literal["1", "rad", "deg", "m", "mm"] = number(
        "1", "1", "assumed: 0 straight, 1 full"
    )
    """Its unit."""
    bend_zero: float | None = number(None, "unit of bend", "assumed: its smallest value")
    """Value when straight."""
    bend_full: float | None = number(None, "unit of bend", "assumed: its largest value")
    """Value when fully bent."""
    trial_column: str = number("trial", "1", "assumed: plain")
    """Column that numbers pushes, if any."""
    speed_column: str = number("speed_m_s", "1", "assumed: plain")
    """Column of pushing speed [m/s], if any."""


@dataclass(frozen=True)
class Recording:
    """A recording and where it came from.

    Attributes:
        t: Time of each reading [s], shape (n,).
        samples: Readings and bends.
        sha256: Hash of the file's bytes.
    """

    t: Floats
    samples: Samples
    sha256: str


def read(path: Path, params: RecordingParams, rate: float | None = None) -> Recording:
    """Read a recording.

    Args:
        path: The file.
        params: Its columns and units.
        rate: Readings a second [Hz] of a file without a column of time.

    Raises:
        CalibrationError: Names the row and the cure.
    """
    data = read_limited(path, _LARGEST_FILE, CalibrationError)
    rows = _rows(path, data, params, rate)
    table = np.array([values for _, values in rows])
    lines = np.array([line for line, _ in rows], dtype=np.int64)
    trial, speed, t, counts, raw = table.T
    trial = _numbered(path, trial, lines, params.trial_column)
    if rate is None:
        t = t * TIME_UNITS[params.time_unit]
        _check_time(path, t, trial, lines, params)
    else:
        t = _counted(trial) / rate
    _check_counts(path, counts, lines)
    bend = _normalised(path, raw, lines, params)
    samples = Samples(counts, bend, trial, speed, lines)
    return Recording(t, samples, hashlib.sha256(data).hexdigest())


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
        here = trial == push
        before[here] = np.arange(here.sum())
    return before


def _rows(
    path: Path, data: bytes, params: RecordingParams, rate: float | None
) -> list[tuple[int, list[float]]]:
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
    places = _places(path, header, names)
    _check_units(path, header, places, params)
    rows = [(line, _values(path, line, header, cells, places)) for line, cells in lines]
    if not rows:
        raise CalibrationError(f"{path}: row 2: expected readings, found none; record longer")
    return rows


def _places(path: Path, header: list[str], names: Sequence[str]) -> list[int | None]:
    for name in names:
        if header.count(name) > 1:
            raise CalibrationError(f"{path}: row 1: expected one column {name}, found several")
    return [column(header, name) for name in names]


def _check_units(
    path: Path, header: list[str], places: list[int | None], params: RecordingParams
) -> None:
    """Refuse a column whose name gives another unit than the one declared."""
    columns = (
        (places[2], TIME_UNITS, params.time_unit, "time-unit"),
        (places[3], ("V", "mV", "%"), "counts", "counts-column"),
        (places[4], BEND_UNITS, params.bend_unit, "bend-unit"),
    )
    for place, known, declared, flag in columns:
        named = unit_of(header[place]) if place is not None else ""
        if named in known and named != declared:
            raise CalibrationError(
                f"{path}: row 1: expected {header[place or 0]} in {declared} as declared, found "
                f"{named}; is it the right --columns.{flag}?"
            )


def _values(
    path: Path, line: int, header: list[str], cells: list[str], places: list[int | None]
) -> list[float]:
    if len(cells) != len(header):
        few = len(cells) < len(header)
        why = " (truncated); delete the row" if few else "; are there decimal commas? write points"
        raise CalibrationError(
            f"{path}: row {line}: expected {len(header)} cells, found {len(cells)}{why}"
        )
    values = []
    for place in places:
        if place is None:
            values.append(math.nan)
            continue
        found = f"in {header[place]}, found {cells[place][:40]!r}"
        try:
            value = number_of(cells[place])
        except ValueError as error:
            raise CalibrationError(f"{path}: row {line}: expected {error} {found}") from None
        if not math.isfinite(value):
            raise CalibrationError(
                f"{path}: row {line}: expected a finite number {found}; delete the row"
            )
        values.append(value)
    return values


def _check_time(path: Path, t: Floats, trial: Ints, lines: Ints, params: RecordingParams) -> None:
    steps = np.diff(t)[np.diff(trial) == 0]
    at = lines[1:][np.diff(trial) == 0]
    if (steps <= 0).any():
        row = at[int(np.argmax(steps <= 0))]
        raise CalibrationError(
            f"{path}: row {row}: expected time to rise within a push, found it standing or going "
            "back; sort the rows, or number pushes in a column trial"
        )
    if len(steps) and np.median(steps) > _LONGEST_PERIOD:
        raise CalibrationError(
            f"{path}: row {at[0]}: expected readings less than {_LONGEST_PERIOD:g} s apart, found "
            f"{np.median(steps):g} s; is {params.time_unit} the right --columns.time-unit?"
        )


def _check_counts(path: Path, counts: Floats, lines: Ints) -> None:
    bad = (counts < 0) | (counts > 4095)
    if bad.any():
        i = int(np.argmax(bad))
        raise CalibrationError(
            f"{path}: row {lines[i]}: expected 0 to 4095 counts, found {counts[i]:g}; give raw "
            "readings, not volts or percent"
        )
    if counts.max() <= 5 and (counts != np.round(counts)).any():
        raise CalibrationError(
            f"{path}: row {lines[0]}: expected raw counts, found {counts[0]:g} and none above 5; "
            "are these volts? multiply by 4095 / 3.3"
        )


def _normalised(path: Path, raw: Floats, lines: Ints, params: RecordingParams) -> Floats:
    unit = params.bend_unit
    beyond = abs(raw) > _LARGEST_BEND[unit]
    if beyond.any():
        i = int(np.argmax(beyond))
        raise CalibrationError(
            f"{path}: row {lines[i]}: expected at most {_LARGEST_BEND[unit]:g} in unit {unit}, "
            f"found {raw[i]:g}; is it the right --columns.bend-unit?"
        )
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


def write(recording: Recording) -> str:
    """A recording as CSV with the default columns and units."""
    file = io.StringIO()
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(COLUMNS)
    s = recording.samples
    for trial, speed, t, counts, bend in zip(
        s.trial.tolist(),
        s.speed.tolist(),
        recording.t.tolist(),
        s.counts.tolist(),
        s.level.tolist(),
        strict=True,
    ):
        writer.writerow([trial, repr(speed), f"{t:.6f}", f"{counts:g}", repr(bend)])
    return file.getvalue()
