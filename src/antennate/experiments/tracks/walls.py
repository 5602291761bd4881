"""The wall that antennae touch: a line or a circle, given or fitted to where the antennae reach."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from antennate.errors import BadInputError
from antennate.experiments.tracks.config import TrackWallParams
from antennate.types import Floats

_CANDIDATES, _JUDGES = 3000, 800
"""Walls through random tips that are tried, and tips that judge each."""
NEAR = 0.1
"""A tip lies at a fitted wall if it is nearer, over the antenna's length."""
MOST_BEYOND = 0.05
"""No larger share of tips lies beyond a wall: errors of tracking."""
_MOST_OUTSIDE = 0.5
"""No larger share of the bases lies outside a circle around the animals."""
_LEAST_TIPS = 50
_SECTORS, _LEAST_SECTORS = 36, 12
"""A circle is fixed by tips in a third of the directions from its centre."""
_ROUNDS = 5


@dataclass(frozen=True)
class Wall:
    """A wall in the unit of the file.

    Attributes:
        kind: `none`, `line` or `circle`.
        numbers: x, y, x, y of two points of a line; x, y and r of a circle.
        fitted: Whether it was fitted.
        rms: Root mean square distance of the points it was fitted to, None if it was given.
    """

    kind: str
    numbers: tuple[float, ...] = ()
    fitted: bool = False
    rms: float | None = None

    def distance(self, points: Floats) -> Floats:
        """Distance of points (..., 2): below 0 outside a circle, and on one side of a line."""
        if self.kind == "circle":
            x, y, radius = self.numbers
            return radius - np.hypot(points[..., 0] - x, points[..., 1] - y)
        x0, y0, x1, y1 = self.numbers
        across = (x1 - x0) * (points[..., 1] - y0) - (y1 - y0) * (points[..., 0] - x0)
        return across / np.hypot(x1 - x0, y1 - y0)


def wall_of(params: TrackWallParams, file: str, tips: Floats, length: float) -> Wall:
    """The wall of a file.

    It is fitted as follows: of many lines or circles through two or three random tips, the one at
    which most tips lie is taken, if nearly none lie beyond; then least squares over those tips.

    Args:
        params: What is given.
        file: The file, for messages.
        tips: Where the tips were, in the file's unit, shape (n, 2).
        length: Length of the antennae, in the same unit.

    Raises:
        BadInputError: It has to be fitted and the tips do not fix it.
    """
    given = params.line if params.kind == "line" else params.circle
    if params.kind in ("none", "file") or given is not None:
        return Wall(params.kind, tuple(given or ()))
    known, near = tips[np.isfinite(tips).all(axis=1)], NEAR * length
    numbers = _best(params.kind, known, near) if len(known) >= _LEAST_TIPS else None
    for _ in range(_ROUNDS):
        if numbers is not None:
            at = abs(Wall(params.kind, numbers).distance(known)) < near
            numbers = _THROUGH[params.kind](known[at]) if at.sum() >= _LEAST_TIPS else None
    wall = None if numbers is None else Wall(params.kind, numbers)
    if wall is None or not _fixed(wall, known[abs(wall.distance(known)) < near]):
        raise BadInputError(
            f"{file}: expected tips along a {params.kind} to fit the wall, found too few of "
            f"{len(known)} there; give --wall.{params.kind}"
        )
    off = wall.distance(known)
    rms = float(np.sqrt(np.mean(off[abs(off) < near] ** 2)))
    return Wall(wall.kind, wall.numbers, True, rms)


def require_inside(file: str, wall: Wall, bases: Floats) -> None:
    """Check that bases (n, 2) of antennae lie in a circle; if not, it is in another unit.

    Raises:
        BadInputError: Most of them lie outside.
    """
    known = bases[np.isfinite(bases).all(axis=1)]
    if wall.kind != "circle" or not len(known):
        return
    outside = float((wall.distance(known) < 0).mean())
    if outside > _MOST_OUTSIDE:
        low, high = known.min(axis=0), known.max(axis=0)
        raise BadInputError(
            f"{file}: expected the animals within the circle, found {100 * outside:.0f} % of the "
            f"bases of their antennae outside: these lie at x {low[0]:.4g} to {high[0]:.4g} and y "
            f"{low[1]:.4g} to {high[1]:.4g}; is --wall.circle in the unit of the file?"
        )


def _best(kind: str, tips: Floats, near: float) -> tuple[float, ...] | None:
    """Of walls through random tips the one at which most tips lie; None if there is none."""
    rng = np.random.default_rng(0)
    judges = tips[rng.permutation(len(tips))[:_JUDGES]]
    found: tuple[int, tuple[float, ...] | None] = (0, None)
    for pick in rng.integers(0, len(tips), (_CANDIDATES, 2 if kind == "line" else 3)):
        numbers = _THROUGH[kind](tips[pick])
        if numbers is None:
            continue
        off = Wall(kind, numbers).distance(judges)
        beyond = (off < -near).mean()
        beyond = min(beyond, (off > near).mean()) if kind == "line" else beyond
        count = int((abs(off) < near).sum())
        if count > found[0] and beyond <= MOST_BEYOND:
            found = count, numbers
    return found[1]


def _fixed(wall: Wall, tips: Floats) -> bool:
    """Whether tips at a wall fix it; a circle needs them from a third of all directions."""
    if len(tips) < _LEAST_TIPS:
        return False
    if wall.kind == "line":
        return True
    off = tips - wall.numbers[:2]
    sectors = np.arctan2(off[:, 1], off[:, 0]) / (2.0 * np.pi) * _SECTORS
    return len(np.unique(np.floor(sectors))) >= _LEAST_SECTORS


def _circle_through(points: Floats) -> tuple[float, ...] | None:
    """Circle nearest to points (n, 2), after Kasa; None if they lie on a line."""
    middle = points.mean(axis=0)
    off = points - middle
    matrix = np.column_stack([2.0 * off, np.ones(len(off))])
    (x, y, c), _, rank, _ = np.linalg.lstsq(matrix, (off**2).sum(axis=1), rcond=1e-9)
    square = float(c + x * x + y * y)
    if rank < 3 or square <= 0:
        return None
    return float(x + middle[0]), float(y + middle[1]), math.sqrt(square)


def _line_through(points: Floats) -> tuple[float, ...] | None:
    """Line nearest to points (n, 2), by two of its points; None if all are the same."""
    middle = points.mean(axis=0)
    _, sizes, (along, _) = np.linalg.svd(points - middle, full_matrices=False)
    if sizes[0] == 0:
        return None
    way = (points - middle) @ along
    ends = [middle + w * along for w in (way.min(), way.max())]
    return tuple(float(v) for v in np.concatenate(ends))


_THROUGH: dict[str, Callable[[Floats], tuple[float, ...] | None]] = {
    "line": _line_through,
    "circle": _circle_through,
}
