"""Recordings of a servo that follows goals: JSON of Rhoban/bam."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from antennate.dxl.model import FULL_DRIVE, POSITION_UNIT
from antennate.errors import BadInputError
from antennate.experiments.servo.checks import FEWEST, GRAVITY, check_course
from antennate.experiments.servo.fitting import Data
from antennate.files import decoded, read_limited
from antennate.messages import shown
from antennate.robots.servos import STEP, Course, ServoParams
from antennate.types import Bools, Floats

_LARGEST_FILE = 100_000_000
_SLOW = 0.05
"""A slower shaft rests [rad/s]."""
_SMOOTHING = 0.05
"""Speeds are means over this time [s]."""
_LARGEST_NUMBER = 1e9
"""Nothing that is measured is larger."""
_NUMBERS = ("timestamp", "position", "goal_position")
_UNUSABLE = 65_536
"""A negative drive is told as one less than this many counts."""


@dataclass(frozen=True)
class Recording:
    """One recording.

    Attributes:
        name: Name of the file.
        sha256: Hash of its bytes.
        p_gain: Gain of the position loop as its register held it.
        mass: Mass at the end of the arm [kg], `length` the length of the arm [m].
        t: Times [s], shape (n,), from 0.
        position: Positions [rad], shape (n,), `goal` the goals.
        torque: Whether torque was on, shape (n,).
        known: Whether it is known what the servo was told, shape (n,).
        supply: Supply [V], NaN where it is not known, shape (n,).
        drive: Drive [counts], NaN where it is not known, shape (n,).
    """

    name: str
    sha256: str
    p_gain: float
    mass: float
    length: float
    t: Floats
    position: Floats
    goal: Floats
    torque: Bools
    known: Bools
    supply: Floats
    drive: Floats

    def divisor(self) -> float | None:
        """What its drive says of the divisor of the gain; None if nothing.

        That is the median of gain times position error over the drive, at rest and well within
        full drive.
        """
        error = (self.goal - self.position) / POSITION_UNIT
        size = abs(self.drive)
        useful = self.torque & (size > 0.05 * FULL_DRIVE) & (size < 0.9 * FULL_DRIVE)
        useful &= abs(np.gradient(self.position, self.t)) < _SLOW
        if useful.sum() < FEWEST // 2:
            return None
        return float(np.median(self.p_gain * error[useful] / self.drive[useful]))


def read(
    path: Path, servo: ServoParams, mass: float | None = None, length: float | None = None
) -> Recording:
    """Read a recording.

    Args:
        path: The file.
        servo: The servo that it is taken for.
        mass: Mass at the end of the arm [kg]; None for what the file says.
        length: Length of the arm [m]; None for what the file says.

    Raises:
        BadInputError: It cannot be used; says where and why.
    """
    data = read_limited(path, _LARGEST_FILE)
    try:
        table = json.loads(decoded(path, data))
    except json.JSONDecodeError as error:
        raise BadInputError(
            f"{path}: expected JSON, found an error at line {error.lineno}, column {error.colno} "
            f"({error.msg}); is the file truncated? JSON and logs (.mcap) are read"
        ) from None
    except RecursionError:
        raise BadInputError(f"{path}: expected JSON of a recording, found it too deep") from None
    if not isinstance(table, dict):
        kind = type(table).__name__
        raise BadInputError(f"{path}: expected an object with a list `entries`, found a {kind}")
    if not isinstance(table.get("entries"), list):
        kind = type(table["entries"]).__name__ if "entries" in table else "none"
        raise BadInputError(f"{path}: expected a list `entries`, found {kind}")
    entries = table["entries"]
    if len(entries) < FEWEST:
        raise BadInputError(
            f"{path}: entries: expected at least {FEWEST}, found {len(entries)}; record longer"
        )
    t, position, goal = (_column(path, entries, name) for name in _NUMBERS)
    check_course(path, t, position, goal, servo)
    drive = _column(path, entries, "load", math.nan)
    return Recording(
        path.name,
        hashlib.sha256(data).hexdigest(),
        _of_table(path, table, "kp"),
        _of_table(path, table, "mass") if mass is None else mass,
        _of_table(path, table, "length") if length is None else length,
        t - t[0],
        position,
        goal,
        _torque(path, entries),
        np.ones(len(t), bool),
        _column(path, entries, "input_volts", math.nan),
        np.where(drive >= _UNUSABLE / 2, drive - _UNUSABLE, drive),
    )


def _of_table(path: Path, table: Mapping[str, Any], name: str) -> float:
    value = _number(table.get(name))
    if value is None or value < 0:
        raise BadInputError(
            f"{path}: expected a number {name} beside entries, found {_found(table.get(name))}"
        )
    return value


def _number(value: Any) -> float | None:
    """A finite number, else None."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    return float(value) if abs(value) < _LARGEST_NUMBER else None


