"""What only the simulation knows of robots in episodes: it goes into `info`, never further."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import Any, get_args

import numpy as np

from antennate.envs.reward import TERMS
from antennate.sim.episode import Outcome
from antennate.types import Bools, Floats, Ints

OUTCOMES: tuple[Outcome, ...] = get_args(Outcome)
ONE_EACH = "seed", "episode_number", "t", "progress", "length", "side", "force", "maneuver"
"""Parts of a `Truth` that are one number of each robot."""


@dataclass(slots=True)
class Truth:
    """What only the simulation knows of B robots; each call makes arrays of its own.

    Attributes:
        seed, episode_number: What the episodes follow from, shape (B,).
        t: Time since the start [s], shape (B,).
        head: Position and heading of the head [m, m, rad], shape (B, 3).
        progress: How far the head has come [m], shape (B,); `length` is that of the exit.
        side: Side of the route 0.6 m ahead from the mean heading of the last gait cycle: +1 left,
            -1 right, 0 straight ahead or a scene without a route, shape (B,).
        force: Sum of the normal forces on the robot [N], shape (B,).
        maneuver: What was done, a `Maneuver`, shape (B,).
        terms: Terms of the reward in the order of `TERMS`, shape (B, terms).
        outcome: Number in `OUTCOMES`, -1 while an episode goes on, shape (B,).
        reason: Why an episode is invalid, by row.
    """

    seed: Ints
    episode_number: Ints
    t: Floats
    head: Floats
    progress: Floats
    length: Floats
    side: Ints
    force: Floats
    maneuver: Ints
    terms: Floats
    outcome: Ints
    reason: dict[int, str] = field(default_factory=dict[int, str])

    @classmethod
    def empty(cls, batch: int) -> Truth:
        """Truth of rows without an episode."""
        whole = (np.zeros(batch, np.int64) for _ in range(4))
        real = (np.zeros(batch) for _ in range(4))
        seed, episode, side, maneuver = whole
        t, progress, length, force = real
        head, terms = np.zeros((batch, 3)), np.zeros((batch, len(TERMS)))
        outcome = np.full(batch, -1)
        return cls(seed, episode, t, head, progress, length, side, force, maneuver, terms, outcome)


def replace_rows(truth: Truth, other: Truth, rows: Bools) -> Truth:
    """A truth with some rows, shape (B,), of another one."""
    parts: dict[str, Any] = {
        name: np.where(rows.reshape(-1, *[1] * (value.ndim - 1)), getattr(other, name), value)
        for name in (f.name for f in fields(Truth))
        if isinstance(value := getattr(truth, name), np.ndarray)
    }
    return Truth(**parts, reason=dict(truth.reason))
