"""What a model shows: its colours, and its shapes as plain arrays.

Shapes are packed once; then where they are and which forces act. Another process draws it without
the engine.
"""

from __future__ import annotations

import io
import struct
import zipfile
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from antennate.errors import BadInputError
from antennate.robots.spec import ANTENNA_PREFIXES
from antennate.sim.engine import mujoco
from antennate.sim.parts import ANTENNA_BIT, BODY_BIT, FLOOR_BIT, GROUND_BIT, LEG_BIT, OBSTACLE_BIT
from antennate.sim.places import BOX, CAPSULE, CYLINDER, ELLIPSOID, MESH, SPHERE, Contacts
from antennate.types import Bools, Floats, Ints

Colour = tuple[float, float, float, float]

_UNPAINTED = np.array([0.5, 0.5, 0.5, 1.0], dtype=np.float32)
"""The engine's colour of a geom that has none of its own."""
_FLOOR: Colour = (0.97, 0.97, 0.97, 1.0)
_GROUND: Colour = (0.90, 0.88, 0.83, 1.0)
_OBSTACLE: Colour = (0.88, 0.80, 0.66, 0.6)
_BODY: Colour = (0.34, 0.34, 0.38, 1.0)
_LEG: Colour = (0.53, 0.55, 0.60, 1.0)


def colours(model: mujoco.MjModel, sides: tuple[Colour, Colour]) -> NDArray[np.float32]:
    """Colour of each geom, red, green, blue and opacity, 0 to 1, shape (ngeom, 4).

    Args:
        model: The compiled model; geoms that it paints itself keep their colours.
        sides: Colours of the left and the right antenna.
    """
    painted = model.geom_rgba.copy()
    bare = (painted == _UNPAINTED).all(axis=1) & (model.geom_matid < 0)
    kind = model.geom_contype
    painted[bare & ((kind & GROUND_BIT) != 0)] = _GROUND
    painted[bare & ((kind & FLOOR_BIT) != 0)] = _FLOOR
    for bit, colour in (
        (OBSTACLE_BIT, _OBSTACLE),
        (BODY_BIT, _BODY),
        (LEG_BIT, _LEG),
        (ANTENNA_BIT, sides[0]),
    ):
        painted[bare & (kind == bit)] = colour
    right = [ANTENNA_PREFIXES[1] in model.geom(i).name for i in range(model.ngeom)]
    painted[bare & (kind == ANTENNA_BIT) & np.array(right)] = sides[1]
    return painted


_DRAWN = (SPHERE, CAPSULE, ELLIPSOID, CYLINDER, BOX, MESH)
_PLANE = int(mujoco.mjtGeom.mjGEOM_PLANE)
_SLIDE, _FREE = int(mujoco.mjtJoint.mjJNT_SLIDE), int(mujoco.mjtJoint.mjJNT_FREE)
_HIDDEN_GROUP = 3
"""Geoms of this group and above are collision shapes that no viewer of the engine shows."""
_OURS = LEG_BIT | BODY_BIT | ANTENNA_BIT
_LARGEST = 1 << 26
_SNAPSHOT = struct.Struct("<dIII")
"""Begin of a snapshot: time [s], geoms, contacts, rows of constraint forces."""

Poses = NDArray[np.float32]
"""Place and rotation matrix of each shape, row by row, shape (n, 12)."""
Arrows = NDArray[np.float32]
"""Place [m] and normal force on the robot [N] of each contact, shape (k, 6)."""


class Shapes(NamedTuple):
    """The shapes of a model.

    Attributes:
        geom: Numbers of their geoms, shape (n,).
        sides: 1 for a geom of the robot, 2 for the floor, 0 for others, shape (geoms,).
        kind: SPHERE, CAPSULE, ELLIPSOID, CYLINDER, BOX or MESH, shape (n,).
        size: Half sizes as the engine has them [m], shape (n, 3).
        colour: Red, green, blue and opacity, 0 to 255, shape (n, 4).
        robot: Which belong to the robot, shape (n,).
        moves: Which can move, shape (n,).
        body: Number of the body that can be dragged, -1 of none, shape (n,).
        mesh: Number of its mesh, -1 of none, shape (n,).
        vertices: Corners of all meshes [m], shape (v, 3).
        faces: Triangles of all meshes, numbers of corners of that mesh, shape (f, 3).
        ends: Where the corners and the triangles of each mesh end, shape (m, 2).
        floor: Height of the floor [m], shape (1,); NaN without one.
    """

    geom: Ints
    sides: Ints
    kind: Ints
    size: NDArray[np.float32]
    colour: NDArray[np.uint8]
    robot: Bools
    moves: Bools
    body: Ints
    mesh: Ints
    vertices: NDArray[np.float32]
    faces: Ints
    ends: Ints
    floor: Floats

    def pack(self) -> bytes:
        """All of it as bytes, for another process."""
        file = io.BytesIO()
        arrays = {name: getattr(self, name) for name in self._fields}
        np.savez(file, allow_pickle=False, **arrays)
        return file.getvalue()

    @classmethod
    def unpack(cls, content: bytes) -> Shapes:
        """Shapes from the bytes of `pack`."""
        try:
            with np.load(io.BytesIO(content[:_LARGEST]), allow_pickle=False) as file:
                return cls(*(file[name] for name in cls._fields))
        except (ValueError, KeyError, OSError, EOFError, zipfile.BadZipFile) as error:
            raise BadInputError(f"expected the shapes of a model, found {error}") from None


def snapshot(data: mujoco.MjData) -> bytes:
    """All that a picture of a state needs, as the engine has it, for another process.

    What of it is drawn is found there, by `picture`, so that the simulation soon goes on.
    """
    places, contacts = data.geom_xpos, Contacts.of(data)
    counts = len(places), len(contacts.geoms), len(contacts.force)
    head = _SNAPSHOT.pack(data.time, *counts)
    return b"".join((head, places.data, data.geom_xmat.data, *(part.data for part in contacts)))


