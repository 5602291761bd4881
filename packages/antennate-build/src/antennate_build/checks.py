"""Geometry is checked, not looked at: parts that meet, walls, overhangs, meshes.

Parts meet where the volume that two of them have in common is above `LARGEST_OVERLAP`.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import trimesh

from antennate.types import Floats
from antennate_build import kernel, voxels
from antennate_build.kernel import Solid

LARGEST_OVERLAP = 1.0
"""Volume that two parts may have in common [mm³]: what is left where faces touch."""
SMALLEST_BED = 3.0
"""Smallest first layer that stays on the bed, with a brim [mm²] (assumed)."""
CUBE = 0.1
"""Edge of the cubes by which walls and overhangs of a small part are judged [mm]."""
_MOST_CUBES = 6e6
Up = Literal["x", "-x", "y", "-y", "z", "-z"]
"""Direction of a part's frame that points up while it is printed."""


@dataclass(frozen=True)
class Check:
    """One thing that was checked.

    Attributes:
        name: What.
        found: What was found, in words.
        good: Whether it is as it must be.
        warn: Whether it is good and yet to be looked at.
    """

    name: str
    found: str
    good: bool
    warn: bool = False


@dataclass(frozen=True)
class Print:
    """A part as it lies on the bed.

    Attributes:
        solid: The solid, upright on the bed at z = 0.
        mesh: Its triangles.
        closed: Whether they close it, and it is one body.
        wall: Thinnest wall [mm], no more than what is asked for.
        thin: A place in it, in words; empty where nothing is thinner than asked for.
        overhangs: What needs support.
        layers: Area of its layers from the bed up [mm²].
    """

    solid: Solid
    mesh: kernel.Mesh
    closed: bool
    wall: float
    thin: str
    overhangs: tuple[voxels.Overhang, ...]
    layers: Floats


def upright(solid: Solid, up: Up) -> Solid:
    """A part turned so that a direction of its frame points up, and put onto the bed."""
    quarter = math.pi / 2.0
    turns = {"x": (-quarter, "y"), "-x": (quarter, "y"), "y": (quarter, "x"), "-y": (-quarter, "x")}
    if up == "-z":
        solid = kernel.turned(solid, math.pi, "x")
    elif up != "z":
        angle, axis = turns[up]
        solid = kernel.turned(solid, angle, "y" if axis == "y" else "x")
    low, _ = kernel.bounds(solid)
    return kernel.moved(solid, (-low[0], -low[1], -low[2]))


def printed(solid: Solid, up: Up, wall: float, tolerance: float = 0.02) -> Print:
    """A part as it is printed, with all that is judged of it.

    Args:
        solid: The part.
        up: Which of its directions points up.
        wall: Thinnest wall that is asked for [mm].
        tolerance: Of the mesh [mm].
    """
    put = upright(solid, up)
    mesh = kernel.mesh(put, tolerance)
    whole = trimesh.Trimesh(mesh.points, mesh.triangles)
    closed = bool(whole.is_watertight and whole.is_winding_consistent and whole.volume > 0)
    size = max(CUBE, float(np.prod(np.ptp(mesh.points, axis=0)) / _MOST_CUBES) ** (1.0 / 3.0))
    cubes = voxels.voxels(mesh, size)
    least, place = voxels.thinnest(cubes, wall)
    where = "" if np.isnan(place).any() else "at " + ", ".join(f"{v:.1f}" for v in place)
    return Print(
        put,
        mesh,
        closed and kernel.count(solid) == 1,
        least,
        where,
        tuple(voxels.overhangs(cubes)),
        voxels.layers(cubes),
    )


def walls_check(prints: Mapping[str, Print], asked: float) -> Check:
    """The check that walls are as thick as is asked for [mm]; a warning where one is not."""
    thin = [f"{name} {part.wall:.1f} mm" for name, part in prints.items() if part.wall < asked]
    told = f"thinner than {asked:g} mm: {', '.join(thin)}" if thin else f"{asked:g} mm or more"
    return Check("walls", told, True, bool(thin))


def layers_check(prints: Mapping[str, Print]) -> Check:
    """The check that each part keeps to the bed, and has material in each of its layers."""
    bed, name = min((float(part.layers[0]), name) for name, part in prints.items())
    least, other = min((float(part.layers.min()), name) for name, part in prints.items())
    loose = [
        name for name, part in prints.items() if any(math.isinf(o.reach) for o in part.overhangs)
    ]
    told = f"smallest first layer {bed:.0f} mm² ({name}), smallest of all {least:.1f} ({other})"
    told += f"; begin in the air: {', '.join(loose)}" if loose else "; none begins in the air"
    return Check("layers", told, bed >= SMALLEST_BED and least > 0.0)


def stl(mesh: kernel.Mesh) -> bytes:
    """A binary STL file [mm]."""
    data: Any = trimesh.Trimesh(mesh.points, mesh.triangles).export(file_type="stl")
    return bytes(data)


def overlap(one: Solid, other: Solid) -> float:
    """Volume that two solids have in common [mm³]; boxes about them are compared first."""
    return _overlap(one, kernel.bounds(one), other, kernel.bounds(other))


Box = tuple[kernel.Point, kernel.Point]


def _overlap(one: Solid, box: Box, other: Solid, next_box: Box) -> float:
    """The same with their boxes, which take long to find."""
    (low, high), (below, above) = box, next_box
    apart = any(a > d or c > b for a, b, c, d in zip(low, high, below, above, strict=True))
    return 0.0 if apart else kernel.volume(kernel.common(one, other))


@dataclass(frozen=True)
class Meeting:
    """Two parts and what they have in common.

    Attributes:
        volume: [mm³].
        parts: Their names.
        where: Angle or angles, in words.
    """

    volume: float
    parts: tuple[str, str]
    where: str


def worst(meetings: Iterable[Meeting]) -> Meeting | None:
    """The largest overlap; None without any."""
    return max(meetings, key=lambda found: found.volume, default=None)


Named = tuple[str, Solid]


def between(still: Sequence[Named], moving: Sequence[Named], where: str) -> Iterator[Meeting]:
    """Overlaps of parts of two bodies."""
    boxes = [kernel.bounds(body) for _, body in moving]
    for name, solid in still:
        box = kernel.bounds(solid)
        for (other, body), its in zip(moving, boxes, strict=True):
            yield Meeting(_overlap(solid, box, body, its), (name, other), where)


def judged(name: str, meetings: Sequence[Meeting]) -> Check:
    """The check that no two parts meet."""
    found = worst(meetings)
    if found is None or found.volume <= LARGEST_OVERLAP:
        most = 0.0 if found is None else found.volume
        return Check(name, f"{len(meetings)} pairs, at most {most:.2f} mm³ in common", True)
    one, other = found.parts
    return Check(name, f"{one} and {other}: {found.volume:.1f} mm³ in common {found.where}", False)
