"""The decision of a controller, read from it after its step."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from antennate.errors import ControllerError
from antennate.robots.spec import RobotSpec
from antennate.types import Contact, Controller, JointCommand, Maneuver

_MOST = (1 << 31) - 1
"""Largest number of a decision that is accepted; a log keeps 64 bits of each."""


@dataclass(frozen=True, slots=True)
class Decision:
    """A `Maneuver` and a `Contact` a side; the defaults stand until the first step."""

    maneuver: int = int(Maneuver.HOLD)
    contact: tuple[int, int] = (int(Contact.UNKNOWN), int(Contact.UNKNOWN))


def decision_of(controller: Controller) -> Decision:
    """The decision of a controller of one robot after its step.

    Whether the number is a valid `Maneuver` is checked by the supervisor.
    """
    (maneuver,) = _integers(controller, "maneuver", (1,))
    left, right = _integers(controller, "contact", (1, 2))
    return Decision(maneuver, (left, right))


def _integers(controller: Controller, name: str, shape: tuple[int, ...]) -> list[int]:
    value: object = getattr(controller, name, None)
    array = np.asarray(value)
    fits = array.shape == shape and array.dtype.kind in "iu"
    numbers = [int(number) for number in array.ravel()] if fits else []
    if not numbers or max(map(abs, numbers)) > _MOST:
        raise ControllerError(
            f"expected {name} of shape {shape}, small whole numbers, found {value!r}; see "
            f"antennate.types.{name.capitalize()}"
        )
    return numbers


def no_command(robot: RobotSpec) -> JointCommand:
    """The command in place of one that a controller did not give: NaN for every joint."""
    shapes = robot.command_shapes().items()
    return JointCommand(**{name: np.full(shape, math.nan) for name, shape in shapes})
