"""Columns of a recording, their units, and ohms and volts as counts of a robot's board.

A robot reads counts. A resistance becomes a voltage by the divider and a voltage becomes counts by
the converter, both of `antenna.sensor`: what the simulated antenna has.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, Literal

import numpy as np

from antennate.antenna.curves import Samples
from antennate.antenna.sensor import FULL_SCALE, divider, transfer_curve
from antennate.errors import CalibrationError
from antennate.params.base import Params, meaning, number
from antennate.robots.antenna import SensorParams
from antennate.studies.columns import tabular
from antennate.types import Bools, Floats, Ints

TRIAL, SPEED, TIME, READING, BEND = range(5)
"""Columns of a recording as it is read."""
BEND_UNITS = {"1": 1.0, "rad": 1.0, "deg": math.pi / 180.0, "m": 1.0, "mm": 1e-3}
SPEED_UNITS = {"m/s": 1.0, "cm/s": 0.01, "mm/s": 0.001}
_LARGEST_BEND = {"1": 1.05, "rad": 2 * math.pi, "deg": 360.0, "m": 1.0, "mm": 1000.0}
"""Beyond these a value was hardly meant in its unit."""
_LARGEST_SPEED = 1.0
"""Beyond it a speed was hardly meant in its unit [m/s]: nobody pushes an antenna faster."""
READING_UNITS = {"counts": 1.0, "ohm": 1.0, "kohm": 1e3, "V": 1.0, "mV": 1e-3}
_SAME = {"ω": "ohm", "ohms": "ohm", "kω": "kohm", "kohms": "kohm", "volt": "V", "volts": "V"}
"""Other names of units, in small letters; the sign for ohm is a small omega in these."""
_READ = {"ohm": ("divider_resistance", "supply", "reference"), "V": ("reference",)}
_RAIL_SHARE = 0.2
"""Share of voltages beyond what the converter tells apart that is too much."""
_STEP = 3.3 / FULL_SCALE
"""Volts of a count in sketches that compute them without the converter's curve [V]."""
_ON_STEPS = 0.02
"""Steps by which all volts may be off whole steps and still be such counts."""
_WINDOW = 5
"""Readings of whose median an outlier is off."""
_FAR, _FAR_OVER_NOISE = 0.3, 8.0
"""How far it is off at least: in spans of the readings, and in standard deviations of others."""
_FEWEST_COUNTS = 200.0
"""Numbers that are not whole and all below this are no counts."""
_BINS = 20


class RecordingParams(Params):
    """Columns and units of a recording."""

    time_column: str = number("time", "1", "assumed: plain")
    """Column of time."""
    time_unit: Literal["s", "ms", "us"] = number("s", "1", "assumed: SI")
    """Unit of time."""
    counts_column: str = number("counts", "1", "assumed: plain")
    """Column of readings."""
    reading_unit: Literal["counts", "ohm", "kohm", "V", "mV"] = number(
        "counts", "1", "assumed: what the board sends"
    )
    """Unit of readings; any but counts is converted by divider and converter of antenna.sensor."""
    bend_column: str = number("bend", "1", "assumed: plain")
    """Column of bend or position."""
    bend_unit: Literal["1", "rad", "deg", "m", "mm"] = number(
        "1", "1", "assumed: 0 straight, 1 full"
    )
    """Unit of bend or position."""
    bend_zero: float | None = number(None, "unit of bend", "assumed: its smallest value")
    """Value when straight."""
    bend_full: float | None = number(None, "unit of bend", "assumed: its largest value")
    """Value when fully bent."""
    trial_column: str = number("trial", "1", "assumed: plain")
    """Column that numbers pushes, if any."""
    speed_column: str = number("speed_m_s", "1", "assumed: plain")
    """Column of pushing speed, if any."""
    speed_unit: Literal["m/s", "cm/s", "mm/s"] = number("m/s", "1", "assumed: SI")
    """Unit of pushing speed."""
    most_lost: float = number(
        0.02, "1", "assumed: far more than the serial logs we have seen", ge=0, le=0.5
    )
    """Share of damaged rows, and of outliers, up to which they are left out and counted."""


@tabular
class Conversion:
    """How readings became counts."""

    unit: str
    """Unit of the readings."""
    how: str
    """Parts of the board that they went through."""
    values: dict[str, tuple[float, str, str]]
    """Parameters used, by name: value, unit and source."""


@tabular
class Outlier:
    """A reading far from the others around it."""

    row: int
    """Row of the file."""
    counts: float
    """The reading [counts]."""
    usual: float
    """Median of the readings at nearly the same bend [counts]."""


def unit_named(name: str) -> str:
    """A unit of READING_UNITS by any of its names, else the name itself."""
    small = name.lower()
    known = {unit.lower(): unit for unit in READING_UNITS} | {"mv": "mV", "v": "V"}
    return _SAME.get(small) or known.get(small, name)


def parameters_of(unit: str) -> tuple[str, ...]:
    """Parameters of `antenna.sensor` that readings in this unit need."""
    return _READ["ohm"] if unit in ("ohm", "kohm") else _READ["V"] if unit in ("V", "mV") else ()


def expectation(place: int, value: float, name: str, params: RecordingParams) -> str:
    """What was expected of a number that its unit hardly allows, empty if it does."""
    unit, flag, wanted = params.reading_unit, "reading-unit", ""
    if place == READING:
        wanted = _reading_range(unit, value)
    elif place == SPEED:
        unit, flag = params.speed_unit, "speed-unit"
        if abs(value) * SPEED_UNITS[unit] > _LARGEST_SPEED:
            wanted = f"speeds up to {_LARGEST_SPEED:g} m/s in {name}"
    elif place == BEND:
        unit, flag = params.bend_unit, "bend-unit"
        if abs(value) > _LARGEST_BEND[unit]:
            wanted = f"at most {_LARGEST_BEND[unit]:g} in {name}"
    if not wanted:
        return ""
    return f"expected {wanted}, found {value:g}; is {unit} the right --columns.{flag}?"


