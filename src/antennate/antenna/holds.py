"""Relaxation: how far readings move on while an antenna is held at one bend."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from antennate.antenna.curves import Samples, polarity
from antennate.jackknife import student95
from antennate.types import Floats, Ints

_STEADY = 0.01
"""Share of the bend's range within which it is held."""
_SHORTEST, _FEWEST = 0.3, 20
"""Shortest hold [s], and its fewest readings."""
_END = 0.2
"""Share of a hold at its beginning and at its end over which readings are averaged."""


@dataclass(frozen=True, slots=True)
class Relaxation:
    """How readings move while the bend is held, over the span of readings.

    Attributes:
        mean: Mean over holds: above 0 readings go on as before the hold, below 0 they go back.
        mean_95: 95 % interval of it over holds, None with fewer than two.
        largest: Largest change of a hold.
        time: Median length of the holds [s].
        holds: How many there are.
    """

    mean: float
    mean_95: tuple[float, float] | None
    largest: float
    time: float
    holds: int


def relaxation(samples: Samples, t: Floats, span: float) -> Relaxation | None:
    """What holds after a change of the bend show; None if there is no such hold.

    Args:
        samples: The readings, those of a trial in the order of time.
        t: Their times [s], shape (n,).
        span: Counts from straight to bent.
    """
    changes, times = list[float](), list[float]()
    for rows, before in _holds(samples):
        if len(rows) < _FEWEST or t[rows[-1]] - t[rows[0]] < _SHORTEST:
            continue
        end = max(1, round(_END * len(rows)))
        moved = samples.counts[rows[-end:]].mean() - samples.counts[rows[:end]].mean()
        way = polarity(samples) * np.sign(samples.level[rows[0]] - before)
        changes.append(float(way * moved / span))
        times.append(float(t[rows[-1]] - t[rows[0]]))
    if not changes:
        return None
    mean, interval = float(np.mean(changes)), None
    if len(changes) > 1:
        half = student95(len(changes) - 1) * float(np.std(changes, ddof=1)) / len(changes) ** 0.5
        interval = (mean - half, mean + half)
    largest = max(changes, key=abs)
    return Relaxation(mean, interval, largest, float(np.median(times)), len(changes))


def _holds(samples: Samples) -> Iterator[tuple[Ints, float]]:
    """Rows of each part of a trial at one bend, and the bend before it; not the first part."""
    steady = _STEADY * float(np.ptp(samples.level))
    for trial in np.unique(samples.trial):
        rows = np.flatnonzero(samples.trial == trial)
        level, start = samples.level[rows], 0
        for at in range(1, len(rows) + 1):
            if at < len(rows) and abs(level[at] - level[start]) <= steady:
                continue
            if start > 0:
                yield rows[start:at], float(level[start - 1])
            start = at
