"""The reward of a decision, term by term: the one table, with its version."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from antennate.sim.scenes.wall import GAP
from antennate.types import Floats

REWARD_VERSION = 1
"""It rises when a term or a weight changes; then the environments get a new version too."""


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
HOLD = Term("hold", -0.2, "m", f"scene `wall` alone: how far the gap to the wall is from {GAP:g} m")
TERMS = (PROGRESS, TIME, EXIT, HOLD)


def terms_of(scene: Any, gain: float, head: Floats, out: bool) -> tuple[float, ...]:
    """The terms of one decision in the order of `TERMS`.

    Args:
        scene: The drawn scene.
        gain: Progress since the decision before [m].
        head: Position of the head, shape (2,) [m].
        out: Whether the head has gone out by the exit.
    """
    error = abs(scene.gap(head) - GAP) if hasattr(scene, "gap") else 0.0
    return PROGRESS.weight * gain, TIME.weight, EXIT.weight * out, HOLD.weight * error
