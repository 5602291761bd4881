"""The tunnel: a corridor with turns, lined and strewn with cylinders that can be pushed.

A cylinder slides and spins under one foot contact of four dimensions: with the elliptic cone its
limit surface is the ellipsoid usual for a sliding patch, isotropic in the plane. Above the floor it
is a vertical capsule whose straight part covers the robot's height, which collides like a cylinder
there.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np

from antennate.errors import SceneError
from antennate.params.scene import CylinderParams, TunnelParams
from antennate.robots.spec import RobotSpec
from antennate.sim.engine import mujoco
from antennate.sim.parts import FLOOR_BIT, OBSTACLE_BIT
from antennate.sim.scenes import geometry
from antennate.sim.scenes.geometry import Arm, Plan, Room
from antennate.sim.scenes.scene import LEFT_BEHIND, TIME_LIMIT, add_floor
from antennate.types import Floats

_WALL_HALF_THICKNESS = 0.02
_WALL_HEIGHT = 0.25
_FOOT_RADIUS = 0.01
_SETTLE_GAP = 0.002
"""Cylinders are set at least this far apart and off the walls [m]."""


class TunnelScene:
    """Draws tunnels.

    Args:
        params: Shape of the corridor, and its cylinders.
        rooms: Its rooms.
        arms: Its blind arms.
        variation: What it changes between trials, fields of `VariationParams`.
    """

    random = True

    def __init__(
        self,
        params: TunnelParams | None = None,
        rooms: tuple[Room, ...] = (),
        arms: tuple[Arm, ...] = (),
        variation: Mapping[str, Any] | None = None,
    ) -> None:
        self._params = params or TunnelParams()
        self._rooms, self._arms = rooms, arms
        self.variation = variation or {}

    def draw(self, robot: RobotSpec, rng: np.random.Generator) -> Tunnel:
        """Draw one tunnel."""
        params = self._params
        if params.free_width - 2 * params.lining_inset < robot.width:
            inset = f", less twice an inset of {params.lining_inset} m" * (params.lining_inset > 0)
            raise SceneError(
                f"tunnel.free_width must be at least the robot's width of {robot.width} m, found "
                f"{params.free_width} m{inset}"
            )
        mirrored = params.mirror == "always"
        if params.mirror == "random":
            mirrored = bool(rng.random() < 0.5)
        plan = plan_of(params, self._rooms, self._arms)
        return build_along(plan, params, robot, rng, mirrored)


def plan_of(params: TunnelParams, rooms: tuple[Room, ...] = (), arms: tuple[Arm, ...] = ()) -> Plan:
    """The passage of these parameters, with rooms and blind arms."""
    width, lining = params.free_width, 2 * params.cylinder.radius
    return Plan(geometry.centre_line(params), width, rooms, arms, lining)


def build_along(
    plan: Plan,
    params: TunnelParams,
    robot: RobotSpec,
    rng: np.random.Generator,
    mirrored: bool = False,
    time_limit: float = TIME_LIMIT,
) -> Tunnel:
    """Draw the cylinders of a passage."""
    centre, distance = plan.centre, params.wall_distance
    walls = (
        plan.line(distance, params.corner_radius),
        plan.line(-distance, params.corner_radius),
    )
    cylinders = _place_cylinders(params, robot, plan, rng)
    if mirrored:
        flip = np.array([1.0, -1.0])
        centre, cylinders = centre * flip, cylinders * flip
        walls = (walls[1] * flip, walls[0] * flip)
    return Tunnel(params, centre, walls, cylinders, time_limit)


@dataclass(frozen=True, slots=True)
class Tunnel:
    """One drawn tunnel. Progress is arc length along its centre line.

    Attributes:
        centre: Corner points of the centre line [m], shape (n, 2).
        walls: Two polylines [m], left and right.
        cylinders: Where the cylinders stand at first [m], shape (m, 2).
        time_limit: Time after which a trial has failed [s].
        parked: Walls far away, that only fill the counts of a batch on a GPU.
    """

    params: TunnelParams
    centre: Floats
    walls: tuple[Floats, Floats]
    cylinders: Floats
    time_limit: float = TIME_LIMIT
    parked: Floats = field(default_factory=lambda: np.zeros((0, 2, 2)))

    @property
    def start(self) -> tuple[float, float, float]:
        """The origin, facing along the first piece."""
        return 0.0, 0.0, 0.0

    @property
    def route(self) -> Floats:
        """The centre line."""
        return self.centre

    @property
    def length(self) -> float:
        """Length of the centre line [m]."""
        return self.params.length

    @property
    def exit(self) -> Floats:
        """The line between the ends of the walls, left and right."""
        return np.array([wall[-1] for wall in self.walls])

    def build(self, spec: mujoco.MjSpec) -> None:
        """Add floor, walls and cylinders."""
        add_floor(spec)
        friction = self.params.cylinder.contact_friction
        for i, (start, end, out) in enumerate(self.pieces()):
            add_wall(spec, f"wall{i}", start, end, out, friction)
        for i, where in enumerate(self.cylinders):
            _add_cylinder(spec, f"cylinder{i}", where, self.params.cylinder)

    def pieces(self) -> Iterator[tuple[Floats, Floats, float]]:
        """Ends of each straight wall [m], shapes (2,), and 1 where its left is outside, or -1."""
        for out, line in zip((1.0, -1.0), self.walls, strict=True):
            yield from ((a, b, out) for a, b in pairwise(line))
        yield from ((start, end, 1.0) for start, end in self.parked)

    def progress(self, head: Floats) -> float:
        """Arc length of the nearest point of the centre line [m]."""
        return geometry.progress(self.centre, head)

    def left(self, head: Floats) -> bool:
        """Whether it is far behind the entrance, beside the walls, or past them."""
        if self.progress(head) < 0.0:
            return math.hypot(*head) >= LEFT_BEHIND
        left, right = self.walls
        return not geometry.contains(np.concatenate([left, right[::-1]]), head)


def _place_cylinders(
    params: TunnelParams,
    robot: RobotSpec,
    plan: Plan,
    rng: np.random.Generator,
) -> Floats:
    placed: list[Floats] = []
    diameter = 2 * params.cylinder.radius + _SETTLE_GAP
    reach = params.free_width / 2 + params.cylinder.radius - _SETTLE_GAP
    for distance in (reach, -reach):
        line = plan.line(distance, max(0.0, params.corner_radius - params.cylinder.radius))
        gaps = diameter + rng.uniform(0.0, 2.0 * params.lining_gap, size=1000)
        start = rng.uniform(0.0, diameter)
        for point in geometry.resample(line, start + np.cumsum(gaps)):
            if params.lining_inset:
                point = _inset(point, plan.centre, rng.uniform(0.0, params.lining_inset))
            if _is_free(point, placed, diameter):
                placed.append(point)
    room = params.free_width / 2 - params.cylinder.radius
    wanted = len(placed) + params.strewn
    start_zone = robot.link_pitch + robot.antenna.length + 2 * params.cylinder.radius
    for _ in range(200 * params.strewn):
        if len(placed) == wanted:
            break
        point = geometry.resample(plan.centre, np.array([rng.uniform(start_zone, params.length)]))[
            0
        ]
        point = point + rng.uniform(-max(room, 0.0), max(room, 0.0), size=2)
        if _is_free(point, placed, diameter):
            placed.append(point)
    if len(placed) < wanted:
        raise SceneError(
            f"tunnel.strewn asks for {params.strewn} cylinders in the corridor, only "
            f"{params.strewn - wanted + len(placed)} find room; widen or lengthen the tunnel, or "
            "strew fewer"
        )
    return np.array(placed).reshape(-1, 2)


def _inset(point: Floats, centre: Floats, way: float) -> Floats:
    """A point moved towards the nearest one of a line, by a way [m]."""
    length = float(np.linalg.norm(np.diff(centre, axis=0), axis=1).sum())
    along = min(max(geometry.progress(centre, point), 0.0), length)
    across = geometry.resample(centre, np.array([along]))[0] - point
    return point + way * across / np.linalg.norm(across)


def _is_free(point: Floats, placed: list[Floats], distance: float) -> bool:
    return all(math.hypot(*(point - other)) >= distance for other in placed)


def add_wall(
    spec: mujoco.MjSpec, name: str, start: Floats, end: Floats, out: float, friction: float
) -> None:
    """Add a wall between points [m], shapes (2,), that lies to their left (out 1) or right (-1)."""
    along = end - start
    length = float(np.linalg.norm(along))
    normal = out * np.array([-along[1], along[0]]) / length
    middle = (start + end) / 2 + normal * _WALL_HALF_THICKNESS
    half = math.atan2(along[1], along[0]) / 2
    spec.worldbody.add_geom(
        name=name,
        type=mujoco.mjtGeom.mjGEOM_BOX,
        pos=[middle[0], middle[1], _WALL_HEIGHT / 2],
        quat=[math.cos(half), 0, 0, math.sin(half)],
        size=[length / 2, _WALL_HALF_THICKNESS, _WALL_HEIGHT / 2],
        friction=[friction, 0, 0],
        condim=3,
        contype=OBSTACLE_BIT,
        conaffinity=OBSTACLE_BIT,
    )


def _add_cylinder(spec: mujoco.MjSpec, name: str, where: Floats, params: CylinderParams) -> None:
    body = spec.worldbody.add_body(name=name, pos=[where[0], where[1], 0.0])
    axes = {"x": [1, 0, 0], "y": [0, 1, 0], "z": [0, 0, 1]}
    for axis, direction in axes.items():
        body.add_joint(name=f"{name}_{axis}", type=mujoco.mjtJoint.mjJNT_SLIDE, axis=direction)
    body.add_joint(name=f"{name}_spin", type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0, 0, 1])
    body.explicitinertial = True
    body.mass = params.mass
    body.ipos = [0, 0, params.height / 2]
    spin = params.mass * params.radius**2
    body.inertia = [spin, spin, spin]
    body.add_geom(
        name=name,
        type=mujoco.mjtGeom.mjGEOM_CAPSULE,
        fromto=[0, 0, 0, 0, 0, params.height],
        size=[params.radius, 0, 0],
        friction=[params.contact_friction, 0, 0],
        condim=3,
        contype=OBSTACLE_BIT,
        conaffinity=OBSTACLE_BIT,
    )
    body.add_geom(
        name=f"{name}_foot",
        type=mujoco.mjtGeom.mjGEOM_SPHERE,
        pos=[0, 0, _FOOT_RADIUS],
        size=[_FOOT_RADIUS, 0, 0],
        friction=[params.friction, params.spin_friction, 0],
        priority=1,
        condim=4,
        contype=0,
        conaffinity=FLOOR_BIT,
    )


_CORNER = TunnelParams(turns_deg=(120.0,))
_U_TURN = TunnelParams(segments=(1.0, 0.8, 1.0), turns_deg=(90.0, 90.0))
_ROOM = TunnelParams(segments=(1.0, 1.8), turns_deg=(90.0,), strewn=0)
_DEAD_END = TunnelParams(segments=(0.7, 1.0), turns_deg=(90.0,), free_width=0.44, strewn=0)
_HEAVY = TunnelParams(cylinder=CylinderParams(mass=0.5))

HARD: Mapping[str, Callable[[], TunnelScene]] = {
    "corner": functools.partial(TunnelScene, _CORNER),
    "uturn": functools.partial(TunnelScene, _U_TURN),
    "room": functools.partial(TunnelScene, _ROOM, rooms=(Room(1, 0.6, 1.6, 1.2, gap=0.5),)),
    "deadend": functools.partial(TunnelScene, _DEAD_END, arms=(Arm(0, 1.1),)),
    "heavy": functools.partial(TunnelScene, _HEAVY),
    "noisy": functools.partial(TunnelScene, variation={"reading_noise": 3.0}),
    "broken": functools.partial(TunnelScene, variation={"broken": "random"}),
}
"""A corner of 120 deg; two of 90 deg to the same side; a room behind a corner, 1 m long and 1.2 m
wide, left by a gap of 0.5 m in the wall opposite; a way that goes on by a branch of 0.44 m at
0.7 m, with a blind end at 1.8 m straight ahead; the tunnel with cylinders of 0.5 kg, with three
times the noise of the readings, with one antenna broken off."""
SCENES = {"tunnel": TunnelScene, **HARD}
"""Scenes of this module by name."""