def _found(value: Any) -> str:
    return "none" if value is None else shown(value)


def _column(path: Path, entries: list[Any], name: str, missing: float | None = None) -> Floats:
    """Numbers of all entries; `missing` where there is none."""
    found: list[float] = []
    for i, entry in enumerate(entries):
        cell = entry.get(name) if isinstance(entry, dict) else None
        value = missing if cell is None else _number(cell)
        if value is None:
            raise BadInputError(
                f"{path}: entry {i}: expected a finite number {name}, found {_found(cell)}"
            )
        found.append(value)
    return np.array(found, float)


def _torque(path: Path, entries: list[Any]) -> Bools:
    for i, entry in enumerate(entries):
        if entry.get("torque_enable") not in (True, False):
            raise BadInputError(
                f"{path}: entry {i}: expected torque_enable, true or false, found "
                f"{shown(entry.get('torque_enable'))}; without it nobody knows when goals counted"
            )
    found = np.array([bool(entry["torque_enable"]) for entry in entries])
    if not found.any():
        raise BadInputError(f"{path}: expected torque_enable to be true once, found it nowhere")
    return found


def data_of(recordings: list[Recording], voltage: float, inertia: float) -> Data:
    """All recordings as one course, each ends in times that do not count.

    Args:
        recordings: F recordings.
        voltage: Nominal voltage of the servo [V]; taken where a supply is not known.
        inertia: Inertia of the loads beside that of their masses [kg·m²].
    """
    longest = max(r.t[-1] for r in recordings)
    grid = np.arange(math.floor(longest / STEP + 1e-9) + 1) * STEP
    held = [
        np.clip(np.searchsorted(r.t, grid + STEP / 2, "right") - 1, 0, None) for r in recordings
    ]
    pairs = list(zip(recordings, held, strict=True))
    position = np.array([np.interp(grid, r.t, r.position) for r in recordings]).T
    course = Course(
        goal=np.array([r.goal[i] for r, i in pairs]).T,
        torque=np.array([r.torque[i] for r, i in pairs]).T,
        supply=np.array([np.nan_to_num(r.supply[i] / voltage, nan=1.0) for r, i in pairs]).T,
        position=position,
        speed=_speed(position),
        p_gain=np.array([r.p_gain for r in recordings]),
        inertia=np.array([r.mass * r.length**2 + inertia for r in recordings]),
        gravity=np.array([r.mass * GRAVITY * r.length for r in recordings]),
    )
    return Data(course, np.array([r.known[i] & (grid <= r.t[-1]) for r, i in pairs]).T)


def _speed(position: Floats) -> Floats:
    """Speeds [rad/s] of positions (T, F), smoothed."""
    width = round(_SMOOTHING / STEP)
    kernel = np.ones(width) / width
    slopes = np.gradient(position, STEP, axis=0)
    return np.array([np.convolve(column, kernel, "same") for column in slopes.T]).T
