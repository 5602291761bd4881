"""A part as small cubes, layer by layer as it is printed: how thin its walls are, what overhangs.

The mesh stands upright on the bed at z = 0. Cubes along a vertical line lie inside between every
second crossing of the line with the mesh.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import ndimage as _ndimage

from antennate.types import Bools, Floats
from antennate_build.kernel import Mesh

ndimage: Any = _ndimage  # its types do not say what its functions return
LONGEST_BRIDGE = 12.0
"""Longest gap that is bridged in the air [mm] (assumed: what printers of plastic wire manage)."""
_LEDGE = 0.6
"""Farthest that something may stand out over nothing [mm] (assumed: a line and a half)."""
_SPECKLE = 0.5
"""Area of overhang below which nothing is told [mm²]: steps of slopes as cubes."""


@dataclass(frozen=True)
class Voxels:
    """Cubes of a part.

    Attributes:
        inside: Which cubes are inside, shape (x, y, z), with a rim of empty ones.
        size: Edge of a cube [mm].
        origin: Middle of the first cube [mm], shape (3,).
    """

    inside: Bools
    size: float
    origin: Floats


def voxels(mesh: Mesh, size: float) -> Voxels:
    """The cubes of a mesh whose surface is closed."""
    low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
    origin = low - 1.5 * size + np.array([1.3e-4, 2.1e-4, 1.7e-4])  # off faces and edges
    shape = np.ceil((high - origin) / size).astype(int) + 3
    flips = np.zeros(shape, bool)
    corners = (mesh.points[mesh.triangles] - origin) / size
    for triangle in corners:
        _mark(flips, triangle)
    return Voxels(np.logical_xor.accumulate(flips, axis=2), size, origin)


def _mark(flips: Bools, triangle: Floats) -> None:
    """Flip the first cube above a triangle on each vertical line that it crosses."""
    (ax, ay, az), (bx, by, bz), (cx, cy, cz) = triangle
    area = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay)
    if area == 0.0:
        return
    i0, j0 = (int(np.ceil(min(v))) for v in ((ax, bx, cx), (ay, by, cy)))
    i1, j1 = (int(np.floor(max(v))) for v in ((ax, bx, cx), (ay, by, cy)))
    if i1 < i0 or j1 < j0:
        return
    x, y = np.arange(i0, i1 + 1)[:, None], np.arange(j0, j1 + 1)[None, :]
    b = ((x - ax) * (cy - ay) - (cx - ax) * (y - ay)) / area
    c = ((bx - ax) * (y - ay) - (x - ax) * (by - ay)) / area
    within = (b >= 0) & (c >= 0) & (b + c <= 1)
    i, j = np.nonzero(within)
    z = az + b[i, j] * (bz - az) + c[i, j] * (cz - az)
    np.logical_xor.at(flips, (i + i0, j + j0, np.ceil(z).astype(int)), True)


def thinnest(part: Voxels, most: float) -> tuple[float, Floats]:
    """Thinnest wall [mm] in steps of two cubes, at most `most`, and a place in it, shape (3,).

    A wall is as thick as the largest ball that reaches it. Edges, which no ball fills, are no
    walls: what is left of them lies within 0.6 radii of a ball.
    """
    reach = math.ceil(0.5 * most / part.size) + 1
    depth = np.sqrt(_squares(~part.inside, reach)) * part.size
    thickness, place = most, np.full(3, np.nan)
    while thickness > part.size:
        radius = thickness / 2.0
        balls = depth >= radius - 0.5 * part.size - 1e-9
        far = np.sqrt(_squares(balls, math.ceil(1.6 * radius / part.size) + 1)) * part.size
        far[~part.inside] = 0.0
        if far.max() <= 1.6 * radius:
            return thickness, place
        where = np.unravel_index(int(far.argmax()), far.shape)
        place = part.origin + part.size * np.array(where)
        thickness -= 2.0 * part.size
    return max(thickness, 0.0), place


def _squares(marked: Bools, reach: int) -> np.ndarray[Any, np.dtype[np.int16]]:
    """Squared distance from each cube to the nearest marked one, in cubes; exact within a reach.

    Farther ones have more than its square. Seven times as fast as a transform without limit.
    """
    far = np.where(marked, 0, 4 * reach**2).astype(np.int16)
    for axis in range(far.ndim):
        lines = np.moveaxis(far, axis, 0)
        before = lines.copy()
        for step in range(1, min(reach, len(lines) - 1) + 1):
            np.minimum(lines[step:], before[:-step] + step**2, out=lines[step:])
            np.minimum(lines[:-step], before[step:] + step**2, out=lines[:-step])
    return far


@dataclass(frozen=True)
class Overhang:
    """Something that is printed over nothing.

    Attributes:
        height: Over the bed [mm].
        area: [mm²].
        reach: Farthest from what carries it [mm].
    """

    height: float
    area: float
    reach: float


def layers(part: Voxels) -> Floats:
    """Area of each layer from the bed up [mm²], shape (n,); one without material has 0."""
    areas = part.inside.sum(axis=(0, 1)) * part.size**2
    filled = np.flatnonzero(areas)
    return areas[filled[0] : filled[-1] + 1]


def overhangs(part: Voxels) -> list[Overhang]:
    """What needs support: steeper than 45°, neither a short ledge nor a bridge."""
    found = []
    inside, size = part.inside, part.size
    layers = np.flatnonzero(inside.any(axis=(0, 1)))
    around = np.ones((3, 3), bool)
    for k in layers[1:]:
        below = ndimage.binary_dilation(inside[:, :, k - 1], around)
        free = inside[:, :, k] & ~below
        if free.sum() * size**2 < _SPECKLE:
            continue
        labels, count = ndimage.label(free, around)
        pieces, _ = ndimage.label(inside[:, :, k], around)
        for n in range(1, count + 1):
            spot = labels == n
            height = float(k - layers[0]) * size
            piece = np.isin(pieces, np.unique(pieces[spot]))  # its own, an island or not
            if told := _overhang(spot, below & piece, size, height):
                found.append(told)
    return found


def _overhang(spot: Bools, held: Bools, size: float, height: float) -> Overhang | None:
    area = float(spot.sum()) * size**2
    if area < _SPECKLE:
        return None
    if not held.any():
        return Overhang(height, area, float("inf"))
    reach = float(ndimage.distance_transform_edt(~held)[spot].max()) * size
    if reach <= _LEDGE + size or _is_bridge(spot, held, reach, size):
        return None
    return Overhang(height, area, reach)


def _is_bridge(spot: Bools, held: Bools, reach: float, size: float) -> bool:
    """Whether what is free is carried on both sides, and short enough."""
    if 2.0 * reach > LONGEST_BRIDGE:
        return False
    rim = np.argwhere(ndimage.binary_dilation(spot, np.ones((3, 3), bool)) & held)
    ends = size * (rim - np.argwhere(spot).mean(axis=0))
    least = 0.6 * reach
    return len(ends) > 1 and bool(
        ((ends.max(axis=0) >= least) & (ends.min(axis=0) <= -least)).any()
    )
