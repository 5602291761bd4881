"""The clock of a table against that of a log, by cross-correlation of yaw rates.

A yaw rate is the turn of the head within `SPAN`. Those of table and log are compared at every lag
and every drift up to `MOST_DRIFT`; the best is refined by robust least squares. Its interval is the
jackknife's over blocks of time, as what is left over may be correlated within them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy import optimize, signal

from antennate.errors import BadInputError
from antennate.jackknife import jackknife95
from antennate.types import Floats

SPAN = 0.3
"""Time over which a yaw rate is taken [s]: below half a cycle of the gait."""
MOST_DRIFT = 0.02
"""Largest drift of a clock that is looked for [1]."""
_GAP = 3.5
"""Steps of time that make a gap [median steps]."""
_STEP, _FINE = 0.025, 0.02
"""Steps of the search and of the fit [s]."""
_SHIFT = 0.03
"""What the next drift of the search moves the ends of the table by [s]."""
_SHORTEST, _LEAST = 5.0, 0.5
"""Least time that both have in common [s], and its share of the shorter one."""
_APART = 0.5
"""Lags farther apart than this are different ones [s]."""
_CLEAR = 4.0
"""How much more of the variance of the yaw rates another lag leaves unexplained than the best."""
_BLOCK, _FEWEST, _MOST = 2.0, 8, 60
"""Length of a block of the residual [s], above a cycle of the gait, and how many there are."""

Course = tuple[Floats, Floats]
"""Times [s], rising, and unwrapped headings [rad], NaN in gaps, both of shape (n,)."""


@dataclass(frozen=True)
class Clock:
    """The clock of a table: when it shows `centre` [s] the log has `at` [s].

    Attributes:
        drift: How much faster the time of the log passes than that of the table [1].
        at_error: Half the 95 % interval of `at` [s].
        drift_error: Half the 95 % interval of `drift` [1].
        correlation: Of the yaw rates.
    """

    centre: float
    at: float
    drift: float
    correlation: float
    at_error: float = math.nan
    drift_error: float = math.nan

    def in_log(self, t: Floats) -> Floats:
        """Times of the table as times of the log [s]."""
        return self.at + (1.0 + self.drift) * (t - self.centre)


def turns(course: Course, at: Floats) -> Floats:
    """Turn of a heading within `SPAN` around some times [rad], NaN where it is not known.

    Args:
        course: The heading over time.
        at: Where to look [s], shape (m,).
    """
    begin, end = (np.interp(at + side * SPAN / 2, *course, np.nan, np.nan) for side in (-1, 1))
    return end - begin


def with_gaps(t: Floats, *values: Floats) -> tuple[Floats, ...]:
    """Times and values, each of shape (n,), with a row of NaN in each gap of the times."""
    step = np.diff(t)
    wide = np.flatnonzero(step > _GAP * np.median(step)) + 1
    times = np.insert(t, wide, t[wide] - step[wide - 1] / 2)
    return times, *(np.insert(each, wide, np.nan) for each in values)


def align(name: Path, table: Course, log: Course, weakest: float) -> Clock:
    """The clock of a table.

    Args:
        name: The table, for messages.
        table: Its headings over its own time.
        log: How far the head had turned, over the time of the log.
        weakest: Correlation of yaw rates that tables of other logs do not reach.

    Raises:
        BadInputError: No lag fits, several do, or the table turns the other way.
    """
    first, last = table[0][np.isfinite(table[1])][[0, -1]].tolist()
    centre, half = (first + last) / 2, (last - first) / 2
    drifts = MOST_DRIFT * np.linspace(-1, 1, 2 * math.ceil(MOST_DRIFT * half / _SHIFT) + 1)
    count = math.ceil((1 + MOST_DRIFT) * half / _STEP)
    places = _STEP * np.arange(-count, count + 1)
    grid = np.arange(log[0][0], log[0][-1] + _STEP, _STEP)
    theirs = turns(log, grid)
    lags, at_drift = np.zeros(len(grid) + 2 * count), np.zeros(len(grid) + 2 * count)
    for drift in drifts.tolist():
        found = _correlations(turns(table, centre + places / (1 + drift)), theirs)
        better = abs(found) > abs(lags)
        lags[better], at_drift[better] = found[better], drift
    lag = int(np.argmax(abs(lags)))
    others = abs(np.arange(len(lags)) - lag) * _STEP > _APART
    peak, rival = float(lags[lag]), float(abs(lags[others]).max(initial=0.0))
    _judge(name, peak, rival, weakest)
    at = float(grid[0] + (lag - count) * _STEP)
    return _refined(table, log, Clock(centre, at, float(at_drift[lag]), peak))


def _correlations(ours: Floats, theirs: Floats) -> Floats:
    """Correlation at every place of the middle of one series in another; NaN counts in neither."""

    def sums(a: Floats, b: Floats) -> Floats:
        return signal.correlate(b, a, "full", "fft")

    a, b = (np.nan_to_num(values - np.nanmean(values)) for values in (ours, theirs))
    sound, known = np.isfinite(ours).astype(float), np.isfinite(theirs).astype(float)
    energy = np.maximum(sums(a * a, known), 1e-9) * np.maximum(sums(sound, b * b), 1e-9)
    common = sums(sound, known)
    enough = common > max(_SHORTEST / _STEP, _LEAST * min(sound.sum(), known.sum()))
    return np.where(enough, sums(a, b) / np.sqrt(energy), 0.0)


def _judge(name: Path, peak: float, rival: float, weakest: float) -> None:
    """Refuse a table that fits nowhere, at several lags, or in a mirror."""
    if abs(peak) < weakest or 1 - rival**2 < _CLEAR * (1 - peak**2):
        raise BadInputError(
            f"{name}: expected one lag at which it turns as the log does, found a correlation of "
            f"{abs(peak):.2f} at best and {rival:.2f} at another lag: is it of another time, or is "
            "another axis --up? A steady walk fits at any cycle: record turns, and its begin"
        )
    if peak < 0:
        raise BadInputError(
            f"{name}: expected headings that turn as the log does, found a correlation of "
            f"{peak:.2f}: the table is left-handed, or two of its axes are exchanged; --mirrored"
        )


def _refined(table: Course, log: Course, clock: Clock) -> Clock:
    """The clock by robust least squares, with its intervals."""
    places = np.arange(table[0][0], table[0][-1], _FINE)
    ours, theirs = turns(table, places), turns(log, clock.in_log(places))
    sound = np.isfinite(ours) & np.isfinite(theirs)
    centre = float(places[sound][[0, -1]].mean())
    clock = replace(clock, centre=centre, at=clock.at + (1 + clock.drift) * (centre - clock.centre))
    since, ours = places[sound] - centre, ours[sound]
    half = float(since[-1])

    def predicted(x: Floats, later: float = 0.0) -> Floats:
        at = clock.at + x[0] + (1 + clock.drift + x[1] / half) * since + later
        return np.nan_to_num(turns(log, at))

    def residual(x: Floats) -> Floats:
        return x[2] + x[3] * predicted(x) - ours

    start = np.array([0.0, 0.0, 0.0, 1.0])
    scale = 2.0 * float(np.median(abs(residual(start)))) + 1e-9
    fit = optimize.least_squares(residual, start, loss="soft_l1", f_scale=scale)
    slope = fit.x[3] * (predicted(fit.x, _FINE) - predicted(fit.x, -_FINE)) / (2 * _FINE)
    jacobian = np.stack(
        [slope, slope * since / half, np.ones(len(since)), predicted(fit.x)], axis=1
    )
    at_error, drift_error = _half_intervals(jacobian, fit.fun / scale, since)[:2] * scale
    return replace(
        clock,
        at=clock.at + float(fit.x[0]),
        drift=clock.drift + float(fit.x[1]) / half,
        correlation=float(np.corrcoef(predicted(fit.x), ours)[0, 1]),
        at_error=float(at_error),
        drift_error=float(drift_error) / half,
    )


def _half_intervals(jacobian: Floats, residual: Floats, t: Floats) -> Floats:
    """Half the 95 % interval of each number of a fit by soft L1, each block of time left out once.

    What leaving out a block changes is one step of Newton's method.
    """
    count = int(np.clip(np.ptp(t) / _BLOCK, _FEWEST, _MOST))
    slopes = residual / np.sqrt(1 + residual**2)
    curved = jacobian * ((1 + residual**2) ** -1.5)[:, None]
    whole, left = curved.T @ jacobian, list[Any]()
    for block in np.array_split(np.arange(len(t)), count):
        rest = whole - curved[block].T @ jacobian[block]
        left.append(np.linalg.solve(rest, jacobian[block].T @ slopes[block]))
    low, high = jackknife95(np.zeros(jacobian.shape[1]), np.array(left))
    return (high - low) / 2
