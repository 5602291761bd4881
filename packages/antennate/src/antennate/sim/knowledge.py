"""What the simulation knows of its robots, as controllers may get it for studies.

All of it follows from the true state of a trial and the scene's route, a look every LOOK_EVERY
ticks of the trial's own.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from antennate.control.knowledge import EDGES, Kind, Knowledge
from antennate.errors import SceneError, raised
from antennate.messages import shortened
from antennate.sim.engine import mujoco
from antennate.sim.episode import LOOK_EVERY
from antennate.sim.scenes import geometry
from antennate.sim.scenes.scene import SceneInstance
from antennate.sim.world import World
from antennate.types import Floats, Ints, Maneuver

AHEAD = 0.3
"""How far ahead on the route the point is that `map` leads to [m]: half the robot."""
SIDE_AHEAD = 0.6
"""How far ahead on the route the point is that `side` looks at [m]: the robot, so that a corner is
still seen after it has backed off."""
STRAIGHT = math.radians(10.0)
"""Largest angle to a point that counts as straight ahead [rad]."""
JAM_GAIN = 0.02
"""The head of a jammed robot gets on by less than this in a gait cycle [m]: a seventh of what a
free one walks in it, and the gain that the tables call stuck."""
_FRONT = 0.4
"""Share of the robot behind its head about which edges are told if there are too many."""
_RAYS = np.radians([-45.0, -30.0, -15.0, 0.0, 15.0, 30.0, 45.0])
"""Directions in which the way ahead is looked at, from the head's [rad]."""
ON_ROUTE: tuple[Kind, ...] = ("side", "facing", "map")
"""Kinds that follow from the route of a scene."""


def require_route(name: str, scene: SceneInstance, kinds: Sequence[Kind]) -> None:
    """Check that a scene has the route from which these kinds follow."""
    lacking = [kind for kind in kinds if kind in ON_ROUTE]
    if lacking and route_of(scene) is None:
        raise SceneError(
            f"scene {name!r}: expected a centre line as `route`, an array of shape (n, 2), for the "
            f"knowledge of {', '.join(lacking)}, found none"
        )


class Truths:
    """What holds of the robots of a batch now.

    Args:
        kinds: What is to be known.
        batch: Rows B.
        cycle: Control ticks of a gait cycle.
    """

    def __init__(self, kinds: Sequence[Kind], batch: int, cycle: float) -> None:
        self._kinds = kinds
        self._looks = max(1, round(cycle / LOOK_EVERY))
        self._routes: dict[int, Floats | None] = {}
        self._ticks: dict[int, int] = {}
        self._walked: dict[int, list[Floats]] = {}
        self._headings: dict[int, list[float]] = {}
        self._side: Ints = np.zeros(batch, np.int64)
        self._jam, self._facing, self._free = np.zeros((3, batch), dtype=bool)
        self._map: Floats = np.full(batch, math.nan)
        self._edges: Floats = np.full((batch, EDGES), math.nan)
        self._rises: dict[int, Floats] = {}

    def begin(self, row: int, scene: SceneInstance) -> None:
        """A trial begins in a row."""
        self._routes[row], self._ticks[row] = route_of(scene), 0
        self._walked[row], self._headings[row] = [], []
        self._rises[row] = np.array([e.x for e in getattr(scene, "edges", ()) if e.rise > 0.0])

    def look(self, row: int, world: Any, maneuver: int) -> None:
        """Look at a row before a tick of its trial.

        Args:
            row: The row.
            world: Its robot: a `World`, or a row of a batch on a device.
            maneuver: What the robot has done since the last tick.
        """
        tick = self._ticks[row]
        self._ticks[row] += 1
        if tick % LOOK_EVERY == 0:
            self._look(row, world if isinstance(world, World) else world.on_cpu, maneuver)

    def knowledge(self) -> Knowledge:
        """What is known of all rows, copied."""
        return Knowledge(**{kind: getattr(self, f"_{kind}").copy() for kind in self._kinds})

    def _look(self, row: int, world: World, maneuver: int) -> None:
        head, heading = world.head[:2].copy(), world.heading
        self._headings[row] = [*self._headings[row], heading][-self._looks :]
        self._jam[row] = self._is_jammed(row, head, maneuver)
        if "free" in self._kinds:
            self._free[row] = is_free(world)
        self._edges[row] = edges_near(self._rises[row], float(head[0]), world.robot.length)
        route = self._routes[row]
        if route is not None:
            self._map[row] = angle_ahead(route, head, heading)
            self._side[row] = side_ahead(route, head, mean_direction(self._headings[row]))
            self._facing[row] = is_facing(route, head, heading)

    def _is_jammed(self, row: int, head: Floats, maneuver: int) -> bool:
        if maneuver != Maneuver.FORWARD:
            self._walked[row] = []
            return False
        walked = [*self._walked[row], head][-self._looks - 1 :]
        self._walked[row] = walked
        return len(walked) > self._looks and math.dist(walked[0], head) < JAM_GAIN


