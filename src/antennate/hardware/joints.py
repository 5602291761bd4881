"""Angles of joints to positions of servos and back."""

from __future__ import annotations

import math

import numpy as np

from antennate.dxl.model import MOST_TICKS, POSITION_UNIT, TICKS_A_TURN
from antennate.errors import AntennateError
from antennate.hardware.settings import profile_velocities
from antennate.robots.spec import RobotSpec
from antennate.types import Floats, Ints, JointCommand


class CommandError(AntennateError):
    """A command that no servo must be sent."""


class Joints:
    """All joints of one robot that servos move, in the order of its description.

    Attributes:
        profiles: Profile velocities by id [0.229 rev/min], above what goals are moved at.
        in_order_of_release: Ids of the groups in the order in which they lose their torque.
        turning: Places in `ids` of the joints that turn without end.
    """

    def __init__(self, robot: RobotSpec) -> None:
        self.robot, self.ids, self.models = robot, robot.ids, robot.models
        self.profiles = profile_velocities(robot)
        self.in_order_of_release = robot.in_order_of_release
        self._shapes = robot.command_shapes()
        self._sign: Floats = np.array(robot.directions, float)
        self._zero: Floats = np.array(robot.zeros, float)
        self._limit: Floats = np.array(robot.limits)
        self._fastest: Floats = np.array(robot.fastest)
        self.turning: Ints = np.flatnonzero(np.isinf(self._limit))

    def ticks(self, command: JointCommand) -> Ints:
        """Goal positions [ticks] of a command of one robot, shape (n,).

        Raises:
            CommandError: It is not of one robot, not finite, or beyond a limit or what servos
                count. It is refused as a whole.
        """
        parts = (_part(command, name, shape) for name, shape in self._shapes.items())
        angles = np.concatenate([part.ravel() for part in parts])
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
        """Ticks that each joint may go in a time [s], shape (n,)."""
        return self._fastest * time / POSITION_UNIT

    def align(self, ticks: Ints | Floats, command: JointCommand) -> None:
        """Count whole turns of legs so that a command is nearest to where they stand [ticks]."""
        away = (ticks - self.ticks(command))[self.turning]
        self._zero[self.turning] += TICKS_A_TURN * np.rint(away / TICKS_A_TURN)

    def shift(self, at: int, ticks: float) -> None:
        """Count the position of the joint at a place in `ids` from elsewhere by some ticks."""
        self._zero[at] += ticks

    def positions(self, angles: Floats) -> Floats:
        """Positions, not rounded [ticks], of joint angles [rad], both of shape (n,)."""
        return np.asarray(self._zero + self._sign * angles / POSITION_UNIT)

    def angles(self, ticks: Ints | Floats) -> Floats:
        """Joint angles [rad] at positions [ticks], both of shape (n,)."""
        return np.asarray((ticks - self._zero) * self._sign * POSITION_UNIT)

    def command(self, ticks: Ints | Floats) -> JointCommand:
        """The command of one robot at these positions [ticks], shape (n,)."""
        angles = self.angles(ticks)
        parts = np.split(angles, np.cumsum([math.prod(shape) for shape in self._shapes.values()]))
        named = zip(self._shapes.items(), parts, strict=False)
        return JointCommand(**{name: part.reshape(shape) for (name, shape), part in named})

    def plain(self, command: JointCommand) -> JointCommand:
        """A copy of a command of one robot; CommandError if it is anything else."""
        shapes = self._shapes.items()
        return JointCommand(**{name: _part(command, name, shape) for name, shape in shapes})


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
        raise CommandError(f"expected {name} of shape {shape}, found shape {part.shape}")
    return part