def _reading_range(unit: str, value: float) -> str:
    """The readings that a unit allows, if this one is none of them; else empty."""
    if unit == "counts":
        return "" if 0 <= value <= FULL_SCALE else f"0 to {FULL_SCALE} counts"
    if unit in ("ohm", "kohm"):
        return "" if value > 0 else f"a resistance above 0 {unit}"
    return "" if value >= 0 else f"0 {unit} or more, as the board's converter reads no less"


def to_counts(
    path: Path, unit: str, values: Floats, rows: Ints, sensor: SensorParams
) -> tuple[Floats, Conversion | None]:
    """Readings in a unit as counts, and how they became counts; None if they are."""
    if unit == "counts":
        _require_counts(path, values, rows)
        return values, None
    si = READING_UNITS[unit] * values
    corners, readings = transfer_curve(sensor)
    used = {name: _parameter(sensor, name) for name in parameters_of(unit)}
    volts = divider(sensor, si) if unit in ("ohm", "kohm") else si
    steps = volts / _STEP
    if unit == "V" and len(np.unique(volts)) > _WINDOW:
        whole = np.abs(steps - np.round(steps)) < _ON_STEPS
        if whole.all() and steps.max() <= FULL_SCALE + 0.5:
            how = f"steps of 3.3 V / {FULL_SCALE}: they were counts and are taken as such"
            return np.round(steps), Conversion(unit=unit, how=how, values={})
    apart = (volts > corners[0]) & (volts < corners[-1])
    if (~apart).mean() > _RAIL_SHARE:
        low, high = values.min(), values.max()
        cure = "does --antenna.sensor.divider-resistance fit?"
        cure = cure if unit.endswith("ohm") else "does it need another gain?"
        raise CalibrationError(
            f"{path}: expected voltages of {corners[0]:.3g} to {corners[-1]:.3g} V at the "
            f"converter, which it tells apart, found {volts.min():.3g} to {volts.max():.3g} V from "
            f"{low:.4g} to {high:.4g} {unit}; is {unit} the right --columns.reading-unit, and "
            f"{cure}"
        )
    how = "the divider and the board's converter" if len(used) > 1 else "the board's converter"
    how += f", {(~apart).sum()} of them held at an end of its range" if not apart.all() else ""
    counts = np.clip(np.interp(volts, corners, readings), 0.0, FULL_SCALE)
    return counts, Conversion(unit=unit, how=how, values=used)


def _parameter(sensor: SensorParams, name: str) -> tuple[float, str, str]:
    """Value, unit and source of a number of the sensor; the source is `given` if a user set it."""
    field, value = SensorParams.model_fields[name], float(getattr(sensor, name))
    extra: Any = field.json_schema_extra
    return value, str(extra["unit"]), str(extra["source"]) if value == field.default else "given"


def conversion_sentence(conversion: Conversion) -> str:
    """How readings became counts, in a sentence."""
    if not conversion.values:
        return f"Readings in {conversion.unit} come in {conversion.how}."
    values = ", ".join(
        f"{meaning(SensorParams, name, unit=False)} {value:g} {unit} ({source})"
        for name, (value, unit, source) in conversion.values.items()
    )
    return f"Readings in {conversion.unit} became counts by {conversion.how}: {values}."


def _require_counts(path: Path, values: Floats, rows: Ints) -> None:
    """Refuse numbers that are no counts: they are small and not whole."""
    low, high = np.percentile(values, [1, 99])
    if high < _FEWEST_COUNTS and (values != np.round(values)).mean() > 0.5:
        raise CalibrationError(
            f"{path}: row {rows[0]}: expected counts, whole numbers of 0 to {FULL_SCALE}, found "
            f"{low:.4g} to {high:.4g}; are these volts or kilohms? --columns.reading-unit is one "
            f"of {', '.join(READING_UNITS)}"
        )


def outliers(samples: Samples) -> Bools:
    """Readings far from those around them in time and at the same bend, shape (n,).

    A serial line that loses a digit makes 41 of 416. Such a reading is off the median of five in a
    row of its trial, and off the median of those at its bend, by 0.3 spans and by eight standard
    deviations of what the others are off.
    """
    counts = samples.counts
    low, high = np.percentile(counts, [1, 99])
    off = counts - _running_median(counts, samples.trial)
    noise = 1.4826 * float(np.median(abs(off[off != 0]))) if (off != 0).any() else 0.0
    far = abs(off) > max(_FAR * (high - low), _FAR_OVER_NOISE * noise)
    return far & (abs(counts - usual(samples)) > _FAR * (high - low))


def _running_median(counts: Floats, trial: Ints) -> Floats:
    medians = counts.copy()
    for push in np.unique(trial):
        rows = np.flatnonzero(trial == push)
        if len(rows) < _WINDOW:
            continue
        windows = np.lib.stride_tricks.sliding_window_view(counts[rows], _WINDOW)
        half = _WINDOW // 2
        middle = np.median(windows, axis=1)
        medians[rows] = np.concatenate([np.repeat(middle[0], half), middle, [middle[-1]] * half])
    return medians


def usual(samples: Samples) -> Floats:
    """Median of the readings at nearly the same bend, for each reading, shape (n,)."""
    edges = np.quantile(samples.level, np.linspace(0, 1, _BINS + 1)[1:-1])
    place = np.digitize(samples.level, edges)
    medians = np.zeros_like(samples.counts)
    for part in np.unique(place):
        medians[place == part] = np.median(samples.counts[place == part])
    return medians
