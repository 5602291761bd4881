"""Which values a servo takes: the ranges of the manual, and limits by other registers."""

from __future__ import annotations

import math

from antennate.hardware.dynamixel.packets import StatusError
from antennate.hardware.dynamixel.tables import (
    CURRENT_POSITION_MODE,
    EXTENDED_MODE,
    GOALS,
    TIME_BASED,
    Register,
)
from antennate.robots.servos import MOST_TICKS
from antennate.twin.memory import Memory

TRIPPED = -1
"""Value of a bus watchdog that has stopped the servo."""
_UNUSED_DRIVE_MODE = 2
_VOLTAGE_ERROR, _HEAT_ERROR = 1, 4
"""Bits of Hardware Error Status."""
_LIMITS = {
    "goal_velocity": "velocity_limit",
    "goal_pwm": "pwm_limit",
    "goal_current": "current_limit",
    "profile_velocity": "velocity_limit",
}


def refuses(memory: Memory, register: Register, value: int) -> StatusError:
    """Why a value cannot be written, NONE if it can."""
    name = register.name
    locked = name in GOALS or (name == "bus_watchdog" and value != 0)
    if locked and memory.get("bus_watchdog") == TRIPPED:
        return StatusError.DATA_RANGE
    least, most = _limits(memory, name)
    if not least <= value <= most:
        return StatusError.DATA_LIMIT
    if not _in_range(memory, register, value):
        return StatusError.DATA_RANGE
    if name == "torque_enable" and value and shut_down(memory):
        return StatusError.RESULT_FAIL
    return StatusError.NONE


def shut_down(memory: Memory) -> bool:
    """An error that Shutdown selects has taken its torque; only a restart gives it back."""
    return bool(memory.get("hardware_error_status") & memory.get("shutdown"))


def beyond_limits(memory: Memory) -> int:
    """Errors that are new because supply or temperature are beyond their limits, as bits."""
    get, bits = memory.get, 0
    if not get("min_voltage_limit") <= get("present_input_voltage") <= get("max_voltage_limit"):
        bits |= _VOLTAGE_ERROR
    if get("present_temperature") > get("temperature_limit"):
        bits |= _HEAT_ERROR
    return bits & ~get("hardware_error_status")


def _in_range(memory: Memory, register: Register, value: int) -> bool:
    """The table of the manual allows the value."""
    if register.name == "operating_mode":
        return value in memory.table.modes
    if register.name == "drive_mode" and value & _UNUSED_DRIVE_MODE:
        return False
    if register.name == "protocol_type" and 2 < value < 20:
        return False
    low, high = register.low, register.high
    return (low is None or value >= low) and (high is None or value <= high)


def _limits(memory: Memory, name: str) -> tuple[float, float]:
    """Bounds of a goal by another register."""
    if name == "goal_position":
        if memory.get("operating_mode") in (EXTENDED_MODE, CURRENT_POSITION_MODE):
            return -MOST_TICKS, MOST_TICKS
        return memory.get("min_position_limit"), memory.get("max_position_limit")
    if name not in _LIMITS or (name == "profile_velocity" and time_based(memory)):
        return -math.inf, math.inf
    bound = memory.get(_LIMITS[name])
    return -bound, bound


def time_based(memory: Memory) -> bool:
    """Profile registers are times [ms]."""
    return bool(memory.get("drive_mode") & TIME_BASED)
