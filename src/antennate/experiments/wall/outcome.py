"""What became of a passage along the boulder wall: jam, slip or success, and by how much."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from antennate.params.bench import WallParams
from antennate.types import Floats

Outcome = Literal["success", "jam", "slip", "invalid"]
SAMPLE_PERIOD = 0.01
"""Time between samples of a passage [s]."""


@dataclass(frozen=True, slots=True)
class WallTrial:
    """One trial, a row of trials.csv.

    Attributes:
        seed: Seed of the run; with `trial` it decides all chance.
        profile: Springs of the antenna.
        outcome: Over the whole travel; `outcome_after_start` without the start.
        least_advance_mm: Smallest advance of the tip over any `jam_travel` of the base.
        longest_stick_mm: Longest travel of the base during which the tip never got ahead by
            `jam_advance`.
        longest_gap_s: Longest time without touch after the first one.
        touched: Share of samples that touch.
        force_mean_n: Mean contact force [N]; `force_max_n` the largest.
        flex_max_deg: Largest flex under the flex sensor.
        hinge_max_deg: Largest angle of any one hinge, also of those beyond the flex sensor.
        reason: Why it is invalid.
    """

    seed: int
    trial: int
    profile: str
    outcome: Outcome
    outcome_after_start: Outcome
    least_advance_mm: float
    longest_stick_mm: float
    longest_gap_s: float
    touched: float
    force_mean_n: float
    force_max_n: float
    flex_max_deg: float
    hinge_max_deg: float
    reason: str = ""


@dataclass(frozen=True, slots=True)
class Traverse:
    """Samples of one passage.

    Attributes:
        base: Travel of the base [m], shape (n,).
        tip: Advance of the tip along the wall since the travel began [m], shape (n,).
        touching: Whether a sphere is touched, shape (n,).
        force: Contact force [N], shape (n,).
        flex: Flex under the flex sensor [rad], shape (n,).
        hinges: Hinge angles [rad], shape (t, n).
        shapes: Hinges and tip in the plane [m], x from the crests on, at every tenth of the travel,
            shape (11, n + 1, 2).
        boulders: Middle and radius of each boulder in the same plane [m], shape (k, 3).
    """

    base: Floats
    tip: Floats
    touching: Floats
    force: Floats
    flex: Floats
    hinges: Floats
    shapes: Floats
    boulders: Floats


def classify(wall: WallParams, seed: int, trial: int, profile: str, seen: Traverse) -> WallTrial:
    """The outcome of a passage, by the definitions of `wall`."""
    advance = least_advance(seen.base, seen.tip, wall.jam_travel)
    gap = longest_gap(seen.touching, SAMPLE_PERIOD)
    late = seen.base > wall.start
    after = _outcome(
        wall,
        least_advance(seen.base[late], seen.tip[late], wall.jam_travel),
        longest_gap(seen.touching[late], SAMPLE_PERIOD, True),
    )
    return WallTrial(
        seed=seed,
        trial=trial,
        profile=profile,
        outcome=_outcome(wall, advance, gap),
        outcome_after_start=after,
        least_advance_mm=1e3 * advance,
        longest_stick_mm=1e3 * longest_stick(seen.base, seen.tip, wall.jam_advance),
        longest_gap_s=gap,
        touched=float(seen.touching.mean()),
        force_mean_n=float(seen.force.mean()),
        force_max_n=float(seen.force.max()),
        flex_max_deg=math.degrees(abs(seen.flex).max()),
        hinge_max_deg=math.degrees(abs(seen.hinges).max()),
    )


def invalid(seed: int, trial: int, profile: str, reason: str) -> WallTrial:
    """What is told of a trial that has no passage."""
    return WallTrial(seed, trial, profile, "invalid", "invalid", *[math.nan] * 8, reason=reason)


def least_advance(base: Floats, tip: Floats, travel: float) -> float:
    """Smallest advance of the tip over any such travel of the base; all in m, shapes (n,)."""
    ends = np.searchsorted(base, base + travel - 1e-9)
    begins = np.flatnonzero(ends < len(base))
    return float((tip[ends[begins]] - tip[begins]).min())


def longest_stick(base: Floats, tip: Floats, advance: float) -> float:
    """Longest travel of the base during which the tip never got ahead by so much; all in m."""
    longest = 0.0
    for i in range(len(base)):
        ahead = tip[i:] - tip[i] >= advance
        end = int(np.argmax(ahead)) if ahead.any() else len(ahead) - 1
        longest = max(longest, float(base[i + end] - base[i]))
    return longest


def longest_gap(touching: Floats, period: float, from_start: bool = False) -> float:
    """Longest time without touch [s], after the first touch or from the start on."""
    free = np.flatnonzero(np.concatenate([[from_start], touching > 0, [True]]))
    if len(free) == 1 and not from_start:
        return len(touching) * period  # never touched at all
    return float((np.diff(free) - 1).max(initial=0)) * period


def _outcome(wall: WallParams, advance: float, gap: float) -> Outcome:
    if advance < wall.jam_advance:
        return "jam"
    return "slip" if gap > wall.slip_time else "success"
