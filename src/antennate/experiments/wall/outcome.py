"""What became of a passage along the boulder wall: jam, slip or success, and by how much."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from antennate.params import WallParams
from antennate.types import Floats

Fate = Literal["success", "jam", "slip", "invalid"]
SAMPLE_PERIOD = 0.01
"""Time between samples of a passage [s]."""


@dataclass(frozen=True, slots=True)
class WallTrial:
    """What became of one trial.

    Attributes:
        arm: Its profile; `trial` its number, which decides all chance.
        fate: Over the whole travel; `fate_after_start` without the start.
        least_advance_mm: Smallest advance of the tip over any `jam_travel` of the base.
        longest_stick_mm: Longest travel of the base during which the tip never got ahead by
            `jam_advance`.
        longest_gap_s: Longest time without touch after the first one.
        touched: Share of samples that touch.
        force_mean_n: Mean contact force [N]; `force_max_n` the largest.
        flex_max_deg: Largest flex under the film.
        reason: Why it is invalid.
    """

    arm: str
    trial: int
    fate: Fate
    fate_after_start: Fate
    least_advance_mm: float
    longest_stick_mm: float
    longest_gap_s: float
    touched: float
    force_mean_n: float
    force_max_n: float
    flex_max_deg: float
    reason: str = ""


@dataclass(frozen=True, slots=True)
class Traverse:
    """Samples of one passage.

    Attributes:
        base: Travel of the base [m], shape (n,).
        tip: Advance of the tip along the wall since the travel began [m], shape (n,).
        touching: Whether a sphere is touched, shape (n,).
        force: Contact force [N], shape (n,).
        flex: Flex under the film [rad], shape (n,).
        hinges: Hinge angles [rad], shape (t, n).
        shapes: Hinges and tip in the plane [m] at every tenth of the travel, shape (11, n + 1, 2).
    """

    base: Floats
    tip: Floats
    touching: Floats
    force: Floats
    flex: Floats
    hinges: Floats
    shapes: Floats


def classify(wall: WallParams, arm: str, trial: int, seen: Traverse) -> WallTrial:
    """What became of a passage, by the definitions of `wall`."""
    advance = least_advance(seen.base, seen.tip, wall.jam_travel)
    gap = longest_gap(seen.touching, SAMPLE_PERIOD)
    late = seen.base > wall.start
    after = _fate(
        wall,
        least_advance(seen.base[late], seen.tip[late], wall.jam_travel),
        longest_gap(seen.touching[late], SAMPLE_PERIOD, True),
    )
    return WallTrial(
        arm=arm,
        trial=trial,
        fate=_fate(wall, advance, gap),
        fate_after_start=after,
        least_advance_mm=1e3 * advance,
        longest_stick_mm=1e3 * longest_stick(seen.base, seen.tip, wall.jam_advance),
        longest_gap_s=gap,
        touched=float(seen.touching.mean()),
        force_mean_n=float(seen.force.mean()),
        force_max_n=float(seen.force.max()),
        flex_max_deg=math.degrees(abs(seen.flex).max()),
    )


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


def _fate(wall: WallParams, advance: float, gap: float) -> Fate:
    if advance < wall.jam_advance:
        return "jam"
    return "slip" if gap > wall.slip_time else "success"
