"""A controller whose maneuvers come from keys or a gamepad, under the same supervisor as any other.

It holds while a reading cannot be used, as other controllers do, and when no key has come for a
while.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from antennate.control.controllers import RuleController
from antennate.control.readers import TELEOP, UNREAD, unread_by_all
from antennate.hardware.driving.config import DriveConfig
from antennate.params.base import paths_of
from antennate.params.control import ControlParams
from antennate.params.dead_man import DeadManParams
from antennate.params.setup import TeleopParams
from antennate.robots.readers import SIMULATION_ALONE, unused
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
        *SIMULATION_ALONE,
        "controller",
        *paths_of(DeadManParams, "dead_man"),
        *(f"control.{path}" for path in UNREAD[TELEOP]),
    )
    teleop: TeleopParams = TeleopParams()

    def unread_here(self) -> Mapping[str, str]:
        """What this robot does not have, and what its controller does not read."""
        return unused(self.robot) | unread_by_all([TELEOP], self.control, self.robot)


@dataclass
class Wishes:
    """What the keys ask for.

    Attributes:
        maneuver: The maneuver of the newest key.
        pressed_at: When its key came [s], by the host's clock.
        oscillating: The antennae oscillate.
    """

    maneuver: Maneuver = Maneuver.HOLD
    pressed_at: float = -math.inf
    oscillating: bool = False

    def press(self, key: str, now: float) -> None:
        """Take a key at a time [s]; a key without a meaning is ignored.

        Raises:
            KeyboardInterrupt: It ends the drive.
        """
        if key in QUIT:
            raise KeyboardInterrupt("a key" if key == "q" else "the end of the keys")
        if key in KEYS:
            self.maneuver, self.pressed_at = KEYS[key], now
        elif key == OSCILLATE:
            self.oscillating = not self.oscillating

    def now(self, now: float, patience: float) -> Maneuver:
        """The maneuver wanted at a time [s]; HOLD if the last key is older than `patience` [s]."""
        return self.maneuver if now - self.pressed_at <= patience else Maneuver.HOLD


class KeyRule:
    """The rule of a controller: the maneuver of the keys.

    Args:
        control: Numbers of the control.
        wanted: The maneuver that is wanted now.
    """

    def __init__(self, control: ControlParams, wanted: Callable[[], Maneuver]) -> None:
        self.turn_offset = control.gait.turn_offset
        self._wanted = wanted

    def reset(self, rows: Ints | Bools) -> None:
        """Do nothing: there is no memory."""

    def step(self, t: Floats, level: Floats, contact: Ints, flex: Floats) -> Ints:
        """The maneuver of the keys; HOLD where a reading cannot be used."""
        unknown = (contact == int(Contact.UNKNOWN)).any(axis=1)
        return np.where(unknown, int(Maneuver.HOLD), int(self._wanted()))


class KeyController:
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
        self._params, self._wishes = params, Wishes()
        self._keys, self._clock = keys, clock
        rule = KeyRule(control, lambda: self._wishes.now(clock(), params.release))
        self._walk = RuleController(rule, control, robot, 1)
        self._middle = control.gait.antenna_mean
        self._swing = 2.0 * math.pi * params.oscillation_frequency * control.period
        self._phase = 0.0

    @property
    def maneuver(self) -> Ints:
        """`Maneuver` of the last step, shape (1,)."""
        return self._walk.maneuver

    @property
    def contact(self) -> Ints:
        """`Contact` of each antenna in the last step, shape (1, 2)."""
        return self._walk.contact

    @property
    def level(self) -> Floats:
        """Bending level of each antenna in the last step, 0 to 1, shape (1, 2)."""
        return self._walk.level

    def reset(self, rows: Ints | Bools, phase: Floats | float = 0.0) -> None:
        """Forget everything and start the gait at a phase [rad]."""
        self._walk.reset(rows, phase)
        self._phase = 0.0

    def step(self, frame: AntennaFrame) -> JointCommand:
        """One control period: the command for this frame.

        Raises:
            KeyboardInterrupt: A key ends the drive.
        """
        for key in self._keys():
            self._wishes.press(key, self._clock())
        command = self._walk.step(frame)
        if self._wishes.oscillating:
            self._phase += self._swing
        angle = self._middle + self._params.oscillation_amplitude * math.sin(self._phase)
        return replace(command, antenna=np.full((1, 2), angle))
