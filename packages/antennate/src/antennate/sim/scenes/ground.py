"""Ground that is not flat: steps, stairs, gaps, ramps and rubble across a straight way.

Ground is what the robot walks on, so it is no obstacle: everything of the robot touches it, legs
with their own friction, and it is not in outlines or obstacle forces. A profile is a list of levels
along x; the lowest is the floor at z = 0, so that a way down starts on a platform.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from antennate.params.scene import GroundParams
from antennate.robots.spec import RobotSpec
from antennate.sim.engine import mujoco
from antennate.sim.parts import FLOOR_BIT, GROUND_BIT, GROUND_FRICTION
from antennate.sim.scenes.scene import Route
from antennate.types import Floats

HALF_WIDTH = 3.0
"""Half the width of all ground [m] (assumed: nobody walks round it)."""
BEHIND = 3.0
"""Ground behind the head at the start [m] (assumed: room to back off)."""
BEYOND = 1.5
"""Ground behind the last edge [m] (assumed: twice the robot)."""


class Edge(NamedTuple):
    """A place where the ground rises or falls.

    Attributes:
        x: Where it is [m].
        rise: Height gained there [m]; negative where the ground falls.
    """

    x: float
    rise: float


class GroundScene:
    """One drawn profile, across x.

    Args:
        name: Kind of the scene, one of `KINDS`.
        params: Its sizes.
    """

    random = True

    def __init__(self, name: str, params: GroundParams | None = None) -> None:
        self._name, self._params = name, params or GroundParams()

    def draw(self, robot: RobotSpec, rng: np.random.Generator) -> Ground:
        """Draw the distance of the first edge, and the blocks of rubble."""
        first = float(rng.uniform(*self._params.start))
        return KINDS[self._name](self._params, robot, first, rng)


class Ground(Route):
    """Levels along x, with boxes and ramps on them. The exit is a body length behind the last edge.

    Args:
        edges: Edges along x; between them the ground is level.
        length: Length of the robot [m].
        start: Height of the ground at the start [m].
        ramp: Where a ramp starts and ends along x [m], of a height of `edges[0].rise`.
        blocks: Boxes that lie on the ground: x, y, half sizes along x, y and z [m], turn about z
            [rad], shape (n, 6).

    Attributes:
        edges: As given.
        ground: Height under the robot at the start [m].
        top: Height of the highest ground [m].
    """

    def __init__(
        self,
        edges: Sequence[Edge],
        length: float,
        start: float = 0.0,
        ramp: tuple[float, float] | None = None,
        blocks: Floats | None = None,
    ) -> None:
        self.edges, self.ground, self._ramp = tuple(edges), start, ramp
        self._blocks = np.zeros((0, 6)) if blocks is None else blocks
        heights = np.cumsum([start, *(edge.rise for edge in self.edges)])
        self._levels: Floats = heights
        self.top = float(heights.max() + 2.0 * self._blocks[:, 4].max(initial=0.0))
        ends = [0.0, *(edge.x for edge in self.edges), *self._blocks[:, 0].tolist()]
        end = max(ends) + length
        super().__init__(np.array([[0.0, 0.0], [end, 0.0]]))

    def build(self, spec: mujoco.MjSpec) -> None:
        """Add the floor, the levels, the ramp and the blocks."""
        spec.worldbody.add_geom(
            name="floor",
            type=mujoco.mjtGeom.mjGEOM_PLANE,
            size=[10, 10, 0.1],
            friction=[GROUND_FRICTION, 0, 0],
            contype=FLOOR_BIT | GROUND_BIT,
            conaffinity=0,
        )
        ends = [-BEHIND, *(edge.x for edge in self.edges), self.route[-1, 0] + BEYOND]
        for i, (low, high, height) in enumerate(zip(ends, ends[1:], self._levels, strict=False)):
            if height > 1e-9:
                _add_box(spec, f"level{i}", low, high, height)
        if self._ramp is not None:
            _add_ramp(spec, *self._ramp, self.edges[-1].rise)
        for i, (x, y, *half, turn) in enumerate(self._blocks.tolist()):
            _add_geom(spec, f"block{i}", [x, y, self.ground + half[2]], half, turn=turn)

    def height(self, x: float) -> float:
        """Height of the level at x, without ramp and blocks [m]."""
        return float(self._levels[sum(edge.x <= x for edge in self.edges)])


def _add_geom(
    spec: mujoco.MjSpec,
    name: str,
    place: Sequence[float],
    half: Sequence[float],
    turn: float = 0.0,
    slope: float = 0.0,
) -> None:
    """A box of the ground, turned about z, or sloping up along x [rad]."""
    quat = [math.cos(turn / 2), 0.0, 0.0, math.sin(turn / 2)]
    if slope:
        quat = [math.cos(slope / 2), 0.0, -math.sin(slope / 2), 0.0]
    spec.worldbody.add_geom(
        name=name,
        type=mujoco.mjtGeom.mjGEOM_BOX,
        pos=place,
        size=half,
        quat=quat,
        friction=[GROUND_FRICTION, 0, 0],
        contype=GROUND_BIT,
        conaffinity=0,
    )


def _add_box(spec: mujoco.MjSpec, name: str, low: float, high: float, height: float) -> None:
    middle, half = (low + high) / 2, (high - low) / 2
    _add_geom(spec, name, [middle, 0.0, height / 2], [half, HALF_WIDTH, height / 2])


def _add_ramp(spec: mujoco.MjSpec, low: float, high: float, rise: float) -> None:
    """A slab whose upper face goes from the floor at `low` to `rise` at `high`."""
    slope, thick = math.atan2(rise, high - low), rise
    half = math.hypot(high - low, rise) / 2
    x = (low + high) / 2 + thick / 2 * math.sin(slope)
    z = rise / 2 - thick / 2 * math.cos(slope)
    _add_geom(spec, "ramp", [x, 0.0, z], [half, HALF_WIDTH, thick / 2], slope=slope)


def _step_up(p: GroundParams, robot: RobotSpec, x: float, rng: np.random.Generator) -> Ground:
    return Ground([Edge(x, p.height)], robot.length)


def _step_down(p: GroundParams, robot: RobotSpec, x: float, rng: np.random.Generator) -> Ground:
    return Ground([Edge(x, -p.height)], robot.length, start=p.height)


def _stairs(p: GroundParams, robot: RobotSpec, x: float, rng: np.random.Generator) -> Ground:
    edges = [Edge(x + i * p.tread, p.height) for i in range(p.steps)]
    return Ground(edges, robot.length)


def _gap(p: GroundParams, robot: RobotSpec, x: float, rng: np.random.Generator) -> Ground:
    edges = [Edge(x, -p.depth), Edge(x + p.width, p.depth)]
    return Ground(edges, robot.length, start=p.depth)


def _ramp(p: GroundParams, robot: RobotSpec, x: float, rng: np.random.Generator) -> Ground:
    end = x + p.height / math.tan(math.radians(p.slope))
    return Ground([Edge(end, p.height)], robot.length, ramp=(x, end))


def _rubble(p: GroundParams, robot: RobotSpec, x: float, rng: np.random.Generator) -> Ground:
    """Blocks at random on a field as long as the robot twice over.

    Rugosity is the standard deviation of the heights of the field, of points at random: with a
    share c of it covered by blocks of height h it is about h sqrt(c (1 - c)).
    """
    length = 2.0 * robot.length
    count = round(p.density * length * 2.0 * HALF_WIDTH)
    places = rng.uniform([x, -HALF_WIDTH], [x + length, HALF_WIDTH], (count, 2))
    half = rng.uniform(0.015, 0.04, (count, 2))
    heights = rng.uniform(0.5, 1.0, (count, 1)) * p.block / 2
    turns = rng.uniform(0.0, math.pi, (count, 1))
    blocks = np.concatenate([places, half, heights, turns], axis=1)
    return Ground([], robot.length, blocks=blocks)


KINDS = {
    "step_up": _step_up,
    "step_down": _step_down,
    "stairs": _stairs,
    "gap": _gap,
    "ramp": _ramp,
    "rubble": _rubble,
}
"""What draws each kind of ground."""
SCENES = {name: functools.partial(GroundScene, name) for name in KINDS}
"""Scenes of this module by name."""
