"""Recordings of a servo that follows goals: JSON of Rhoban/bam, and what they must be to serve.

Most of what is refused has units that are not SI.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from pydantic import model_validator

from antennate.errors import BadInputError
from antennate.files import decoded, read_limited
from antennate.messages import shown
from antennate.params.base import Params, number, require_default
from antennate.robots.servos import ServoName, ServoParams, ServosParams
from antennate.types import Bools, Floats
from dynamixel_bus.model import FULL_DRIVE, POSITION_UNIT

GRAVITY = 9.80665
FEWEST = 50
"""Fewest samples of a recording."""
_COARSEST = 0.02
"""A slow shaft is seen to move in finer steps than this [rad]: 4096 a turn make 0.0015."""
_SLOW_STEPS = 0.1
"""The share of all steps that a shaft makes when it is slow."""
_FASTEST = 5.0
"""No shaft is faster [no-load speeds]; a weight or twice the supply make less."""
_AT_LEAST = 0.05
"""Speeds are means over this time [s], so that jitter of the clock makes none."""
_LARGEST_GAP = 0.5
"""Samples lie closer together in time [s]."""
_SUPPLIES = (0.5, 2.0)
"""A supply lies between these [nominal voltages]."""
_HEAVIEST = 3.0
"""No weight pulls more [stall torques]."""
_SHORTEST = 1.0
"""Torque is on for longer [s]."""
_LARGEST_FILE = 100_000_000
SLOW = 0.05
"""A slower shaft rests [rad/s]."""
_LARGEST_NUMBER = 1e9
"""Nothing that is measured is larger."""
_NUMBERS = ("timestamp", "position", "goal_position")
_UNUSABLE = 65_536
"""A negative drive is told as one less than this many counts."""


class ServoConfig(Params):
    """Everything that decides the outcome of `antennate servo`."""

    unread: ClassVar[tuple[str, ...]] = tuple(
        f"servos.{name}.{what}"
        for name in ServosParams.model_fields
        for what in ("p_gain", "delay")
    )
    recording: tuple[str, ...] = number((), "1", "assumed: has to be named", metavar="FILE")
    """Recordings: JSON of Rhoban/bam, or logs of `drive` with --joint."""
    joint: str | None = number(None, "1", "assumed: has to be named if a recording is a log")
    """Joint of a log."""
    servo: ServoName = number(
        "xl330_m288", "1", "assumed: the model with a known recording", metavar="MODEL"
    )
    """Model of the servo, one of those in [servos]."""
    servos: ServosParams = ServosParams()
    mass: float | None = number(None, "kg", "assumed: as the recording says", ge=0)
    """Mass at the end of the arm; as the recording says if not given."""
    length: float | None = number(None, "m", "assumed: as the recording says", ge=0)
    """Length of the arm, which hangs down at 0 rad; as the recording says if not given."""
    inertia: float = number(0.0, "kg·m²", "assumed: only the mass and the servo", ge=0)
    """Inertia of the load beside that of the mass."""
    supply: float | None = number(None, "V", "assumed: as the recording says", gt=0)
    """Supply where a recording tells none, as no log does; nominal in a replay if not given."""
    fit: bool = number(False, "1", "assumed: a replay alone")
    """Identify the model from the recordings."""

    @property
    def given(self) -> ServoParams:
        """Parameters of the servo's model."""
        return self.servos.of(self.servo)

    @model_validator(mode="after")
    def _agree(self) -> ServoConfig:
        others = (f"servos.{name}" for name in ServosParams.model_fields if name != self.servo)
        require_default(self, f"the servo is {self.servo}", *others)
        return self


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
        useful &= abs(np.gradient(self.position, self.t)) < SLOW
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
    entries = table.get("entries")
    if not isinstance(entries, list):
        kind = type(entries).__name__ if "entries" in table else "none"
        raise BadInputError(f"{path}: expected a list `entries`, found {kind}")
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
        _header(path, table, "kp"),
        _header(path, table, "mass") if mass is None else mass,
        _header(path, table, "length") if length is None else length,
        t - t[0],
        position,
        goal,
        _torque(path, entries),
        np.ones(len(t), bool),
        _column(path, entries, "input_volts", math.nan),
        np.where(drive >= _UNUSABLE / 2, drive - _UNUSABLE, drive),
    )


def _header(path: Path, table: Mapping[str, Any], name: str) -> float:
    """A number beside the entries."""
    value = _number(table.get(name))
    if value is None or value < 0:
        raise BadInputError(
            f"{path}: expected a number {name} beside entries, found {_shown(table.get(name))}"
        )
    return value


