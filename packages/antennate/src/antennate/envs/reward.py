"""The reward of a decision, term by term: the one table, with its version."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from antennate.sim.scenes.wall import GAP, Wall
from antennate.types import Floats

REWARD_VERSION = 1
"""Version of the reward. A change of a term or a weight raises it, and the environments get a new
version too."""


@dataclass(frozen=True, slots=True)
class Term:
    """One term of the reward.

    Attributes:
        name: What it is called in `info`.
        weight: Reward for one of its unit.
        unit: What is counted.
        meaning: When it is given.
    """

    name: str
    weight: float
    unit: str
    meaning: str


PROGRESS = Term("progress", 1.0, "m", "progress along the route since the decision before")
TIME = Term("time", -0.01, "decision", "every decision")
EXIT = Term("exit", 1.0, "exit", "the decision in which the head goes out by the exit")
EARLY = Term(
    "early",
    TIME.weight,
    "decision",
    "an end before the time limit that is not the exit: every decision that remained",
)
HOLD = Term("hold", -0.2, "m", f"scene `wall` alone: how far the gap to the wall is from {GAP:g} m")
TERMS = (PROGRESS, TIME, EXIT, EARLY, HOLD)


def terms_of(scene: Any, gain: float, head: Floats, out: bool, remaining: int) -> tuple[float, ...]:
    """The terms of one decision in the order of `TERMS`.

    Args:
        scene: The drawn scene.
        gain: Progress since the decision before [m].
        head: Position of the head, shape (2,) [m].
        out: Whether the head has gone out by the exit.
        remaining: Decisions until the limit, where the episode ends without the exit, else 0.
    """
    error = abs(scene.gap(head) - GAP) if isinstance(scene, Wall) else 0.0
    counts = (gain, 1.0, out, remaining, error)
    return tuple(term.weight * count for term, count in zip(TERMS, counts, strict=True))
