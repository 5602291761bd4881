"""The controller as a session sees it, and what it did in one tick."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from antennate.records import AntennaFrame, Ints, Pose


class Decider(Protocol):
    """A controller of one robot."""

    maneuver: Ints
    contact: Ints

    def step(self, frame: AntennaFrame) -> Pose:
        """The pose of this tick."""
        ...


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
