"""The controller as a session sees it, and what it did in one tick."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from antennate.errors import BadInputError
from antennate.records import AntennaFrame, Contact, Ints, Maneuver, Pose


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

    def step(self, frame: AntennaFrame) -> Pose:
        """The pose of this tick."""
        ...


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
    said: object = getattr(decider, name, None)
    found = np.asarray(said)
    if found.shape != shape or found.dtype.kind not in "iu":
        raise BadInputError(
            f"expected {name} of shape {shape}, whole numbers, found {said!r}; see "
            f"antennate.records.{name.capitalize()}"
        )
    return [int(one) for one in found.ravel()]


@dataclass(slots=True)
class Thought:
    """What the mind did in this tick."""

    asked: bool = True
    decided_at: float = -math.inf
    bad_pose: str = ""
    failure: str = ""


def nowhere() -> Pose:
    """The pose of a controller that said nothing."""
    return Pose(*(np.full(shape, math.nan) for shape in ((1, 5), (1, 6, 2), (1, 2))))
