"""What a simulation knows and a robot does not: privileged input of a controller, for studies.

It shows how much a sense would be worth that nobody has built yet. On a robot there is none of it.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Literal, Protocol, get_args, runtime_checkable

import numpy as np

from antennate.errors import ConfigError
from antennate.types import Bools, Floats, Ints, Maneuver

Kind = Literal["side", "jam", "facing", "free", "map", "edges"]
"""A piece of knowledge."""
KNOWABLE: tuple[Kind, ...] = get_args(Kind)


EDGES = 4
"""Edges that a robot is told at once, at most: those of usual stairs it is on, and the next."""


@dataclass(frozen=True, slots=True)
class Knowledge:
    """The truth about B robots; a part that is not given is None.

    Attributes:
        side: Side on which the route goes on from the head, by its mean direction in a gait cycle:
            +1 left, -1 right, 0 straight ahead, shape (B,).
        jam: Whether the robot walks and does not get on, shape (B,).
        facing: Whether the head faces the entrance, against the route, shape (B,).
        free: Whether nothing is within reach ahead of the head, shape (B,).
        map: Angle from the head's direction to a point ahead on the route [rad], positive to the
            left, within -pi and pi, shape (B,).
        edges: Distance of the head past each edge where the ground rises and where the body is or
            will be next [m], shape (B, EDGES), NaN where there is none.
    """

    side: Ints | None = None
    jam: Bools | None = None
    facing: Bools | None = None
    free: Bools | None = None
    map: Floats | None = None
    edges: Floats | None = None


ALIGNED = math.radians(10.0)
"""Angle to a point ahead on the route at which a turn ends, where that angle is known [rad]."""


def aligned(maneuver: Ints, angle: Floats) -> Bools:
    """Rows that turn and have come to a point ahead, or past it, shape (B,).

    Args:
        maneuver: One `Maneuver` a row, shape (B,).
        angle: Angle to the point ahead [rad], positive to the left, shape (B,).
    """
    left, right = maneuver == Maneuver.TURN_L, maneuver == Maneuver.TURN_R
    still = np.where(left, angle, -angle)  # to be turned
    return (left | right) & (still < ALIGNED) & (still > -math.pi / 2)


def stuck_by(knowledge: Knowledge, stuck: Bools) -> Bools:
    """Rows that are stuck: by what is known where it is, else as given, shape (B,)."""
    stuck = stuck if knowledge.jam is None else knowledge.jam
    return stuck if knowledge.free is None else stuck & ~knowledge.free


def right_by(side: Ints | Floats | None, right: Bools) -> Bools:
    """Whether to turn right: away from the left where a side is known, else as given, shape (B,).

    Args:
        side: Positive to the left, 0 straight ahead, shape (B,); None if it is not known.
        right: As given, shape (B,).
    """
    return right if side is None else np.where(side == 0, right, side < 0)


@runtime_checkable
class Knowing(Protocol):
    """A controller that can use knowledge.

    Attributes:
        knows: The kinds that it can use.
        needs: Those of them without which it cannot walk.
    """

    knows: tuple[Kind, ...]
    needs: tuple[Kind, ...]

    def know(self, knowledge: Knowledge) -> None:
        """Take what holds in the next step."""
        ...


def needs_of(controller: Any) -> tuple[Kind, ...]:
    """Kinds without which a controller cannot walk."""
    return tuple(controller.needs) if isinstance(controller, Knowing) else ()


def given_to(controller: Any, name: str, knows: Iterable[Kind]) -> tuple[Kind, ...]:
    """Kinds that a simulation gives to a controller: what is offered, and what it needs.

    Args:
        controller: The controller.
        name: Its name, for messages.
        knows: What is offered.
    """
    offered = tuple(knows)
    usable = tuple(controller.knows) if isinstance(controller, Knowing) else ()
    if unused := [kind for kind in offered if kind not in usable]:
        what = f"one that uses {', '.join(usable)}" if usable else "one that uses no knowledge"
        raise ConfigError(
            f"--knows: expected controllers that use {', '.join(unused)}, found {name!r}, {what}"
        )
    return tuple(kind for kind in KNOWABLE if kind in {*offered, *needs_of(controller)})


def require_own_senses(controller: Any, name: str, where: str) -> None:
    """Refuse a controller that needs what only a simulation knows."""
    if needs := needs_of(controller):
        raise ConfigError(
            f"controller: expected one that lives on its readings for {where}, found {name!r}, "
            f"which needs to know {', '.join(needs)}; only a simulation knows that"
        )
