"""Angles of joints to positions of servos and back."""

from __future__ import annotations

import math

import numpy as np

from antennate.errors import AntennateError
from antennate.hardware import roster
from antennate.hardware.settings import profile_velocities
from antennate.robots.anatomy import LINK_COUNT, YAW_COUNT
from antennate.robots.layout import MOST_TICKS, TICKS_A_TURN, LayoutParams
from antennate.types import Floats, Ints, JointCommand

_STEP = 2.0 * math.pi / TICKS_A_TURN
_SHAPES = {"yaw": (1, YAW_COUNT), "leg": (1, LINK_COUNT, 2), "antenna": (1, 2)}


class CommandError(AntennateError):
    """A command that no servo must be sent."""


class Joints:
    """The 19 joints of one robot in the order yaws, legs, antennae.

    Attributes:
        ids: Ids of their servos.
        models: Model numbers by id.
        profiles: Profile velocities by id [0.229 rev/min], above what goals are moved at.
        in_order_of_release: Ids of the groups in the order in which they lose their torque.
    """

    def __init__(self, layout: LayoutParams) -> None:
        self.ids = layout.ids
        self.models = roster.models(layout)
        self.profiles = profile_velocities(layout)
        self.in_order_of_release = layout.in_order_of_release
        self._sign: Floats = np.array(layout.directions, float)
        self._zero: Floats = np.array(layout.zeros, float)
        self._limit: Floats = np.array(layout.limits)
        self._fastest: Floats = np.array(layout.fastest)

    def ticks(self, command: JointCommand) -> Ints:
        """Goal positions [ticks] of a command of one robot, shape (19,).

        Raises:
            CommandError: It is not of one robot, not finite, or beyond a limit or what servos
                count. It is refused as a whole.
        """
        angles = _angles(command)
        with np.errstate(over="ignore"):  # infinite then, and refused
            ticks = np.rint(self.positions(angles))
        turning = np.isinf(self._limit)
        counted = np.where(turning, abs(ticks) <= MOST_TICKS, (ticks >= 0) & (ticks < TICKS_A_TURN))
        bad = ~counted | (abs(angles) > self._limit)
        if bad.any():
            first = int(np.argmax(bad))
            within = "256 turns" if turning[first] else f"{self._limit[first]:.4g} rad"
            raise CommandError(
                f"expected a finite angle within {within} for servo {self.ids[first]}, found "
                f"{angles[first]}"
            )
        return ticks.astype(np.int64)

    def reach(self, time: float) -> Floats:
        """Ticks that each joint may go in a time [s], shape (19,)."""
        return self._fastest * time / _STEP

    def align(self, ticks: Ints | Floats, command: JointCommand) -> None:
        """Count whole turns of legs so that a command is nearest to where they stand [ticks]."""
        away = (ticks - self.ticks(command))[YAW_COUNT:-2]
        self._zero[YAW_COUNT:-2] += TICKS_A_TURN * np.rint(away / TICKS_A_TURN)

    def shift(self, at: int, ticks: float) -> None:
        """Count the position of the joint at a place in `ids` from elsewhere by some ticks."""
        self._zero[at] += ticks

    def positions(self, angles: Floats) -> Floats:
        """Positions, not rounded [ticks], of joint angles [rad], both of shape (19,)."""
        return np.asarray(self._zero + self._sign * angles / _STEP)

    def command(self, ticks: Ints | Floats) -> JointCommand:
        """The command of one robot at these positions [ticks], shape (19,)."""
        angles: Floats = (ticks - self._zero) * self._sign * _STEP
        legs = angles[YAW_COUNT:-2].reshape(1, LINK_COUNT, 2)
        return JointCommand(yaw=angles[None, :YAW_COUNT], leg=legs, antenna=angles[None, -2:])


def plain(command: JointCommand) -> JointCommand:
    """A copy of the command of one robot, which nobody else changes; it may have been anything.

    Raises:
        CommandError: It is not of one robot.
    """
    return JointCommand(**{name: _part(command, name, shape) for name, shape in _SHAPES.items()})


def _angles(command: JointCommand) -> Floats:
    """Its joint angles [rad], shape (19,)."""
    return np.concatenate([_part(command, name, shape).ravel() for name, shape in _SHAPES.items()])


def _part(command: JointCommand, name: str, shape: tuple[int, ...]) -> Floats:
    try:
        part = np.array(getattr(command, name), float)
    except KeyboardInterrupt:
        raise
    except BaseException:  # noqa: BLE001 a controller of one's own may say anything
        raise CommandError(
            f"expected a JointCommand with numbers in {name}, found a {type(command).__name__}"
        ) from None
    if part.shape != shape:
        raise CommandError(
            f"expected {name} of shape {shape} for 19 joints, found shape {part.shape}"
        )
    return part
