"""The kernel of solids, build123d: the only module that imports it. Lengths are in mm.

What is made here is a `Solid` of the kernel, which other modules only hand on. Functions make,
join, cut and move solids, measure them, and write them as STEP and STL.
"""

from __future__ import annotations

import io
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import build123d  # pyright: ignore[reportMissingImports]
import numpy as np
import OCP.BRepTools  # pyright: ignore[reportMissingImports]
import OCP.gp  # pyright: ignore[reportMissingImports]
import OCP.TopLoc  # pyright: ignore[reportMissingImports]

from antennate.types import Floats

ocp: Any = OCP
bd: Any = build123d  # its types do not say what its functions take
Solid = Any
"""A solid of the kernel, or some of them."""
Point = tuple[float, float, float]
Axis = Literal["x", "y", "z"]
_AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
_PLANES = {"x": bd.Plane.YZ, "y": bd.Plane.ZX, "z": bd.Plane.XY}


def block(x: Sequence[float], y: Sequence[float], z: Sequence[float]) -> Solid:
    """A block between two places along each axis."""
    sizes = [max(pair) - min(pair) for pair in (x, y, z)]
    middle = tuple(sum(pair) / 2.0 for pair in (x, y, z))
    return bd.Pos(*middle) * bd.Box(*sizes)


def rod(radius: float, at: Point, length: float, axis: Axis = "z") -> Solid:
    """A cylinder from a point on along an axis, or back with a negative length."""
    way = _AXES[axis] if length > 0 else tuple(-v for v in _AXES[axis])
    return bd.Solid.make_cylinder(radius, abs(length), bd.Plane(origin=at, z_dir=way))


def prism(
    outline: Sequence[tuple[float, float]], along: Sequence[float], axis: Axis = "z"
) -> Solid:
    """A prism over an outline.

    Args:
        outline: Corners, as (x, y) for the axis z, (y, z) for x and (z, x) for y.
        along: First and last place along the axis.
        axis: The axis.
    """
    plane = _PLANES[axis].offset(min(along))
    ring = zip([outline[-1], *outline], outline, strict=False)
    corners = [after for before, after in ring if math.dist(before, after) > 1e-6]
    face = plane * bd.make_face(bd.Polyline(*corners, close=True))
    return bd.extrude(face, max(along) - min(along), dir=plane.z_dir)


def hull(
    circles: Sequence[tuple[float, float, float]],
    edge: Sequence[tuple[float, float]],
    along: Sequence[float],
) -> Solid:
    """A prism along z over the convex hull of circles (x, y, radius) and a straight edge."""
    rims = [bd.Pos(x, y, 0.0) * bd.Circle(radius) for x, y, radius in circles]
    found = bd.make_hull([e for rim in rims for e in rim.edges()] + [bd.Edge.make_line(*edge)])
    face = bd.Pos(0.0, 0.0, min(along)) * found
    return bd.extrude(face, max(along) - min(along), dir=(0.0, 0.0, 1.0))


def coil(radius: float, wire: float, turns: float, ends: tuple[float, float]) -> Solid:
    """A torsion spring about z, in the middle at 0, whose legs leave along x at y = -radius.

    Args:
        radius: Mean radius.
        wire: Diameter of the wire.
        turns: Turns, whole or not.
        ends: Length of the leg that leaves at the bottom towards -x, and of the one at the top.
    """
    height = turns * wire * 1.02
    helix = bd.Helix(wire * 1.02, height, radius)
    helix = bd.Pos(0, 0, -height / 2.0) * bd.Rot(0, 0, -90) * helix
    first, last = helix @ 0, helix @ 1
    before = bd.Line((first.X - ends[0], first.Y, first.Z), first)
    turned = helix % 1
    away = bd.Vector(turned.X, turned.Y, 0).normalized() * ends[1]
    after = bd.Line(last, last + away)
    parts = []
    for line in (before, helix, after):
        start, way = line @ 0, line % 0
        circle = bd.Plane(origin=start, z_dir=way) * bd.Circle(wire / 2.0)
        parts.append(bd.sweep(circle, path=line, is_frenet=True))
    return bd.Compound(children=[part.solids()[0] for part in parts])


def joined(*solids: Solid) -> Solid:
    """The union of solids."""
    first, *others = solids
    return _plain(first.fuse(*others)) if others else first


def cut(solid: Solid, *others: Solid) -> Solid:
    """A solid without others."""
    return _plain(solid.cut(*others)) if others else solid


def common(one: Solid, other: Solid) -> Solid | None:
    """What two solids have in common; None if that is nothing."""
    found = one.intersect(other)
    if found is None:
        return None
    solids = [s for each in _listed(found) for s in each.solids()]
    return bd.Compound(children=solids) if solids else None


def _listed(found: Any) -> list[Any]:
    return list(found) if isinstance(found, list | tuple) else [found]