def _number(value: Any) -> float | None:
    """A finite number, else None."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    return float(value) if abs(value) < _LARGEST_NUMBER else None


def _shown(value: Any) -> str:
    return "none" if value is None else shown(value)


def _column(path: Path, entries: list[Any], name: str, missing: float | None = None) -> Floats:
    """Numbers of all entries; `missing` where there is none."""
    numbers: list[float] = []
    for i, entry in enumerate(entries):
        cell = entry.get(name) if isinstance(entry, dict) else None
        value = missing if cell is None else _number(cell)
        if value is None:
            raise BadInputError(
                f"{path}: entry {i}: expected a finite number {name}, found {_shown(cell)}"
            )
        numbers.append(value)
    return np.array(numbers, float)


def _torque(path: Path, entries: list[Any]) -> Bools:
    """Whether torque was on at each entry."""
    for i, entry in enumerate(entries):
        if entry.get("torque_enable") not in (True, False):
            raise BadInputError(
                f"{path}: entry {i}: expected torque_enable, true or false, found "
                f"{shown(entry.get('torque_enable'))}; without it nobody knows when goals counted"
            )
    torque = np.array([bool(entry["torque_enable"]) for entry in entries])
    if not torque.any():
        raise BadInputError(f"{path}: expected torque_enable to be true once, found it nowhere")
    return torque


def check_course(path: Path, t: Floats, position: Floats, goal: Floats, servo: ServoParams) -> None:
    """Refuse times that do not rise or have gaps, and angles that cannot be radians."""
    steps = np.diff(t)
    if (steps <= 0).any():
        i = int(np.argmax(steps <= 0)) + 1
        cure = "keep one of the two" if steps[i - 1] == 0 else "sort the entries"
        raise BadInputError(
            f"{path}: entry {i}: expected timestamp to rise, found {t[i]:g} after {t[i - 1]:g}; "
            f"{cure}"
        )
    if steps.max() > _LARGEST_GAP:
        i = int(np.argmax(steps)) + 1
        raise BadInputError(
            f"{path}: entry {i}: expected samples less than {_LARGEST_GAP:g} s apart, found "
            f"{steps[i - 1]:g}; are times in seconds?"
        )
    moved = abs(np.diff(position))
    if not moved.any():
        raise BadInputError(f"{path}: expected a shaft that moves, found it at {position[0]:g}")
    slow = float(np.quantile(moved[moved > 0.0], _SLOW_STEPS))
    if slow > _COARSEST:
        raise BadInputError(
            f"{path}: expected positions in radians, whose smallest step is "
            f"{POSITION_UNIT:.4f}, found steps of {slow:.4g}; are these degrees or "
            "ticks?"
        )
    speed, most = _peak_speed(t, position), _FASTEST * servo.no_load_speed
    if speed > most:
        raise BadInputError(
            f"{path}: expected positions in radians of a shaft slower than {most:.3g} rad/s, "
            f"{_FASTEST:g} times the no-load speed, found {speed:.3g}; are these degrees or ticks?"
        )
    away = float(np.median(abs(goal - position)))
    if away > 2 * math.pi:
        raise BadInputError(
            f"{path}: expected goal_position in radians within a turn of position, found "
            f"{away:.4g} between them; are goals in degrees or ticks?"
        )


def _peak_speed(t: Floats, position: Floats) -> float:
    """Highest mean speed over a short time [rad/s]."""
    ahead = np.minimum(np.searchsorted(t, t + _AT_LEAST), len(t) - 1)
    return float(np.max(abs(position[ahead] - position) / np.maximum(t[ahead] - t, _AT_LEAST)))


def check_load(path: Path, p_gain: float, weight: float, servo: ServoParams) -> None:
    """Refuse a gain that moves nothing, and a weight [N·m] that no such servo could move."""
    if not p_gain > 0.0:
        raise BadInputError(
            f"{path}: expected a gain kp above 0, found {p_gain:g}; a servo without it follows "
            "nothing"
        )
    most = _HEAVIEST * servo.stall_torque
    if weight > most:
        raise BadInputError(
            f"{path}: expected a weight that pulls less than {most:.3g} N·m, {_HEAVIEST:g} times "
            f"the stall torque, found {weight:.3g}; is the mass in grams or the length in "
            "millimetres?"
        )


def check_supply(what: str, supply: Floats, servo: ServoParams) -> None:
    """Refuse a supply [V] that such a servo does not run on; NaN is not known."""
    low, high = (share * servo.voltage for share in _SUPPLIES)
    wrong = np.isfinite(supply) & ~((supply >= low) & (supply <= high))
    if wrong.any():
        raise BadInputError(
            f"{what}: expected {low:.3g} to {high:.3g} V, found {supply[np.argmax(wrong)]:g}; is "
            "it in tenths of a volt or in millivolts?"
        )


def check_torque(path: Path, t: Floats, torque: Bools) -> None:
    """Refuse a recording with hardly any torque."""
    on = float(np.diff(t)[torque[:-1]].sum())
    if on < _SHORTEST:
        raise BadInputError(
            f"{path}: expected torque for {_SHORTEST:g} s or longer, found it for {on:.3g} s"
        )
