"""What a recording of a servo must be to say something; most of it finds units that are not SI."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from antennate.dxl.model import POSITION_UNIT
from antennate.errors import BadInputError
from antennate.robots.servos import ServoParams
from antennate.types import Bools, Floats

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


def check_course(path: Path, t: Floats, position: Floats, goal: Floats, servo: ServoParams) -> None:
    """Refuse times that do not rise or have gaps, and angles that cannot be radians.

    Raises:
        BadInputError: Says where and why.
    """
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
    """Refuse a gain that moves nothing, and a weight [N·m] that no such servo could move.

    Raises:
        BadInputError: Says what was found.
    """
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
    """Refuse a supply [V] that such a servo does not run on; NaN is not known.

    Raises:
        BadInputError: Says of what, and why.
    """
    low, high = (share * servo.voltage for share in _SUPPLIES)
    wrong = np.isfinite(supply) & ~((supply >= low) & (supply <= high))
    if wrong.any():
        raise BadInputError(
            f"{what}: expected {low:.3g} to {high:.3g} V, found {supply[np.argmax(wrong)]:g}; is "
            "it in tenths of a volt or in millivolts?"
        )


def check_torque(path: Path, t: Floats, torque: Bools) -> None:
    """Refuse a recording with hardly any torque.

    Raises:
        BadInputError: Says how long it was on.
    """
    on = float(np.diff(t)[torque[:-1]].sum())
    if on < _SHORTEST:
        raise BadInputError(
            f"{path}: expected torque for {_SHORTEST:g} s or longer, found it for {on:.3g} s"
        )