def _plain(found: Any) -> Solid:
    """One solid, or all in one."""
    solids = [s for each in _listed(found) for s in each.solids()]
    return solids[0] if len(solids) == 1 else bd.Compound(children=solids)


def moved(solid: Solid, by: Point = (0.0, 0.0, 0.0)) -> Solid:
    """A copy at another place."""
    move = ocp.gp.gp_Trsf()
    move.SetTranslation(ocp.gp.gp_Vec(*by))
    return _put(solid, move)


def turned(solid: Solid, angle: float, axis: Axis = "z", about: Point = (0.0, 0.0, 0.0)) -> Solid:
    """A copy turned by an angle [rad] about an axis through a point."""
    turn = ocp.gp.gp_Trsf()
    turn.SetRotation(ocp.gp.gp_Ax1(ocp.gp.gp_Pnt(*about), ocp.gp.gp_Dir(*_AXES[axis])), angle)
    return _put(solid, turn)


def _put(solid: Solid, where: Any) -> Solid:
    """A copy elsewhere that shares faces and edges, as `Shape.moved` copies them, at 8 ms each."""
    return bd.Shape.cast(solid.wrapped.Moved(ocp.TopLoc.TopLoc_Location(where)))


def mirrored(solid: Solid, axis: Axis) -> Solid:
    """A copy mirrored at the plane across an axis through the origin."""
    return solid.mirror(bd.Plane(origin=(0, 0, 0), z_dir=_AXES[axis]))


def together(solids: Iterable[Solid]) -> Solid:
    """Solids as one object, which stay apart."""
    return bd.Compound(children=[s for solid in solids for s in solid.solids()])


def count(solid: Solid) -> int:
    """How many separate solids it has."""
    return len(solid.solids())


def volume(solid: Solid | None) -> float:
    """Volume [mm³]."""
    return 0.0 if solid is None else float(solid.volume)


def moments(solid: Solid) -> tuple[float, Floats, Floats]:
    """Volume [mm³], its centre [mm], shape (3,), and its moments about that [mm⁵], shape (3, 3)."""
    centre = solid.center(bd.CenterOf.MASS)
    return volume(solid), np.array(tuple(centre)), np.array(solid.matrix_of_inertia)


def bounds(solid: Solid) -> tuple[Point, Point]:
    """Least and largest corner."""
    box = solid.bounding_box()
    return (box.min.X, box.min.Y, box.min.Z), (box.max.X, box.max.Y, box.max.Z)


@dataclass(frozen=True)
class Mesh:
    """Triangles of a solid.

    Attributes:
        points: Corners [mm], shape (n, 3).
        triangles: Indices of the corners of each, shape (m, 3).
    """

    points: Floats
    triangles: np.ndarray[Any, np.dtype[np.int64]]


def mesh(solid: Solid, tolerance: float = 0.02, turn: float = 0.2) -> Mesh:
    """Triangles that leave the solid by no more than a distance, and turn by no more [rad]."""
    ocp.BRepTools.BRepTools.Clean_s(
        solid.wrapped
    )  # what measuring left of a coarser mesh has holes
    points, triangles = solid.tessellate(tolerance, turn)
    return Mesh(np.array([tuple(p) for p in points]), np.array(triangles, dtype=np.int64))


def step(solids: Sequence[tuple[str, Solid]]) -> bytes:
    """A STEP file with named solids; copies of one, which share its faces, need its name."""
    children = []
    for name, solid in solids:
        bodies = solid.solids()
        for body in bodies:
            body.label = "body"
        child = bodies[0] if len(bodies) == 1 else bd.Compound(children=bodies)
        child.label = name
        children.append(child)
    whole = children[0] if len(children) == 1 else bd.Compound(label="antennate", children=children)
    file = io.BytesIO()
    bd.export_step(whole, file, timestamp="2020-01-01T00:00:00")
    return file.getvalue()


def outlines(solid: Solid, eye: Point, up: Point) -> tuple[list[Floats], list[Floats]]:
    """Edges of a drawing as polylines, those in sight and the hidden ones, each of shape (n, 2).

    Args:
        solid: What is drawn.
        eye: Direction from which it is looked at.
        up: Direction that points up on the sheet.
    """
    far = tuple(1e4 * v for v in eye)
    seen, hidden = solid.project_to_viewport(far, viewport_up=up, look_at=(0, 0, 0))
    return [_polyline(edge) for edge in seen], [_polyline(edge) for edge in hidden]


def _polyline(edge: Any) -> Floats:
    if edge.geom_type == bd.GeomType.LINE:
        places = [0.0, 1.0]
    else:
        places = np.linspace(0.0, 1.0, max(4, min(40, int(edge.length / 0.25))))
    return np.array([[p.X, p.Y] for p in (edge.position_at(t) for t in places)])