def picture(content: bytes, shapes: Shapes) -> tuple[float, Poses, Arrows] | None:
    """Time [s] of a snapshot, where the shapes are, and normal forces of obstacles on the robot.

    None if it is of another model, whose shapes have not come.
    """
    try:
        t, geoms, count, rows = _SNAPSHOT.unpack_from(content)
        if geoms != len(shapes.sides):
            return None
        arrays, at = list[NDArray[Any]](), _SNAPSHOT.size
        for kind, *shape in (
            *((float, geoms, 3), (float, geoms, 9)),
            *((np.int32, count, 2), (np.int32, count), (float, count, 3), (float, count, 9)),
            (float, rows),
        ):
            arrays.append(np.ndarray(shape, kind, content, at))
            at += arrays[-1].nbytes
        places, turned, *parts = arrays
        contacts = Contacts._make(parts)
        poses = np.empty((len(shapes.geom), 12), np.float32)
        poses[:, :3], poses[:, 3:] = places[shapes.geom], turned[shapes.geom]
        which, force = contacts.between(shapes.sides, 1)  # the robot's, and no floor
    except (struct.error, TypeError, ValueError, IndexError) as error:
        raise BadInputError(f"expected a snapshot, found {error}") from None
    arrows = np.empty((len(which), 6), np.float32)
    arrows[:, :3] = contacts.place[which]
    sign = np.where(shapes.sides[contacts.geoms[which, 1]] == 1, 1.0, -1.0)
    arrows[:, 3:] = contacts.frame[which, :3] * (sign * force)[:, None]
    return t, poses, arrows


class VisibleModel:
    """A model and what can be seen of it.

    Args:
        model: The compiled model.
        sides: Colours of the left and the right antenna.
    """

    def __init__(self, model: mujoco.MjModel, sides: tuple[Colour, Colour]) -> None:
        self._model = model
        painted = colours(model, sides)
        has = model.geom_matid >= 0
        painted[has] = model.mat_rgba[model.geom_matid[has]]
        seen = np.isin(model.geom_type, _DRAWN) & (model.geom_group < _HIDDEN_GROUP)
        self._shown: Ints = np.flatnonzero(seen & (painted[:, 3] > 0))
        self._colour = np.rint(255 * painted[self._shown]).astype(np.uint8)
        self._ours = (model.geom_contype & _OURS) != 0
        self._floor = (model.geom_contype & FLOOR_BIT) != 0
        self._slides = {body: found for body in range(model.nbody) if (found := self._free(body))}

    def shapes(self) -> Shapes:
        """What does not change while it runs."""
        model, shown = self._model, self._shown
        body = model.geom_bodyid[shown]
        planes = np.flatnonzero(model.geom_type == _PLANE)
        mesh = np.where(model.geom_type[shown] == MESH, model.geom_dataid[shown], -1)
        numbers = range(model.nmesh)
        return Shapes(
            geom=shown,
            sides=self._ours + 2 * self._floor.astype(np.int64),
            kind=model.geom_type[shown].astype(np.int64),
            size=model.geom_size[shown].astype(np.float32),
            colour=self._colour,
            robot=self._ours[shown],
            moves=model.body_weldid[body] != 0,
            body=np.where([int(each) in self._slides for each in body], body, -1).astype(np.int64),
            mesh=mesh.astype(np.int64),
            vertices=model.mesh_vert.reshape(-1, 3).astype(np.float32),
            faces=model.mesh_face.reshape(-1, 3).astype(np.int64),
            ends=np.array(
                [
                    (
                        model.mesh_vertadr[i] + model.mesh_vertnum[i],
                        model.mesh_faceadr[i] + model.mesh_facenum[i],
                    )
                    for i in numbers
                ],
                np.int64,
            ).reshape(-1, 2),
            floor=np.array([float(model.geom_pos[planes[0], 2]) if len(planes) else np.nan]),
        )

    def poses(self, data: mujoco.MjData) -> Poses:
        """Where the shapes are."""
        poses = np.empty((len(self._shown), 12), np.float32)
        poses[:, :3] = data.geom_xpos[self._shown]
        poses[:, 3:] = data.geom_xmat[self._shown]
        return poses

    def move(self, data: mujoco.MjData, body: int, x: float, y: float) -> bool:
        """Put a body that can be dragged to x, y [m], at rest; False if it is none.

        The engine wakes it if it slept.
        """
        if body not in self._slides:
            return False
        across, along, speed = self._slides[body]
        place = data.xpos[body]
        data.qpos[across] += x - place[0]
        data.qpos[along] += y - place[1]
        data.qvel[speed : speed + 2] = 0.0
        mujoco.mj_forward(self._model, data)
        return True

    def _free(self, body: int) -> tuple[int, int, int] | None:
        """Coordinates of x and y and the first speed of a body that slides over the floor."""
        model = self._model
        geoms = np.flatnonzero(model.geom_bodyid == body)
        count, first = model.body_jntnum[body], model.body_jntadr[body]
        if not len(geoms) or self._ours[geoms].any() or not count or model.body_parentid[body]:
            return None
        kinds = model.jnt_type[first : first + count].tolist()
        at, speed = int(model.jnt_qposadr[first]), int(model.jnt_dofadr[first])
        if kinds[0] == _FREE:
            return at, at + 1, speed
        axes = model.jnt_axis[first : first + 2]
        plain = kinds[:2] == [_SLIDE, _SLIDE] and np.array_equal(axes, np.eye(3)[:2])
        return (at, at + 1, speed) if plain else None
