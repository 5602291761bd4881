"""How servos have to be set before any of them gets torque: one rule for drive and doctor.

Drive Mode has to be 0: the robot's `directions` mirror joints, and bit 3 would let a goal bring
torque. With a homing offset a watchdog makes a servo in extended mode move, and zeros are not what
its description says. Position and velocity limits have to leave room for what is asked for; rolling
legs are in extended mode, where position limits do not act.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

from antennate.dxl.model import POSITION_UNIT, TICKS_A_TURN, VELOCITY_UNIT
from antennate.dxl.models import MODELS_BY_NUMBER
from antennate.robots.spec import RobotSpec

_ROOM = 1.25
"""Profile velocity by the fastest that goals move, so that a joint that lags catches up
(assumed)."""


class Setting(NamedTuple):
    """What a register may hold, and the value to set if it holds another."""

    low: int
    high: int
    cure: int

    def allows(self, value: int) -> bool:
        """The value may stay."""
        return self.low <= value <= self.high

    def __str__(self) -> str:
        if self.low == self.high:
            return str(self.low)
        return f"at most {self.high}" if self.cure == self.low else f"at least {self.low}"


def settings(robot: RobotSpec) -> Mapping[str, Mapping[int, Setting]]:
    """By register and id, in the order in which they are set."""
    zero = dict.fromkeys(robot.ids, Setting(0, 0, 0))
    low, high = _position_limits(robot)
    return {
        "operating_mode": {i: Setting(m, m, m) for i, m in robot.modes.items()},
        "drive_mode": zero,
        "homing_offset": zero,
        "velocity_limit": _velocity_limits(robot),
        "max_position_limit": high,
        "min_position_limit": low,
    }


def profile_velocities(robot: RobotSpec) -> dict[int, int]:
    """Profile velocity by id [0.229 rev/min]: `fastest` of its group with some room."""
    limits = {
        i: MODELS_BY_NUMBER[model]["velocity_limit"].default or 0
        for i, model in robot.models.items()
    }
    return {
        servo: min(math.ceil(_ROOM * fastest / VELOCITY_UNIT), limits[servo])
        for servo, fastest in zip(robot.ids, robot.fastest, strict=True)
    }


def wrong(known: Mapping[str, Mapping[int, int]], robot: RobotSpec) -> list[str]:
    """What is not as it has to be, in words, of values by register and id."""
    faults: dict[str, list[int]] = {}
    for name, wanted in settings(robot).items():
        for servo, setting in wanted.items():
            value = known[name][servo]
            if not setting.allows(value):
                what = f"{name.replace('_', ' ')} {value} (expected {setting}) in servos"
                faults.setdefault(what, []).append(servo)
    return [f"{what} {ids}" for what, ids in faults.items()]


def _velocity_limits(robot: RobotSpec) -> dict[int, Setting]:
    """A servo refuses a profile that is faster than its velocity limit."""
    velocities = profile_velocities(robot)
    limits = {
        servo: MODELS_BY_NUMBER[robot.models[servo]]["velocity_limit"] for servo in velocities
    }
    return {
        servo: Setting(least, limits[servo].high or 0, limits[servo].default or 0)
        for servo, least in velocities.items()
    }


def _position_limits(robot: RobotSpec) -> tuple[dict[int, Setting], dict[int, Setting]]:
    """Smallest and largest position limits, of joints that do not turn without end."""
    low: dict[int, Setting] = {}
    high: dict[int, Setting] = {}
    for servo, zero, limit in zip(robot.ids, robot.zeros, robot.limits, strict=True):
        if math.isfinite(limit):
            reach, last = limit / POSITION_UNIT, TICKS_A_TURN - 1
            low[servo] = Setting(0, max(round(zero - reach), 0), 0)
            high[servo] = Setting(min(round(zero + reach), last), last, last)
    return low, high