def edges_near(edges: Floats, x: float, length: float) -> Floats:
    """Distance of a head at x past the edges that its body is on, or will be next [m], (EDGES,).

    An edge keeps its place in the array for as long as it is told. Of too many those are told that
    are nearest to the front half of the body, where the line is steep.

    Args:
        edges: Where the ground rises along x [m], in their order along the way, shape (n,).
        x: Of the head [m].
        length: Of the robot; farther behind, an edge is left out [m].
    """
    past = x - edges
    near = np.flatnonzero((past < 1.5 * length) & (past > -length))
    near = near[np.argsort(np.abs(past[near] - _FRONT * length), kind="stable")[:EDGES]]
    told = np.full(EDGES, math.nan)
    told[near % EDGES] = past[near]
    return told


def mean_direction(headings: Sequence[float]) -> float:
    """The mean of directions, as of a head that swings over a gait cycle [rad]."""
    return math.atan2(sum(map(math.sin, headings)), sum(map(math.cos, headings)))


def side_ahead(route: Floats, head: Floats, heading: float) -> int:
    """Side of the point SIDE_AHEAD on the route: +1 left, -1 right, 0 straight ahead."""
    angle = angle_ahead(route, head, heading, SIDE_AHEAD)
    return 0 if abs(angle) < STRAIGHT else int(math.copysign(1, angle))


def angle_ahead(route: Floats, head: Floats, heading: float, ahead: float = AHEAD) -> float:
    """Angle from a heading [rad] to a point ahead on the route, within -pi and pi [rad].

    The route goes on straight past its end.

    Args:
        route: Its corners [m], shape (n, 2).
        head: Where the head is [m], shape (2,).
        heading: Its direction [rad].
        ahead: How far ahead along the route the point is [m].
    """
    x, y = (_place(route, geometry.progress(route, head) + ahead)[0] - head).tolist()
    return (math.atan2(y, x) - heading + math.pi) % (2 * math.pi) - math.pi


def is_facing(route: Floats, head: Floats, heading: float) -> bool:
    """Whether a head faces the entrance: more than 90 degrees off the route where it is and before.

    A head that looks into the outside of a sharp corner is as far off the piece after it, but not
    off the one before.
    """
    at = geometry.progress(route, head)
    along = np.array([_place(route, max(0.0, s))[1] for s in (at, at - AHEAD)])
    return bool((along @ [math.cos(heading), math.sin(heading)] < 0.0).all())


def is_free(world: World) -> bool:
    """Whether nothing is ahead of the head within the reach of antennae that point ahead."""
    robot, places = world.robot, world.places
    reach = robot.link_pitch / 2 + robot.antenna.length
    body, geom = int(places.links[0]), np.zeros(1, np.int32)
    for angle in (_RAYS + world.heading).tolist():
        way = np.array([math.cos(angle), math.sin(angle), 0.0])
        gone = 0.0
        while gone < reach:
            start = world.head + gone * way
            distance = mujoco.mj_ray(world.model, world.data, start, way, None, 1, body, geom)
            if distance < 0.0 or gone + distance > reach:
                break
            if places.obstacles[geom[0]]:
                return False
            gone += distance + 1e-3  # past a part of the robot
    return True


def _place(route: Floats, at: float) -> tuple[Floats, Floats]:
    """Point at an arc length [m] of a polyline, which goes on past its ends, and its direction."""
    along = np.diff(route, axis=0)
    lengths = np.hypot(*along.T)
    ends = np.cumsum(lengths)
    i = min(int(np.searchsorted(ends, at, side="right")), len(lengths) - 1)
    direction = along[i] / lengths[i]
    return route[i + 1] + (at - ends[i]) * direction, direction


def route_of(scene: SceneInstance) -> Floats | None:
    """Corners of the centre line of a scene [m], shape (n, 2), None if it has none."""
    try:
        line: Any = getattr(scene, "route", None)
        route = None if line is None else np.asarray(line, float)
    except Exception as error:
        raise SceneError(f"scene: route raised {raised(error)}") from error
    if route is None:
        return None
    sound = route.ndim == 2 and route.shape[1] == 2 and len(route) > 1 and np.isfinite(route).all()
    if not sound or not np.diff(route, axis=0).any(axis=1).all():
        raise SceneError(
            "scene: expected route to be two points or more, finite, each another than the one "
            f"before, shape (n, 2) [m], found {shortened(repr(route.tolist()))}"
        )
    return route
