"""A synthetic animal beside a straight wall: antennae of known shape, with errors like a network's.

Each antenna has five points. The left one touches the wall in one of four shapes, or is free; the
right one is always free. The body walks along the wall and stands off so far that the tip just
touches.
"""

from __future__ import annotations

import numpy as np

from antennate.antenna.shapes import Shape
from antennate.experiments.tracks.config import PointsParams, SyntheticParams, TrackWallParams
from antennate.experiments.tracks.track import Track
from antennate.types import Floats, Ints

POINTS = PointsParams(
    left=tuple(f"left_{i}" for i in range(5)), right=tuple(f"right_{i}" for i in range(5))
)
WALL = TrackWallParams(kind="line")
FREE = -1
"""Stands for no contact among shapes."""
_TURNS = {  # direction of the first segment, and turn at each inner point [deg], outwards
    Shape.FORWARD: (60.0, (-18.0, -18.0, -18.0)),
    Shape.BACKWARD: (75.0, (22.0, 22.0, 22.0)),
    Shape.STRAIGHT: (50.0, (0.0, 0.0, 0.0)),
    Shape.TRANSITION: (45.0, (50.0, 0.0, -50.0)),
    FREE: (40.0, (0.0, 0.0, 0.0)),
}
_ERRORS = (0.0, 0.5, 1.6, 3.1, 7.1, 19.3, 78.0, 300.0)
_QUANTILES = (0.0, 0.25, 0.5, 0.75, 0.9, 0.95, 0.99, 1.0)
"""Errors of antennal tips of Harpegnathos saltator [px] and their quantiles: network of
sz-George-l/naps-duel-tracker (MIT licence) on its 2598 labelled instances."""
_LONGEST, _SHORTEST = 1.6, 0.4
"""Time for which a shape is held [s]."""
_SPEED, _BODY, _APART = 0.5, 1.5, 0.2
"""Walking speed over the antenna's length [1/s]; lengths of body and between bases over it."""


def animal(params: SyntheticParams, seed: int, trial: int) -> tuple[Track, Ints]:
    """One recording and its left antenna's true shapes, frame by frame; FREE is no contact."""
    rng = np.random.default_rng([seed, trial])
    truth, base, turns = _dwells(params, rng)
    t = np.arange(params.frames) / params.rate
    base = base + np.radians(6.0) * np.sin(2.0 * np.pi * 0.5 * t + rng.uniform(0, 2 * np.pi))
    left = _antenna(params.length, base, turns)
    right = _antenna(params.length, np.full(len(t), np.radians(40.0)), 0.0 * turns)
    off = np.where(truth == FREE, 0.6 * params.length, 0.0)
    head = np.stack([_SPEED * params.length * t, -left[:, -1, 1] - off], axis=1)
    points = {"head": head, "tail": head - (_BODY * params.length, 0.0)}
    points |= {n: head + left[:, i] for i, n in enumerate(POINTS.left)}
    points |= {n: head + right[:, i] * (1.0, -1.0) for i, n in enumerate(POINTS.right)}
    return _spoiled(params, points, rng), truth


def _dwells(params: SyntheticParams, rng: np.random.Generator) -> tuple[Ints, Floats, Floats]:
    """True shape (n,), direction of the first segment (n,) and turns (n, 3) [rad]."""
    kinds, rows, held = list(_TURNS), [], 0
    while held < params.frames:
        kind = kinds[int(rng.integers(len(kinds)))]
        first, bends = _TURNS[kind]
        frames = round(float(rng.uniform(_SHORTEST, _LONGEST)) * params.rate)
        grow = 1.0 + 0.1 * float(rng.uniform(-1.0, 1.0))
        rows += [(kind, first, *(grow * bend for bend in bends))] * frames
        held += frames
    table = np.array(rows[: params.frames], np.float64)
    return table[:, 0].astype(np.int64), np.radians(table[:, 1]), np.radians(table[:, 2:])


def _antenna(length: float, base: Floats, turns: Floats) -> Floats:
    """Points of an antenna from the head, ahead and outwards, shape (n, 5, 2)."""
    angle = base[:, None] + np.cumsum(np.hstack([0.0 * turns[:, :1], turns]), axis=1)
    steps = length / 4.0 * np.stack([np.cos(angle), np.sin(angle)], axis=2)
    start = np.broadcast_to([0.0, _APART / 2.0 * length], (len(base), 1, 2))
    return np.concatenate([start, start + np.cumsum(steps, axis=1)], axis=1)


def _spoiled(params: SyntheticParams, points: dict[str, Floats], rng: np.random.Generator) -> Track:
    """The points with errors, missing ones, exchanged sides, and frames twice or absent."""
    count = params.frames
    seen, scores = dict[str, Floats](), dict[str, Floats]()
    for name, exact in points.items():
        size = params.error * np.interp(rng.random(count), _QUANTILES, _ERRORS)
        way = rng.uniform(0.0, 2.0 * np.pi, count)
        seen[name] = exact + size[:, None] * np.stack([np.cos(way), np.sin(way)], axis=1)
        drawn = rng.random(count) / params.missing if params.missing else np.ones(count)
        seen[name][drawn < 0.5] = np.nan
        lost = (drawn >= 0.5) & (drawn < 1.0)
        seen[name][lost] += params.length * rng.uniform(-1.0, 1.0, (int(lost.sum()), 2))
        scores[name] = np.where(lost, rng.uniform(0.0, 0.5, count), rng.uniform(0.7, 1.0, count))
    exchanged = rng.random(count) < params.swapped
    for a, b in zip(POINTS.left, POINTS.right, strict=True):
        for values in (seen, scores):
            first = values[a][exchanged].copy()
            values[a][exchanged], values[b][exchanged] = values[b][exchanged], first
    inner = (np.arange(count) > 0) & (np.arange(count) < count - 1)
    copies = np.ones(count, np.int64)
    copies[inner & (rng.random(count) < params.repeated)] = 2
    copies[inner & (rng.random(count) < params.repeated)] = 0
    frames = np.repeat(np.arange(count), copies)
    every, likely = ({n: v[frames] for n, v in values.items()} for values in (seen, scores))
    return Track("synthetic", "", frames, params.rate, every, likely)
