"""The controller as a session sees it, and what it did in one tick."""

from __future__ import annotations

import importlib
import math
from dataclasses import dataclass
from typing import Protocol, cast

import numpy as np

from antennate.control.controllers import ARMS, Controller
from antennate.errors import BadInputError, ConfigError
from antennate.hardware.driving.tracebacks import said
from antennate.params import ControlParams
from antennate.types import AntennaFrame, Contact, Ints, JointCommand, Maneuver

_MOST = (1 << 31) - 1
"""Largest number of a decision that is looked at; a log keeps 64 bits of each."""


class Decided(Protocol):
    """A controller after its step.

    Attributes:
        maneuver: `Maneuver`, shape (1,).
        contact: `Contact`, shape (1, 2).
    """

    maneuver: Ints
    contact: Ints


class Decider(Decided, Protocol):
    """A controller of one robot."""

    def step(self, frame: AntennaFrame) -> JointCommand:
        """The command of this tick."""
        ...


def chosen(name: str, params: ControlParams) -> Decider:
    """The controller of a name, one of ours or MODULE:CLASS.

    Raises:
        ConfigError: There is none of that name.
    """
    if name in ARMS:
        return Controller(params, name)
    module, _, made = name.partition(":")
    if not made:
        raise ConfigError(
            f"--controller: expected one of {', '.join(ARMS)} or MODULE:CLASS, found {name!r}"
        )
    try:
        return cast(Decider, getattr(importlib.import_module(module), made)(params))
    except KeyboardInterrupt:
        raise
    except BaseException as error:
        raise ConfigError(
            f"--controller: expected a class that takes ControlParams, found {name!r}: "
            f"{said(error)}"
        ) from error


@dataclass(frozen=True, slots=True)
class Decision:
    """What a controller has decided, nothing before it was asked.

    Attributes:
        maneuver: A `Maneuver`.
        contact: A `Contact` a side.
    """

    maneuver: int = int(Maneuver.HOLD)
    contact: tuple[int, int] = (int(Contact.UNKNOWN), int(Contact.UNKNOWN))


def decision(decider: Decided) -> Decision:
    """What it says after its step; whether there are such maneuvers the supervisor judges.

    Raises:
        BadInputError: It says it otherwise than a `Decider` does.
    """
    (maneuver,) = _whole(decider, "maneuver", (1,))
    left, right = _whole(decider, "contact", (1, 2))
    return Decision(maneuver, (left, right))


def _whole(decider: Decided, name: str, shape: tuple[int, ...]) -> list[int]:
    value: object = getattr(decider, name, None)
    found = np.asarray(value)
    whole = found.shape == shape and found.dtype.kind in "iu"
    numbers = [int(one) for one in found.ravel()] if whole else []
    if not numbers or max(map(abs, numbers)) > _MOST:
        raise BadInputError(
            f"expected {name} of shape {shape}, small whole numbers, found {value!r}; see "
            f"antennate.types.{name.capitalize()}"
        )
    return numbers


@dataclass(slots=True)
class Thought:
    """What the control did in this tick."""

    asked: bool = True
    decided_at: float = -math.inf
    bad_command: str = ""
    failure: str = ""


def nowhere() -> JointCommand:
    """The command of a controller that said nothing."""
    return JointCommand(*(np.full(shape, math.nan) for shape in ((1, 5), (1, 6, 2), (1, 2))))
