"""What a scene is: the protocols, a base for scenes with a route, and the simplest of them.

A scene is a class with `random` and `draw`. One of ours has its name in the `SCENES` of its module;
one of your own is given as FILE.py:CLASS (docs/scenes.md).
"""

from __future__ import annotations

import math
from typing import Protocol

import numpy as np

from antennate.robots.spec import RobotSpec
from antennate.sim.engine import mujoco
from antennate.sim.parts import FLOOR_BIT
from antennate.sim.scenes import geometry
from antennate.types import Floats

LEFT_BEHIND = 0.8
"""Distance outside of a scene at which the robot has left it [m]: more than the robot's length."""
TIME_LIMIT = 100.0
"""Time after which a trial has failed, where its scene does not say another [s].

Twice as long as 2 m take at 0.04 m/s, the paper's speed without feedback."""
EXIT_HALF_WIDTH = 0.5
"""Half the width of an exit that no walls bound [m]."""


class SceneInstance(Protocol):
    """One scene as chance has drawn it. Positions are seen from above, x and y [m].

    It may have more: `succeeded(head)`, see `exit`; `route`, corner points from the start to the
    exit [m], shape (n, 2); `time_limit`, after which a trial has failed [s]; `ground`, height of
    the ground under the robot at the start [m], and `top`, that of the highest ground [m], above
    the lowest at z = 0. With `ground` a robot that falls or lies on its back ends the trial.
    """

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
        """Ends of the line that the head crosses at the exit [m], shape (2, 2).

        The first is on the left of a robot that goes out. A trial succeeds when the head crosses
        the line outwards between them, unless the instance has a rule of its own: a method
        `succeeded(head)` that says whether a head at this position, shape (2,), is past the exit.
        """
        ...

    def build(self, spec: mujoco.MjSpec) -> None:
        """Add everything to a spec, the floor included, but not the robot."""
        ...

    def progress(self, head: Floats) -> float:
        """How far a head at this position, shape (2,), has come from the start [m]."""
        ...

    def left(self, head: Floats) -> bool:
        """Whether a head at this position, not through the exit, has left and cannot succeed."""
        ...


class Scene(Protocol):
    """Draws instances. The same state of the generator gives the same instance.

    A scene may set what chance changes from trial to trial: an attribute `variation`, a mapping
    of fields of `VariationParams` to values.
    """

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

    It starts with a flat floor; a subclass adds to `build`. The robot succeeds when it crosses the
    end of the route within `EXIT_HALF_WIDTH`. It has left when it is past that end without having
    crossed it there, or farther than `LEFT_BEHIND` from the smallest rectangle along x and y that
    holds the route and `bounds`.

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
        """A line across the end of the route, its left end first."""
        dx, dy = self._along[-1] / np.hypot(*self._along[-1]) * EXIT_HALF_WIDTH
        return self.route[-1] + np.array([[-dy, dx], [dy, -dx]])

    def build(self, spec: mujoco.MjSpec) -> None:
        """Add the floor."""
        add_floor(spec)

    def progress(self, head: Floats) -> float:
        """Arc length of the nearest point of the route [m], which goes on straight at its ends."""
        return geometry.progress(self.route, head)

    def left(self, head: Floats) -> bool:
        """Whether the head is past the end of the route, or far outside of the rectangle.

        Far is `LEFT_BEHIND` along x or y. A scene with `succeeded` lets the robot go on past the
        end.
        """
        outside = (head < self._low).any() or (head > self._high).any()
        past = not hasattr(self, "succeeded") and self.progress(head) > self.length
        return bool(outside or past)


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
        contype=FLOOR_BIT,
        conaffinity=0,
    )


SCENES = {"flat": FlatScene}
"""Scenes of this module by name."""
