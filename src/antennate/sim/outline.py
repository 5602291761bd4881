"""What stands in a scene as seen from above, for figures: one convex polygon a geom."""

from __future__ import annotations

import math

import numpy as np

from antennate.sim.engine import mujoco
from antennate.types import Floats

_SPHERE = int(mujoco.mjtGeom.mjGEOM_SPHERE)
_CAPSULE = int(mujoco.mjtGeom.mjGEOM_CAPSULE)
_ELLIPSOID = int(mujoco.mjtGeom.mjGEOM_ELLIPSOID)
_CYLINDER = int(mujoco.mjtGeom.mjGEOM_CYLINDER)
_MESH = int(mujoco.mjtGeom.mjGEOM_MESH)
_TURN = np.linspace(0.0, 2.0 * math.pi, 24, endpoint=False)
_RING = np.stack([np.cos(_TURN), np.sin(_TURN)], axis=1)
_BALL = np.concatenate(
    [
        np.column_stack([math.cos(a) * _RING, np.full(len(_RING), math.sin(a))])
        for a in np.linspace(-math.pi / 2, math.pi / 2, 9)
    ]
)
_CORNERS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)
_ROUND = (_CAPSULE, _CYLINDER)
_UPRIGHT = 0.9999


def outline(model: mujoco.MjModel, data: mujoco.MjData, geom: int) -> Floats:
    """Convex hull of a geom in plan [m], corners counter-clockwise, shape (n, 2).

    A height field is the rectangle around it.
    """
    place, turn = data.geom_xpos[geom], data.geom_xmat[geom].reshape(3, 3)
    kind, disc = model.geom_type[geom], place[:2] + model.geom_size[geom, 0] * _RING
    if kind == _SPHERE or (kind in _ROUND and abs(turn[2, 2]) > _UPRIGHT):
        return disc
    if kind == _CAPSULE:  # the discs of its ends
        half = model.geom_size[geom, 1] * turn[:2, 2]
        return _hull(np.concatenate([disc + half, disc - half]))
    points = place + _points(model, geom) @ turn.T
    return _hull(points[:, :2])


def _points(model: mujoco.MjModel, geom: int) -> Floats:
    """Points in the geom's own frame whose hull is the geom [m], shape (n, 3)."""
    kind, size = model.geom_type[geom], model.geom_size[geom]
    radius, half = size[0], np.array([0.0, 0.0, size[1]])
    if kind == _ELLIPSOID:
        return size * _BALL
    if kind == _CYLINDER:
        disc = np.column_stack([radius * _RING, np.zeros(len(_RING))])
        return np.concatenate([disc + half, disc - half])
    if kind == _MESH:
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
