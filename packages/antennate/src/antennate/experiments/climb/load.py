"""What the motors of the pitch joints bear in a climb: torque, drive and current."""

from __future__ import annotations

from typing import Any

import numpy as np

from antennate.sim.world import World
from antennate.types import Floats

_FULL = 0.999
"""Share of the largest drive that counts as its limit."""


class PitchLoad:
    """The load of the pitch servos of a robot, summed over ticks.

    Torque of a motor is that of its drive less what speed takes on the torque-speed line
    (`robots.servos`), before friction; its current is as large a share of the stall current.

    Args:
        world: The robot.
    """

    def __init__(self, world: World) -> None:
        robot = world.robot
        self._at = robot.places("pitch")
        servo = robot.servo_of(robot.pitch)
        self._stall, self._slope = servo.stall_torque, servo.damping
        self._ampere = servo.stall_current / servo.stall_torque
        self._ticks = self._high = self._full = 0
        self._squares: Floats = np.zeros(robot.pitch_count)
        self._peak = 0.0

    def add(self, world: World) -> None:
        """Add a tick."""
        drive = world.drive_torques()[self._at]
        torque = abs(drive - self._slope * world.drive_speeds()[self._at])
        self._ticks += 1
        self._squares += torque**2
        self._high += bool((torque > 0.5 * self._stall).any())
        self._full += bool((abs(drive) > _FULL * self._stall).any())
        self._peak = max(self._peak, float(torque.max()))

    def columns(self) -> dict[str, Any]:
        """Columns of a row: RMS of the motor with the largest, peak, shares of time, current."""
        rms = float(np.sqrt(self._squares.max() / self._ticks))
        return {
            "torque_rms_n_m": round(rms, 6),
            "torque_peak_n_m": round(self._peak, 6),
            "above_half": round(self._high / self._ticks, 6),
            "saturated": round(self._full / self._ticks, 6),
            "current_rms_a": round(self._ampere * rms, 6),
        }
