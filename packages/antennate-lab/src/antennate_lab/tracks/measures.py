"""The wall that antennae touch, their shapes and angles, and what each criterion is worth."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from antennate.antenna.shapes import Outline, Shape, classify, held, outline, pointing
from antennate.errors import BadInputError
from antennate.studies.columns import Ends, column, tabular
from antennate.studies.statistics import mean95
from antennate.types import Bools, Floats, Ints
from antennate_lab.tracks.cleaning import Antennae
from antennate_lab.tracks.config import CriteriaParams, TracksConfig, TrackWallParams

FREE, UNKNOWN = -1, -2
"""Stand for no contact and for a frame that is not known, among shapes."""
SHAPES = tuple(shape.name.lower() for shape in Shape)
NAMES = {FREE: "free", UNKNOWN: "unknown"} | {shape: shape.name.lower() for shape in Shape}
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


@tabular
class Wall:
    """A wall in the unit of the file."""

    kind: str
    """`none`, `file`, `line` or `circle`."""
    numbers: tuple[float, ...] = ()
    """Two points of a line as x, y, x, y; centre and radius of a circle as x, y, r."""
    fitted: bool = False
    """Whether it was fitted to the tips."""
    rms: float | None = None
    """Root mean square distance of the tips that it was fitted to; `null` if it was not."""

    def distance(self, points: Floats) -> Floats:
        """Distance of points (..., 2): below 0 outside a circle, and on one side of a line."""
        if self.kind == "circle":
            x, y, radius = self.numbers
            return radius - np.hypot(points[..., 0] - x, points[..., 1] - y)
        x0, y0, x1, y1 = self.numbers
        across = (x1 - x0) * (points[..., 1] - y0) - (y1 - y0) * (points[..., 0] - x0)
        return across / np.hypot(x1 - x0, y1 - y0)


@dataclass(frozen=True)
class Antenna:
    """One antenna over time.

    Attributes:
        trial: Number of its animal.
        side: `left` or `right`.
        rate: Frames a second [Hz].
        points: In the body's frame, ahead and outwards, shape (n, k, 2), in antenna lengths.
        outline: Its angles.
        distance: Of its nearest point to the wall over its length, shape (n,); 0 without a wall.
    """

    trial: int
    side: str
    rate: float
    points: Floats
    outline: Outline
    distance: Floats

    @property
    def known(self) -> Bools:
        """Frames in which every point is known, shape (n,)."""
        return np.isfinite(self.outline.length) & ~np.isnan(self.distance)


def wall_of(params: TrackWallParams, file: str, tips: Floats, length: float) -> Wall:
    """The wall of a file.

    It is fitted as follows: of many lines or circles through two or three random tips, the one at
    which most tips lie is taken, if nearly none lie beyond; then least squares over those tips.

    Args:
        params: What is given.
        file: The file, for messages.
        tips: Where the tips were, in the file's unit, shape (n, 2).
        length: Length of the antennae, in the same unit.
    """
    given = params.line if params.kind == "line" else params.circle
    if params.kind in ("none", "file") or given is not None:
        return Wall(kind=params.kind, numbers=tuple(given or ()))
    known, near = tips[np.isfinite(tips).all(axis=1)], NEAR * length
    numbers = _best(params.kind, known, near) if len(known) >= _LEAST_TIPS else None
    for _ in range(_ROUNDS):
        if numbers is not None:
            at = abs(Wall(kind=params.kind, numbers=numbers).distance(known)) < near
            numbers = _THROUGH[params.kind](known[at]) if at.sum() >= _LEAST_TIPS else None
    wall = None if numbers is None else Wall(kind=params.kind, numbers=numbers)
    if wall is None or not _fixed(wall, known[abs(wall.distance(known)) < near]):
        raise BadInputError(
            f"{file}: expected tips along a {params.kind} to fit the wall, found too few of "
            f"{len(known)} there; give --wall.{params.kind}"
        )
    off = wall.distance(known)
    rms = float(np.sqrt(np.mean(off[abs(off) < near] ** 2)))
    return replace(wall, fitted=True, rms=rms)


def require_inside(file: str, wall: Wall, bases: Floats) -> None:
    """Check that bases (n, 2) of antennae lie in a circle; if not, it is in another unit."""
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
    most, best = 0, None
    for pick in rng.integers(0, len(tips), (_CANDIDATES, 2 if kind == "line" else 3)):
        numbers = _THROUGH[kind](tips[pick])
        if numbers is None:
            continue
        off = Wall(kind=kind, numbers=numbers).distance(judges)
        beyond = (off < -near).mean()
        beyond = min(beyond, (off > near).mean()) if kind == "line" else beyond
        count = int((abs(off) < near).sum())
        if count > most and beyond <= MOST_BEYOND:
            most, best = count, numbers
    return best


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


def length_of(points: Floats) -> float:
    """Median length of an antenna, from points of shape (n, k, 2); NaN if it was never known."""
    length = outline(points).length
    known = length[np.isfinite(length)]
    return float(np.median(known)) if len(known) else float("nan")


def measured(trial: int, side: str, animal: Antennae, wall: Wall) -> Antenna:
    """Outline of one antenna of an animal, and its distance to the wall."""
    points = animal.sides[side]
    length, distance = length_of(points), np.zeros(animal.frames)
    if wall.kind == "file":
        contact = animal.contact.get(side)
        if contact is None:
            raise BadInputError(
                f"{animal.track.file}: expected a column with the contact of the {side} "
                "antenna, found none; name it with --columns.contact, or choose another --wall.kind"
            )
        distance = np.where(np.isfinite(contact), np.where(contact > 0.5, 0.0, np.inf), np.nan)
    elif wall.kind != "none":
        near = wall.distance(animal.places[side])
        near = abs(near) if wall.kind == "line" else near
        distance = near.min(axis=1) / length
    return Antenna(trial, side, animal.rate, points / length, outline(points), distance)


def shapes_of(criteria: CriteriaParams, antenna: Antenna) -> Ints:
    """The shape of every frame, FREE or UNKNOWN where it has none, shape (n,).

    With three points or more the shape follows from the bend; forward and backward also need the
    tip's segment to point there. With two it follows from the direction alone: straight is not
    known. Shapes that are not held for `duration` are transitions.
    """
    angles = antenna.outline
    if antenna.points.shape[1] > 2:
        shape = classify(criteria, angles.flex, angles.offset)
        aims = pointing(angles.end, criteria.angle)
        bent = (shape == Shape.FORWARD) | (shape == Shape.BACKWARD)
        shape = np.where(bent & (aims != shape), int(Shape.TRANSITION), shape)
    else:
        shape = pointing(angles.direction, criteria.angle)
    shape = np.where(antenna.distance < criteria.gap, shape, FREE)
    shape = np.where(antenna.known, shape, UNKNOWN)
    return held(shape.astype(np.int64), round(criteria.duration * antenna.rate))


def shares(shapes: Sequence[Ints]) -> Floats:
    """Share of each shape among the frames in contact of several antennae, shape (4,).

    NaN without contact.
    """
    joined = np.concatenate([frames[frames >= 0] for frames in shapes])
    if len(joined) == 0:
        return np.full(len(Shape), np.nan)
    return np.bincount(joined, minlength=len(Shape)) / len(joined)


def by_trial(criteria: CriteriaParams, antennae: Sequence[Antenna]) -> Floats:
    """Shares of every trial that has contact, shape (trials, 4)."""
    trials: dict[int, list[Ints]] = {}
    for antenna in antennae:
        trials.setdefault(antenna.trial, []).append(shapes_of(criteria, antenna))
    table = np.array([shares(shapes) for shapes in trials.values()]).reshape(-1, len(Shape))
    return table[np.isfinite(table).all(axis=1)]


@tabular
class ShapeShare:
    """Share of a shape among the frames in contact; no interval below five trials."""

    share: float | None = column("share", interval="share_95")
    """Mean over trials; `null` without contact, and of `straight` with two points along an
    antenna."""
    share_95: Ends | None = column("95 %")


@tabular
class Varied:
    """Shares with one criterion changed."""

    criterion: str
    """Name of the criterion."""
    value: float
    """Changed value, in the unit of the flag."""
    share: dict[str, float | None]
    """Mean share of each shape over trials."""
    change: float | None = column("change")
    """Largest change of a share; `null` if no antenna is in contact."""


def over_trials(criteria: CriteriaParams, antennae: Sequence[Antenna]) -> dict[str, ShapeShare]:
    """Mean share of each shape over trials, with its 95 % interval (Student's t).

    A share lies between 0 and 1, and so does its interval. It is None with fewer than `ENOUGH`
    trials, as so few say little about the next.
    """
    means = dict.fromkeys(SHAPES, ShapeShare(share=None, share_95=None))
    hidden = Shape.STRAIGHT if antennae and antennae[0].points.shape[1] == 2 else None
    table = by_trial(criteria, antennae)
    for shape, values in zip(Shape, table.T, strict=True):
        if len(values) and shape != hidden:
            mean, ends = mean95(values, 0.0, 1.0)
            means[NAMES[shape]] = ShapeShare(share=mean, share_95=ends)
    return means


def sensitivity(config: TracksConfig, antennae: Sequence[Antenna]) -> list[Varied]:
    """Shares over trials with each criterion less and more by `vary`, one row for each."""
    rows: list[Varied] = []
    usual = over_trials(config.criteria, antennae)
    for name in config.read_criteria:
        for factor in (1.0 - config.vary, 1.0 + config.vary):
            value = factor * getattr(config.criteria, name)
            other = over_trials(config.criteria.model_copy(update={name: value}), antennae)
            share = {shape: each.share for shape, each in other.items()}
            change = _change(usual, other)
            rows.append(Varied(criterion=name, value=value, share=share, change=change))
    return rows


def _change(one: Mapping[str, ShapeShare], other: Mapping[str, ShapeShare]) -> float | None:
    """Largest difference of a share; None if one of them has none."""
    pairs = [(one[name].share, other[name].share) for name in SHAPES]
    return max((abs(b - a) for a, b in pairs if a is not None and b is not None), default=None)


def curvatures(criteria: CriteriaParams, antennae: Sequence[Antenna]) -> dict[str, list[float]]:
    """Median curvature at each inner point, base first [rad per length], of each shape seen."""
    if not antennae or antennae[0].points.shape[1] < 3:
        return {}
    shapes = np.concatenate([shapes_of(criteria, antenna) for antenna in antennae])
    bends = np.concatenate([antenna.outline.curvature for antenna in antennae])
    return {
        shape.name.lower(): np.median(bends[shapes == shape], axis=0).tolist()
        for shape in Shape
        if (shapes == shape).any()
    }
