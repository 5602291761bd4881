"""Columns of a recording: their names, their units, and what is possible in these."""

from __future__ import annotations

import math
from typing import Literal

from antennate.experiments.calibrate import readings
from antennate.params.base import Params, number

BEND_UNITS = {"1": 1.0, "rad": 1.0, "deg": math.pi / 180.0, "m": 1.0, "mm": 1e-3}
SPEED_UNITS = {"m/s": 1.0, "cm/s": 0.01, "mm/s": 0.001}
_LARGEST_BEND = {"1": 1.05, "rad": 2 * math.pi, "deg": 360.0, "m": 1.0, "mm": 1000.0}
"""Beyond these a value was hardly meant in its unit."""
_LARGEST_SPEED = 1.0
"""Beyond it a speed was hardly meant in its unit [m/s]: nobody pushes an antenna faster."""
TRIAL, SPEED, TIME, READING, BEND = range(5)
"""Columns of a recording as it is read."""


class RecordingParams(Params):
    """Columns and units of a recording."""

    time_column: str = number("time", "1", "assumed: plain")
    """Column of time."""
    time_unit: Literal["s", "ms", "us"] = number("s", "1", "assumed: SI")
    """Its unit."""
    counts_column: str = number("counts", "1", "assumed: plain")
    """Column of readings."""
    reading_unit: Literal["counts", "ohm", "kohm", "V", "mV"] = number(
        "counts", "1", "assumed: what the board sends"
    )
    """Its unit; others become counts by the divider and converter of antenna.sensor."""
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
    """Column of pushing speed, if any."""
    speed_unit: Literal["m/s", "cm/s", "mm/s"] = number("m/s", "1", "assumed: SI")
    """Its unit."""
    most_lost: float = number(
        0.02, "1", "assumed: far more than the serial logs we have seen", ge=0, le=0.5
    )
    """Share of damaged rows, and of outliers, up to which they are left out and counted."""


def impossible(place: int, value: float, name: str, params: RecordingParams) -> str:
    """What was expected of a number that its unit hardly allows, empty if it does."""
    unit, flag, wanted = params.reading_unit, "reading-unit", ""
    if place == READING:
        wanted = readings.impossible(unit, value)
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
