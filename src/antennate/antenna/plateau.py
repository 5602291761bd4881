"""Readings that stand at their highest code, as of a converter that saturates below its rail."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from antennate.types import Floats, Ints

FEWEST = 150
"""Fewest readings of which a plateau is told: the noise of the quietest real sensor, 1.7 counts,
puts a fifth of so many within a count of the highest once in 50,000 times (computed)."""
SHARE = 0.2
"""Share of the readings that stand at their highest from which on they say nothing (assumed)."""
SHOWN = 0.05
"""The same share over different bends, from which on it is told: noise alone does 1 % (assumed)."""
_COVERED = 0.1
"""Share of all bends that a plateau covers at least; a quiet antenna that is held covers none."""
_NEAR = 1.0
"""Distance from the highest reading that is the same [counts]."""

_STILL = 2.0
"""Farthest apart that readings are which stand still [counts], as of a converter that is stuck."""
_SIGMA = 1.0 / (0.6745 * 6.0**0.5)
"""From the median of what normal noise does to second differences to its standard deviation."""


@dataclass(frozen=True, slots=True)
class Plateau:
    """The highest reading [counts], and the share of all that stand at it.

    Attributes:
        still: Whether none lies below it by more than a converter that is stuck toggles.
    """

    counts: float
    share: float
    still: bool = False

    def text(self, whose: str) -> str:
        """It in words, with what may be wrong."""
        if self.still:
            return (
                f"all of {whose} stand at {self.counts:.0f} counts or at most {_STILL:.0f} below: "
                "the converter is stuck there"
            )
        return (
            f"{100 * self.share:.0f} % of {whose} stand at {self.counts:.0f} counts, the highest: "
            "the converter saturates there; check its attenuation and the divider"
        )


def plateau_of(counts: Floats, bend: Floats | None = None) -> Plateau | None:
    """The plateau of readings [counts], shape (n,); None without one, or of too few readings.

    Args:
        counts: The readings.
        bend: How far the antenna was bent at each, same shape; None if that is not known.
    """
    if len(counts) < FEWEST:
        return None
    most = float(counts.max())
    there, least = counts >= most - _NEAR, SHARE
    if bend is not None:
        ends = np.percentile(bend[there], [5, 95])
        if np.ptp(ends) < _COVERED * np.ptp(bend):
            return None
        least = SHOWN
    share = float(there.mean())
    still = bool(most - counts.min() <= _STILL)
    return Plateau(most, share, still) if share >= least else None


def white_noise(counts: Floats, part: Ints) -> float:
    """Standard deviation [counts] of the noise of readings in order, shape (n,).

    From the median of second differences, so that bends and single spikes do not count.

    Args:
        counts: The readings.
        part: Which push or hold each belongs to.

    Returns:
        NaN of fewer than three readings in a row.
    """
    second = np.abs(counts[:-2] - 2.0 * counts[1:-1] + counts[2:])
    inside = (part[:-2] == part[1:-1]) & (part[1:-1] == part[2:])
    return _SIGMA * float(np.median(second[inside])) if inside.any() else float("nan")
