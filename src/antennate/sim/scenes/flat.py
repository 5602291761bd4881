"""A flat floor without anything on it."""

from __future__ import annotations

import numpy as np

from antennate.robots.spec import RobotSpec
from antennate.sim.scenes.scene import Route


class FlatScene:
    """A flat floor; the exit is straight ahead.

    Args:
        length: Distance of the exit [m].
    """

    random = False

    def __init__(self, length: float = 2.0) -> None:
        self._length = length

    def draw(self, robot: RobotSpec, rng: np.random.Generator) -> Route:
        """Every instance is the same."""
        return Route(np.array([[0.0, 0.0], [self._length, 0.0]]))
