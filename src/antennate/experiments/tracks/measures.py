"""Shapes and angles of cleaned antennae, frame by frame, and what each criterion is worth."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from antennate.antenna.shapes import Outline, Shape, classify, held, outline, pointing
from antennate.errors import BadInputError
from antennate.experiments.tracks.cleaning import Antennae
from antennate.experiments.tracks.config import CriteriaParams, TracksConfig
from antennate.experiments.tracks.walls import Wall
from antennate.studies.statistics import mean95
from antennate.types import Bools, Floats, Ints

FREE, UNKNOWN = -1, -2
"""Stand for no contact and for a frame that is not known, among shapes."""
SHAPES = tuple(shape.name.lower() for shape in Shape)
NAMES = {FREE: "free", UNKNOWN: "unknown"} | {shape: shape.name.lower() for shape in Shape}


@dataclass(frozen=True)
class Seen:
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


def length_of(points: Floats) -> float:
    """Median length of an antenna, from points of shape (n, k, 2); NaN if it was never known."""
    length = outline(points).length
    known = length[np.isfinite(length)]
    return float(np.median(known)) if len(known) else float("nan")


def seen(trial: int, side: str, found: Antennae, wall: Wall) -> Seen:
    """Measure one antenna of an animal."""
    measured, length = outline(found.sides[side]), length_of(found.sides[side])
    distance = np.zeros(found.frames)
    if wall.kind == "file":
        contact = found.contact.get(side)
        if contact is None:
            raise BadInputError(
                f"{found.track.file}: expected a column with the contact of the {side} "
                "antenna, found none; name it with --columns.contact, or choose another --wall.kind"
            )
        distance = np.where(np.isfinite(contact), np.where(contact > 0.5, 0.0, np.inf), np.nan)
    elif wall.kind != "none":
        near = wall.distance(found.places[side])
        near = abs(near) if wall.kind == "line" else near
        distance = near.min(axis=1) / length
    return Seen(trial, side, found.rate, found.sides[side] / length, measured, distance)


def shapes_of(criteria: CriteriaParams, antenna: Seen) -> Ints:
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
    joined = np.concatenate([found[found >= 0] for found in shapes])
    if len(joined) == 0:
        return np.full(len(Shape), np.nan)
    return np.bincount(joined, minlength=len(Shape)) / len(joined)


def by_trial(criteria: CriteriaParams, antennae: Sequence[Seen]) -> Floats:
    """Shares of every trial that has contact, shape (trials, 4)."""
    found: dict[int, list[Ints]] = {}
    for one in antennae:
        found.setdefault(one.trial, []).append(shapes_of(criteria, one))
    table = np.array([shares(shapes) for shapes in found.values()]).reshape(-1, len(Shape))
    return table[np.isfinite(table).all(axis=1)]


def over_trials(criteria: CriteriaParams, antennae: Sequence[Seen]) -> dict[str, Any]:
    """Mean share of each shape over trials, with its 95 % interval (Student's t).

    A share lies between 0 and 1, and so does its interval. It is None with fewer than `ENOUGH`
    trials, as so few say little about the next. With two points along the antenna straight cannot
    be seen: its share is None.
    """
    table = by_trial(criteria, antennae)
    found = {}
    for name, column in zip(SHAPES, table.T, strict=True):
        mean, ends = mean95(column, 0.0, 1.0)
        found[name] = {"share": mean, "share_95": ends}
    if antennae and antennae[0].points.shape[1] == 2:
        found[Shape.STRAIGHT.name.lower()] = {"share": None, "share_95": None}
    return found


def sensitivity(config: TracksConfig, antennae: Sequence[Seen]) -> list[dict[str, Any]]:
    """Shares over trials with each criterion less and more by `vary`, one row for each."""
    rows: list[dict[str, Any]] = []
    usual = over_trials(config.criteria, antennae)
    for name in config.read_criteria:
        for factor in (1.0 - config.vary, 1.0 + config.vary):
            value = factor * getattr(config.criteria, name)
            other = over_trials(config.criteria.model_copy(update={name: value}), antennae)
            share = {shape: other[shape]["share"] for shape in SHAPES}
            seen_shapes = [shape for shape in SHAPES if share[shape] is not None]
            change = max(abs(share[shape] - usual[shape]["share"]) for shape in seen_shapes)
            rows.append({"criterion": name, "value": value, "share": share, "change": change})
    return rows


def curvatures(criteria: CriteriaParams, antennae: Sequence[Seen]) -> dict[str, list[float]]:
    """Median curvature at each inner point, base first [rad per length], of each shape seen."""
    if not antennae or antennae[0].points.shape[1] < 3:
        return {}
    shapes = np.concatenate([shapes_of(criteria, one) for one in antennae])
    bends = np.concatenate([one.outline.curvature for one in antennae])
    return {
        shape.name.lower(): np.median(bends[shapes == shape], axis=0).tolist()
        for shape in Shape
        if (shapes == shape).any()
    }
