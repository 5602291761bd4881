"""Recordings of servos: of the twin, and made by hand; and what `servo` finds in them."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import antennate
from antennate_lab.servo.result import ServoResult
from dynamixel_bus.model import POSITION_UNIT
from dynamixel_bus.models import MODELS_BY_NUMBER
from dynamixel_bus.servo import Servo

RATE = 250.0
"""Samples a second."""


def of_twin(path: Path, model: int, p_gain: int, amplitude: float, seconds: float = 6.0) -> Path:
    """A servo of the twin without load follows a sine that grows faster, as a recording."""
    table = MODELS_BY_NUMBER[model]
    servo = Servo(table, 1, 2048.0)
    for name, value in (
        ("return_delay_time", 0),
        ("position_p_gain", p_gain),
        ("torque_enable", 1),
    ):
        servo.set(name, value)
    entries: list[dict[str, Any]] = []
    for i in range(round(seconds * RATE)):
        t = i / RATE
        servo.advance(t)
        goal = amplitude * math.sin(2 * math.pi * (0.3 * t + 0.15 * t * t))
        ticks = round(goal / POSITION_UNIT)
        entries.append(
            {
                "timestamp": t,
                "position": (servo.get("present_position") - 2048) * POSITION_UNIT,
                "goal_position": ticks * POSITION_UNIT,
                "load": servo.get("present_pwm"),
                "input_volts": 0.1 * servo.get("present_input_voltage"),
                "torque_enable": True,
            }
        )
        servo.set("goal_position", 2048 + ticks)
    return written(path, entries, p_gain)


def written(path: Path, entries: list[dict[str, Any]], p_gain: float, **more: float) -> Path:
    """Entries as a file."""
    table = {"kp": p_gain, "mass": 0.0, "length": 0.0, **more, "entries": entries}
    path.write_text(json.dumps(table))
    return path


def found_of(*recordings: Path, **settings: Any) -> ServoResult:
    """The result of `servo` on recordings."""
    run = antennate.run("servo", recording=list(map(str, recordings)), **settings)
    return run.outcome.result()
