"""Inputs of the supervisor that bring about each cause."""

from __future__ import annotations

import math
from typing import Any

from antennate.hardware.safety.causes import Cause
from antennate.hardware.safety.channel import Finding
from antennate.hardware.safety.supervisor import Outputs
from antennate.types import Contact

BAD: dict[Cause, dict[str, Any]] = {
    Cause.SPIKY: {"findings": (Finding.SPIKY, Finding.OK)},
    Cause.OUT_OF_CAL: {"findings": (Finding.OUT_OF_CAL, Finding.OK)},
    Cause.SATURATED: {"findings": (Finding.OK, Finding.SATURATED)},
    Cause.LATE_ANSWERS: {"missed": {3: 2}},
    Cause.SUPPLY_UNKNOWN: {"supply": math.nan},
    Cause.SUPPLY_WARN: {"supply": 10.7},
    Cause.STALE: {"age": 0.06, "valid": 0},
    Cause.REBOOT: {"resets": 1, "reset_reason": "WATCHDOG"},
    Cause.LOST: {"findings": (Finding.LOST, Finding.OK)},
    Cause.STUCK: {"findings": (Finding.STUCK, Finding.OK)},
    Cause.OPEN: {"findings": (Finding.OPEN, Finding.OK)},
    Cause.SHORT_LO: {"findings": (Finding.SHORT_LO, Finding.OK)},
    Cause.SHORT_HI: {"findings": (Finding.OK, Finding.SHORT_HI)},
    Cause.FAILED: {"failure": "ValueError: 3"},
    Cause.UNDECIDED: {"decided_at": 0.0},
    Cause.BAD_ACTION: {"maneuver": 5},
    Cause.BAD_COMMAND: {"bad_command": "expected a finite angle, found nan"},
    Cause.UNKNOWN_CONTACT: {"contact": (Contact.FREE, Contact.UNKNOWN)},
    Cause.NO_RECORD: {"unrecorded": True},
    Cause.SUPPLY_HOLD: {"supply": 10.1},
    Cause.SILENT_SERVO: {"missed": {3: 5, 11: 9}},
    Cause.SERVO_ERROR: {"servo_errors": {7: "overload"}},
    Cause.BUS_ERROR: {"bus_error": "port gone"},
    Cause.WATCHDOG: {"watchdogs": (4, 5)},
    Cause.DISARMED: {"disarmed": (6,)},
    Cause.NOT_FOLLOWING: {"behind": {9: "leg_r1 is 0.52 rad behind"}},
    Cause.OUT_OF_LIMITS: {"outside": {2: "yaw2 is 0.31 rad beyond its limit"}},
    Cause.IMPOSSIBLE_SPEED: {"leaps": {9: "leg_r1 has gone 6.28 rad in 10 ms"}},
    Cause.WRONG_MODE: {"modes": {2: "mode 1 where 3 is due"}},
    Cause.SUPPLY_OFF: {"supply": 9.5},
    Cause.NOT_READY: {"objections": ("the firmware is old",)},
    Cause.STOPPED: {"stop": True},
}
"""A change of healthy inputs that brings about each cause."""
SUPPLY = (Cause.SUPPLY_WARN, Cause.SUPPLY_HOLD, Cause.SUPPLY_OFF)


def causes(outputs: Outputs) -> set[Cause]:
    return {active.cause for active in outputs.causes}


def together(*bad: Cause) -> dict[str, Any]:
    """Changes for several causes at once; sides and ids are joined, the lowest supply counts."""
    merged: dict[str, Any] = {}
    for cause in bad:
        for key, value in BAD[cause].items():
            if key == "findings" and key in merged:
                theirs = [f for f in (*merged[key], *value) if f is not Finding.OK]
                merged[key] = (theirs[0], theirs[-1])
            elif key == "missed" and key in merged:
                merged[key] = merged[key] | value
            elif key == "supply" and key in merged:
                merged[key] = min(merged[key], value)
            else:
                merged[key] = value
    return merged


def possible(group: tuple[Cause, ...]) -> bool:
    """Whether one set of inputs can say it all: a supply that is unknown is not also low."""
    return Cause.SUPPLY_UNKNOWN not in group or not set(SUPPLY) & set(group)
