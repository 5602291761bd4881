"""A robot in a compiled model: where its parts are, what drives and touches them, what is sound.

Outlines of geoms are seen from above, as figures draw them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from antennate.robots.spec import ANTENNA_PREFIXES, RobotSpec
from antennate.sim.engine import mujoco
from antennate.sim.parts import OBSTACLE_BIT
from antennate.types import Bools, Floats, Ints

ROBOT_AND_OBSTACLE = 3
"""Sum of the `kinds` of a contact between the robot and an obstacle."""


class Places:
    """Indices by part, found once by their names.

    Args:
        model: The compiled model.
        robot: The robot in it.
        prefix: Before its names.

    Attributes:
        root: First coordinate of the head's free joint.
        root_speed: First degree of freedom of it.
        yaw, legs: Coordinates of these joints, shape (Y,) and (2 L,).
        hinges: Coordinates of the hinges under the flex sensors, shape (2, n), (1, n) of a robot
            with one antenna.
        bent: Coordinates of all hinges of the antennae, one antenna after the other, shape (n,).
        bounded: Coordinates of all joints that do not turn without end, shape (n,).
        drives: Actuators of all driven joints in the robot's order, shape (n,).
        driven, turning: Coordinates and degrees of freedom of the same joints, shape (n,).
        links: Bodies of the links, head first, shape (L,).
        leg_geoms: Geoms of the legs, shape (2 L,).
        obstacles: Whether a geom is an obstacle, shape (geoms,).
        own: Whether it is the robot's, shape (geoms,).
        kinds: 1 for the robot's, 2 for an obstacle, 0 for others, shape (geoms,).
        parts: Name of the body of each geom, without the prefix.
    """

    def __init__(self, model: mujoco.MjModel, robot: RobotSpec, prefix: str) -> None:
        def coordinates(names: list[str]) -> Ints:
            return np.array([model.joint(prefix + n).qposadr[0] for n in names], np.int64)

        prefixes = ANTENNA_PREFIXES[: robot.antenna_count]
        bent = coordinates([p + h for p in prefixes for h in robot.antenna.hinge_names])
        names = list(robot.joint_names)
        self.root: int = model.joint(prefix + "root").qposadr[0]
        self.root_speed: int = model.joint(prefix + "root").dofadr[0]
        self.yaw: Ints = coordinates(list(robot.yaw_names))
        self.legs: Ints = coordinates(list(robot.leg_names))
        sensed = robot.antenna.sensed_hinges
        self.bent: Ints = bent
        self.hinges: Ints = bent.reshape(len(prefixes) or len(ANTENNA_PREFIXES), -1)[:, :sensed]
        pitch = coordinates(list(robot.pitch_names))
        elevation = coordinates(list(robot.elevation_names))
        self.bounded: Ints = np.concatenate([self.yaw, pitch, bent, elevation])
        self.drives: Ints = np.array([model.actuator(prefix + n).id for n in names])
        self.driven: Ints = coordinates(names)
        self.turning: Ints = np.array([model.joint(prefix + n).dofadr[0] for n in names])
        self.links: Ints = np.array([model.body(prefix + n).id for n in robot.link_names])
        legs = [model.geom(prefix + n).id for n in robot.leg_names]
        self.leg_geoms: Ints = np.array(legs, np.int64)
        self.obstacles: Bools = (model.geom_contype & OBSTACLE_BIT) != 0
        owner = model.body_rootid[model.geom_bodyid]
        self.own: Bools = owner == model.body(prefix + robot.link_names[0]).id
        self.kinds: Ints = self.own + 2 * self.obstacles.astype(np.int64)
        bodies = [model.body(n).name.removeprefix(prefix) for n in range(model.nbody)]
        self.parts: list[str] = [bodies[n] for n in model.geom_bodyid.tolist()]


class Gears:
    """The joints of a robot in a model, but those of its antennae.

    Args:
        model: The model, whose joints get that friction.
        robot: The robot.
        prefix: Before its names in the model.

    Attributes:
        share: Friction as a share of the torque of the motor, of those joints that have it, (n,).
        drive, dof: Actuators and degrees of freedom of these joints, shape (n,).
        dry: Their friction without a load [N·m], shape (n,).
        damping: Their damping [N·m·s/rad], shape (n,).
    """

    def __init__(self, model: mujoco.MjModel, robot: RobotSpec, prefix: str) -> None:
        self._model = model
        share: dict[str, float] = {}
        for group, joints, _ in robot.groups:
            if group not in ("antennae", "elevation"):
                loaded = robot.servos.of(joints.servo).load_friction
                share |= dict.fromkeys(robot.joint_names[robot.places(group)], loaded)
        names = [name for name in share if share[name] > 0.0]
        self.share: Floats = np.array([share[name] for name in names])
        self.drive: Ints = np.array([model.actuator(prefix + n).id for n in names], np.int64)
        self.dof: Ints = np.array([model.joint(prefix + n).dofadr[0] for n in names], np.int64)
        self.dry: Floats = model.dof_frictionloss[self.dof]
        self.damping: Floats = model.dof_damping[self.dof]

    def step(self, data: mujoco.MjData, count: int) -> None:
        """Advance by `count` physics steps, each with friction from the torques before it."""
        if not len(self.dof):
            mujoco.mj_step(self._model, data, count)
            return
        for _ in range(count):
            motor = data.actuator_force[self.drive] - self.damping * data.qvel[self.dof]
            self._model.dof_frictionloss[self.dof] = self.dry + self.share * abs(motor)
            mujoco.mj_step(self._model, data)


class ServoDrives:
    """The actuators of driven joints, at first as the model has them.

    Args:
        model: The compiled model; its actuators are changed.
        names: Names of the actuators.
        stall_torques: Torque of each at full drive [N·m], shape (n,).
    """

    def __init__(self, model: mujoco.MjModel, names: Sequence[str], stall_torques: Floats) -> None:
        self._model, self._stall = model, stall_torques
        self._at: Ints = np.array([model.actuator(name).id for name in names])
        self._stiffness: Floats = model.actuator_gainprm[self._at, 0]
        self._damping: Floats = model.actuator_biasprm[self._at, 2]
        self._range: Floats = model.actuator_forcerange[self._at]
        self._limited = model.actuator_forcelimited[self._at] != 0
        self._now: Floats = np.repeat([[1.0], [0.0], [0.0], [-1.0], [1.0]], len(names), axis=1)

    def set(self, drives: Floats) -> None:
        """Change gain and limits of all of them from now on.

        The drive is `gain` times that of the model, plus `push`, less `brake` times the speed of
        the joint, within `low` and `high`.

        Args:
            drives: Rows gain [1], push [full drives], brake [full drives·s/rad], low and high
                [full drives], shape (5, n). As the model has them: 1, 0, 0, -1, 1.
        """
        if np.array_equal(drives, self._now):
            return
        self._now = drives.copy()
        gain, push, brake, low, high = drives
        model, at = self._model, self._at
        model.actuator_gainprm[at, 0] = gain * self._stiffness
        model.actuator_biasprm[at, 0] = push * self._stall
        model.actuator_biasprm[at, 1] = -gain * self._stiffness
        model.actuator_biasprm[at, 2] = self._damping - brake * self._stall
        narrow = (low > -1.0) | (high < 1.0)
        most = np.where(self._limited, self._range[:, 1], np.inf)
        bounds = np.clip(np.stack([low, high]) * self._stall, -most, most).T
        model.actuator_forcerange[at] = np.where(narrow[:, None], bounds, self._range)
        model.actuator_forcelimited[at] = self._limited | narrow


class Contacts(NamedTuple):
    """All contacts of the last physics step.

    Attributes:
        geoms: Both geoms of each, shape (k, 2).
        address: Its first row of `force`, negative where it does not push, shape (k,).
        place: Where it is [m], shape (k, 3).
        frame: Its normal, from the first geom to the second, then two tangents, shape (k, 9).
        force: Forces of all constraints [N], shape (rows,).
    """

    geoms: NDArray[np.int32]
    address: NDArray[np.int32]
    place: Floats
    frame: Floats
    force: Floats

    @classmethod
    def of(cls, data: mujoco.MjData) -> Contacts:
        """Contacts of a state."""
        contact: Any = data.contact
        parts = contact.geom, contact.efc_address, contact.pos, contact.frame, data.efc_force
        return cls(*(part.copy() for part in parts))

    @classmethod
    def joined(cls, several: Sequence[Contacts]) -> Contacts:
        """Contacts of several states as if they were of one."""
        before = np.cumsum([0, *(len(each.force) for each in several)])
        parts = [np.concatenate(part) for part in zip(*several, strict=True)]
        shift = np.repeat(before[:-1], [len(each.address) for each in several])
        parts[1] = np.where(parts[1] >= 0, parts[1] + shift, -1)
        return cls._make(parts)

    def between(self, kinds: Ints, total: int) -> tuple[Ints, Floats]:
        """Contacts that push, of two geoms whose kinds have this sum.

        Args:
            kinds: The kind of each geom, shape (geoms,).
            total: The sum.

        Returns:
            Their numbers, shape (n,), and normal forces [N], shape (n,).
        """
        first, second = kinds[self.geoms].T
        which = np.flatnonzero(first + second == total)
        if not len(which):
            return which, np.zeros(0)
        which = which[self.address[which] >= 0]
        return which, self.force[self.address[which]]


SPEED_LIMIT = 1e3
"""No coordinate of a sound world moves faster [m/s or rad/s]."""
DISTANCE_LIMIT = 100.0
"""A head farther than this from the origin left the world [m]."""
ANGLE_LIMIT = 6.3
"""Yaw, pitch and antenna joints cannot turn farther [rad]; legs turn without end."""
HEIGHT_LIMIT = 0.3
"""A head higher than this above the highest ground left the world [m], or one below the lowest."""


def sound(heads: Floats, bounded: Floats, speeds: Floats) -> Bools:
    """Which of B states are within all bounds, shape (B,); arguments as `broken` has them, by row.

    Not a number is beyond every bound.
    """
    with np.errstate(invalid="ignore"):
        return (
            (abs(heads[:, :2]).max(axis=1) < DISTANCE_LIMIT)
            & (heads[:, 2] > 0.0)
            & (heads[:, 2] < HEIGHT_LIMIT)
            & (abs(bounded).max(axis=1, initial=0.0) < ANGLE_LIMIT)
            & (abs(speeds).max(axis=1) < SPEED_LIMIT)
        )


def broken(
    head: Floats, bounded: Floats, speeds: Floats, height_limit: float = HEIGHT_LIMIT
) -> str:
    """What is beyond its bound in a state; empty if nothing is.

    Args:
        head: Position of the head [m], shape (3,).
        bounded: Joints that do not turn without end [rad], shape (n,).
        speeds: All coordinates [m/s or rad/s], shape (nv,).
        height_limit: Height that the head cannot have [m].
    """
    far, height = float(abs(head[:2]).max()), float(head[2])
    angle, speed = float(abs(bounded).max(initial=0.0)), float(abs(speeds).max())
    checks = (
        (far < DISTANCE_LIMIT, f"the head is {far:.3g} m away"),
        (angle < ANGLE_LIMIT, f"a joint is at {angle:.3g} rad"),
        (speed < SPEED_LIMIT, f"a coordinate moves at {speed:.3g} m/s or rad/s"),
        (0.0 < height < height_limit, f"the head is at a height of {height:.3g} m"),
    )
    return next((trouble for sound, trouble in checks if not sound), "")


SPHERE = int(mujoco.mjtGeom.mjGEOM_SPHERE)
CAPSULE = int(mujoco.mjtGeom.mjGEOM_CAPSULE)
ELLIPSOID = int(mujoco.mjtGeom.mjGEOM_ELLIPSOID)
CYLINDER = int(mujoco.mjtGeom.mjGEOM_CYLINDER)
BOX = int(mujoco.mjtGeom.mjGEOM_BOX)
MESH = int(mujoco.mjtGeom.mjGEOM_MESH)

_TURN = np.linspace(0.0, 2.0 * math.pi, 24, endpoint=False)
_RING = np.stack([np.cos(_TURN), np.sin(_TURN)], axis=1)
_BALL = np.concatenate(
    [
        np.column_stack([math.cos(a) * _RING, np.full(len(_RING), math.sin(a))])
        for a in np.linspace(-math.pi / 2, math.pi / 2, 9)
    ]
)
_CORNERS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)
_ROUND = (CAPSULE, CYLINDER)
_UPRIGHT = 0.9999


def outline(model: mujoco.MjModel, data: mujoco.MjData, geom: int) -> Floats:
    """Convex hull of a geom in plan [m], corners counter-clockwise, shape (n, 2).

    A height field is the rectangle around it.
    """
    place, turn = data.geom_xpos[geom], data.geom_xmat[geom].reshape(3, 3)
    kind, disc = model.geom_type[geom], place[:2] + model.geom_size[geom, 0] * _RING
    if kind == SPHERE or (kind in _ROUND and abs(turn[2, 2]) > _UPRIGHT):
        return disc
    if kind == CAPSULE:  # the discs of its ends
        half = model.geom_size[geom, 1] * turn[:2, 2]
        return _hull(np.concatenate([disc + half, disc - half]))
    points = place + _points(model, geom) @ turn.T
    return _hull(points[:, :2])


def _points(model: mujoco.MjModel, geom: int) -> Floats:
    """Points in the geom's own frame whose hull is the geom [m], shape (n, 3)."""
    kind, size = model.geom_type[geom], model.geom_size[geom]
    radius, half = size[0], np.array([0.0, 0.0, size[1]])
    if kind == ELLIPSOID:
        return size * _BALL
    if kind == CYLINDER:
        disc = np.column_stack([radius * _RING, np.zeros(len(_RING))])
        return np.concatenate([disc + half, disc - half])
    if kind == MESH:
        mesh = model.geom_dataid[geom]
        first = model.mesh_vertadr[mesh]
        return model.mesh_vert[first : first + model.mesh_vertnum[mesh]].astype(float)
    box = model.geom_aabb[geom]
    return box[:3] + _CORNERS * box[3:]


def _hull(points: Floats) -> Floats:
    """Convex hull of points in the plane, counter-clockwise (Andrew's monotone chain).

    In plain floats, which are several times as fast here as small arrays.
    """
    ordered = sorted(set(map(tuple, points.tolist())))
    chain: list[tuple[float, ...]] = []
    for half in (ordered, ordered[::-1]):
        side: list[tuple[float, ...]] = []
        for point in half:
            x, y = point
            while len(side) > 1:
                (x0, y0), (x1, y1) = side[-2:]
                if (x1 - x0) * (y - y0) - (y1 - y0) * (x - x0) > 0.0:  # a turn to the left
                    break
                side.pop()
            side.append(point)
        chain.extend(side[:-1])
    return np.array(chain or ordered)
