"""What a scene is: the protocols, a base for scenes with a route, and the simplest of them."""

from __future__ import annotations

import math
from typing import Protocol

import numpy as np

from antennate.robots.spec import RobotSpec
from antennate.sim import layers
from antennate.sim.engine import mujoco
from antennate.sim.scenes import geometry
from antennate.types import Floats

LEFT_BEHIND = 0.8
"""Distance from the start, or from all walls, at which the robot has left [m]: its length and more.
"""
EXIT_HALF_WIDTH = 0.5
"""Half the width of an exit that no walls bound [m]."""


class SceneInstance(Protocol):
    """One drawn scene. Positions are in plan, x and y [m]; the floor at the start is at z = 0."""

    @property
    def start(self) -> tuple[float, float, float]:
        """Where the head starts: x [m], y [m] and heading [rad]."""
        ...

    @property
    def length(self) -> float:
        """Progress at the exit [m]."""
        ...

    @property
    def exit(self) -> Floats:
        """Ends of the line that the head crosses at the exit [m], shape (2, 2)."""
        ...

    def build(self, spec: mujoco.MjSpec) -> None:
        """Add everything to a spec, the floor included, but not the robot."""
        ...

    def progress(self, head: Floats) -> float:
        """How far a head at this position, shape (2,), has come from the start [m]."""
        ...

    def succeeded(self, head: Floats) -> bool:
        """Whether a head at this position has passed the exit."""
        ...

    def left(self, head: Floats) -> bool:
        """Whether a head at this position has left another way and cannot succeed any more."""
        ...


class Scene(Protocol):
    """Draws instances. The same state of the generator gives the same instance."""

    @property
    def random(self) -> bool:
        """Whether instances differ from draw to draw."""
        ...

    def draw(self, robot: RobotSpec, rng: np.random.Generator) -> SceneInstance:
        """Draw one instance in which the robot fits.

        Raises:
            SceneError: There is none.
        """
        ...


class Route:
    """Base of an instance whose progress is arc length along a polyline, from start to exit.

    It starts with a flat floor; a subclass adds to `build`. The robot succeeds when it passes the
    end of the route within `EXIT_HALF_WIDTH`, and has left when it is farther than `LEFT_BEHIND`
    from the smallest rectangle along x and y that holds the route and `bounds`.

    Args:
        route: Corner points [m], shape (n, 2), n at least 2.
        bounds: Further points that are inside [m], shape (m, 2).
    """

    def __init__(self, route: Floats, bounds: Floats | None = None) -> None:
        self.route: Floats = np.asarray(route, dtype=float)
        points = self.route if bounds is None else np.concatenate([self.route, bounds])
        self._low, self._high = points.min(axis=0) - LEFT_BEHIND, points.max(axis=0) + LEFT_BEHIND
        self._along = np.diff(self.route, axis=0)
        self.length = float(np.hypot(*self._along.T).sum())

    @property
    def start(self) -> tuple[float, float, float]:
        """The first point of the route, facing the second."""
        x, y = self.route[0].tolist()
        return x, y, math.atan2(self._along[0, 1], self._along[0, 0])

    @property
    def exit(self) -> Floats:
        """A line across the end of the route."""
        dx, dy = self._along[-1] / np.hypot(*self._along[-1]) * EXIT_HALF_WIDTH
        return self.route[-1] + np.array([[-dy, dx], [dy, -dx]])

    def build(self, spec: mujoco.MjSpec) -> None:
        """Add the floor."""
        add_floor(spec)

    def progress(self, head: Floats) -> float:
        """Arc length of the nearest point of the route [m]."""
        return geometry.progress(self.route, head)

    def succeeded(self, head: Floats) -> bool:
        """Whether the head is past the end of the route, at most half a width beside it."""
        gap = math.hypot(*(head - self.route[-1]))
        past = self.progress(head) - self.length
        return past >= 0.0 and gap**2 - past**2 <= EXIT_HALF_WIDTH**2

    def left(self, head: Floats) -> bool:
        """Whether the head is outside the rectangle."""
        return bool((head < self._low).any() or (head > self._high).any())


class FlatScene:
    """A flat floor without anything on it; the exit is straight ahead.

    Args:
        length: Distance of the exit [m].
    """

    random = False

    def __init__(self, length: float = 2.0) -> None:
        self._length = length

    def draw(self, robot: RobotSpec, rng: np.random.Generator) -> Route:
        """Every instance is the same."""
        return Route(np.array([[0.0, 0.0], [self._length, 0.0]]))


def add_floor(spec: mujoco.MjSpec) -> None:
    """Add an unbounded floor at z = 0; only legs and what a scene lets stand on it touch it."""
    spec.worldbody.add_geom(
        name="floor",
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        size=[10, 10, 0.1],
        contype=layers.FLOOR,
        conaffinity=0,
    )
