"""A synthetic animal beside a straight wall: antennae of known shape, with errors like a network's.

Each antenna has five points. The left one touches the wall or is free; the right one is always
free. The body walks along the wall and stands off so far that the tip just touches.

Separated shapes are four, far from what divides them, and known by their drawing. Continuous ones
are drawn from ranges across every border; their truth is what the criteria say of the exact points.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from antennate.antenna.shapes import Shape, outline
from antennate.types import Floats, Ints
from antennate_lab.tracks.config import (
    CriteriaParams,
    PointsParams,
    SyntheticParams,
    TrackWallParams,
)
from antennate_lab.tracks.measures import FREE, Antenna, shapes_of
from antennate_lab.tracks.track import Track

POINTS = PointsParams(
    left=tuple(f"left_{i}" for i in range(5)), right=tuple(f"right_{i}" for i in range(5))
)
WALL = TrackWallParams(kind="line")
_TURNS = {  # direction of the first segment, and turn at each inner point [deg], outwards
    Shape.FORWARD: (60.0, (-18.0, -18.0, -18.0)),
    Shape.BACKWARD: (75.0, (22.0, 22.0, 22.0)),
    Shape.STRAIGHT: (50.0, (0.0, 0.0, 0.0)),
    Shape.TRANSITION: (45.0, (50.0, 0.0, -50.0)),
    FREE: (40.0, (0.0, 0.0, 0.0)),
}
_FIRST, _EVEN, _OPPOSED = (60.0, 90.0), (-16.0, 16.0), (-20.0, 20.0)
"""Ranges of continuous shapes [deg]: the first segment, a turn at every inner point, and one that
is added to the first turn and taken from the last; the tip stays outermost."""
_OFF, _SHARE_FREE = (0.05, 0.6), 0.2
"""Distance of a free tip from the wall over the antenna's length, and share of dwells without
contact."""
_ERRORS = (0.0, 0.5, 1.6, 3.1, 7.1, 19.3, 78.0, 300.0)
_QUANTILES = (0.0, 0.25, 0.5, 0.75, 0.9, 0.95, 0.99, 1.0)
"""Errors of antennal tips of Harpegnathos saltator [px] and their quantiles: network of
sz-George-l/naps-duel-tracker (MIT licence) on its 2598 labelled instances."""
_LONGEST, _SHORTEST = 1.6, 0.4
"""Time for which a shape is held [s]."""
_SPEED, _BODY, _APART = 0.5, 1.5, 0.2
"""Walking speed over the antenna's length [1/s]; lengths of body and between bases over it."""


def animal(
    params: SyntheticParams, criteria: CriteriaParams, seed: int, trial: int
) -> tuple[Track, Ints]:
    """One recording and its left antenna's true shapes, frame by frame; FREE is no contact."""
    rng = np.random.default_rng([seed, trial])
    separated = params.shapes == "separated"
    kind, off, base, turns = _dwells(params, rng, _separated if separated else _continuous)
    t = np.arange(params.frames) / params.rate
    base = base + np.radians(6.0) * np.sin(2.0 * np.pi * 0.5 * t + rng.uniform(0, 2 * np.pi))
    left = _antenna(params.length, base, turns)
    right = _antenna(params.length, np.full(len(t), np.radians(40.0)), 0.0 * turns)
    off = off * params.length
    head = np.stack([_SPEED * params.length * t, -left[:, -1, 1] - off], axis=1)
    points = {"head": head, "tail": head - (_BODY * params.length, 0.0)}
    points |= {n: head + left[:, i] for i, n in enumerate(POINTS.left)}
    points |= {n: head + right[:, i] * (1.0, -1.0) for i, n in enumerate(POINTS.right)}
    if separated:
        truth = kind.astype(np.int64)
    else:
        exact = Antenna(trial, "left", params.rate, left, outline(left), off / params.length)
        truth = shapes_of(criteria, exact)
    return _spoiled(params, points, rng), truth


def _separated(rng: np.random.Generator) -> tuple[float, ...]:
    """A shape, how far off the wall, the first direction and the turns [deg] of a dwell."""
    kind = list(_TURNS)[int(rng.integers(len(_TURNS)))]
    first, bends = _TURNS[kind]
    return (kind, 0.6 if kind == FREE else 0.0, first, *bends)


def _continuous(rng: np.random.Generator) -> tuple[float, ...]:
    """A dwell as of `_separated`, but NaN for its shape, which only the criteria know."""
    off = float(rng.uniform(*_OFF)) if rng.random() < _SHARE_FREE else 0.0
    first, even, opposed = (float(rng.uniform(*ends)) for ends in (_FIRST, _EVEN, _OPPOSED))
    return (np.nan, off, first, even + opposed, even, even - opposed)


def _dwells(
    params: SyntheticParams,
    rng: np.random.Generator,
    draw: Callable[[np.random.Generator], tuple[float, ...]],
) -> tuple[Floats, Floats, Floats, Floats]:
    """Shape (n,), distance (n,), first direction (n,) and turns (n, 3) [rad], dwell by dwell."""
    rows, held = list[tuple[float, ...]](), 0
    while held < params.frames:
        kind, off, first, *bends = draw(rng)
        frames = round(float(rng.uniform(_SHORTEST, _LONGEST)) * params.rate)
        grow = 1.0 + 0.1 * float(rng.uniform(-1.0, 1.0))
        rows += [(kind, off, first, *(grow * bend for bend in bends))] * frames
        held += frames
    table = np.array(rows[: params.frames], np.float64)
    return table[:, 0], table[:, 1], np.radians(table[:, 2]), np.radians(table[:, 3:])


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
    points, likely = ({n: v[frames] for n, v in values.items()} for values in (seen, scores))
    return Track("synthetic", "", frames, params.rate, points, likely)
