"""A controller whose maneuvers come from keys or a gamepad, under the same supervisor as any other.

It holds while a reading cannot be used, as other controllers do, and when no key has come for a
while.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import ClassVar

import numpy as np

from antennate.control.controllers import RuleController
from antennate.control.readers import TELEOP, UNDRIVEN, UNREAD
from antennate.hardware.driving.config import DriveConfig
from antennate.params.base import paths_of
from antennate.params.control import ControlParams
from antennate.params.hardware import DeadManParams, TeleopParams
from antennate.robots.spec import RobotSpec
from antennate.types import AntennaFrame, Bools, Contact, Floats, Ints, JointCommand, Maneuver

KEYS = {
    "up": Maneuver.FORWARD,
    "w": Maneuver.FORWARD,
    "left": Maneuver.TURN_L,
    "a": Maneuver.TURN_L,
    "right": Maneuver.TURN_R,
    "d": Maneuver.TURN_R,
    "down": Maneuver.REVERSE,
    "s": Maneuver.REVERSE,
    " ": Maneuver.HOLD,
}
"""Maneuvers by key."""
OSCILLATE = "o"
"""The key that starts the oscillation of the antennae, and stops it."""


QUIT = ("q", "end")
"""Keys that end the drive; `end` stands for the end of the input."""


class TeleopConfig(DriveConfig):
    """The configuration of `drive`, and the numbers of teleoperation; `controller` is not used."""

    unread: ClassVar[tuple[str, ...]] = (
        *UNDRIVEN,
        "controller",
        *paths_of(DeadManParams, "dead_man"),
        *(f"control.{path}" for path in UNREAD[TELEOP]),
    )
    teleop: TeleopParams = TeleopParams()

    @property
    def reader(self) -> str:
        """What reads the numbers of the control."""
        return TELEOP


class KeyRule:
    """The rule of a controller: the maneuver of the keys.

    Attributes:
        wanted: That maneuver, of the newest key if it came a short time ago.
    """

    def __init__(self, control: ControlParams) -> None:
        self.turn_offset = control.gait.turn_offset
        self.wanted = Maneuver.HOLD

    def reset(self, rows: Ints | Bools) -> None:
        """Do nothing: there is no memory."""

    def step(self, t: Floats, level: Floats, contact: Ints, flex: Floats) -> Ints:
        """The maneuver of the keys; HOLD where a reading cannot be used."""
        unknown = (contact == int(Contact.UNKNOWN)).any(axis=1)
        return np.where(unknown, int(Maneuver.HOLD), int(self.wanted))


class KeyController(RuleController):
    """The controller of one robot by keys.

    Args:
        control: Numbers of the control.
        robot: The robot.
        params: How long a key lasts, how the antennae oscillate.
        keys: Keys that have come since the last call.
        clock: The host's time [s].
    """

    def __init__(
        self,
        control: ControlParams,
        robot: RobotSpec,
        params: TeleopParams,
        keys: Callable[[], list[str]],
        clock: Callable[[], float],
    ) -> None:
        self._by_keys = KeyRule(control)
        super().__init__(self._by_keys, control, robot, 1)
        self._params, self._keys, self._clock = params, keys, clock
        self._asked, self._pressed_at = Maneuver.HOLD, -math.inf
        self._oscillating = False
        self._middle = control.gait.antenna_mean
        self._swing = 2.0 * math.pi * params.oscillation_frequency * control.period
        self._phase = 0.0

    def reset(self, rows: Ints | Bools, phase: Floats | float = 0.0) -> None:
        """Forget everything and start the gait at a phase [rad]."""
        super().reset(rows, phase)
        self._phase = 0.0

    def step(self, frame: AntennaFrame) -> JointCommand:
        """One control period: the command for this frame.

        Raises:
            KeyboardInterrupt: A key ends the drive.
        """
        for key in self._keys():
            self._press(key)
        recent = self._clock() - self._pressed_at <= self._params.release
        self._by_keys.wanted = self._asked if recent else Maneuver.HOLD
        command = super().step(frame)
        if self._oscillating:
            self._phase += self._swing
        angle = self._middle + self._params.oscillation_amplitude * math.sin(self._phase)
        return replace(command, antenna=np.full((1, 2), angle))

    def _press(self, key: str) -> None:
        """Take a key; one without a meaning is ignored."""
        if key in QUIT:
            raise KeyboardInterrupt("a key" if key == "q" else "the end of the keys")
        if key in KEYS:
            self._asked, self._pressed_at = KEYS[key], self._clock()
        elif key == OSCILLATE:
            self._oscillating = not self._oscillating
