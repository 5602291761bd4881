"""A straight wall beside the robot: the task is to walk along it at a distance."""

from __future__ import annotations

import numpy as np

from antennate.robots.spec import RobotSpec
from antennate.sim.engine import mujoco
from antennate.sim.scenes.scene import LEFT_BEHIND, Route
from antennate.sim.scenes.tunnel import add_wall
from antennate.types import Floats

GAP = 0.05
"""Gap to hold between the robot's side at its head and the wall [m] (assumed: an antenna reaches
over it, the legs do not touch)."""
START_GAP = 0.30
"""Gap at the start [m] (assumed: no start, however it is turned, touches the wall)."""
_FRICTION = 0.3
"""Friction of the wall (assumed: paper)."""


class Wall(Route):
    """One wall. The route runs along it, with `START_GAP` beside a robot that walks there.

    Args:
        length: Length of the route [m].
        width: Width of the robot [m].
        side: +1 for a wall on the left, -1 on the right.
    """

    def __init__(self, length: float, width: float, side: float) -> None:
        self._side, self._half = side, width / 2
        self._y = side * (self._half + START_GAP)
        self._ends = np.array([[-LEFT_BEHIND, self._y], [length + LEFT_BEHIND, self._y]])
        super().__init__(np.array([[0.0, 0.0], [length, 0.0]]))

    def build(self, spec: mujoco.MjSpec) -> None:
        """Add the floor and the wall."""
        super().build(spec)
        start, end = self._ends
        add_wall(spec, "wall", start, end, self._side, _FRICTION)

    def gap(self, head: Floats) -> float:
        """Gap between the robot's side and the wall, at a head there, shape (2,) [m]."""
        return float(self._side * (self._y - head[1])) - self._half


class WallScene:
    """Draws walls, on the left or on the right.

    Args:
        length: Length of the route along it [m].
    """

    random = True

    def __init__(self, length: float = 2.0) -> None:
        self._length = length

    def draw(self, robot: RobotSpec, rng: np.random.Generator) -> Wall:
        """Draw the side."""
        return Wall(self._length, robot.width, 1.0 if rng.random() < 0.5 else -1.0)


SCENES = {"wall": WallScene}
"""Scenes of this module by name."""
