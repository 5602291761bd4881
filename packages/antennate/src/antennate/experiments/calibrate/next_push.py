"""What a calibration is worth on the next push: hysteresis, relaxation, intervals, rival curves.

A push is one way from straight to bent and back: a trial of the recording, or a part of one that
ends where the next loading begins. Everything here leaves out whole pushes, since readings of one
push err together.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from antennate.antenna.calibration import FEWEST, Calibration
from antennate.antenna.curves import (
    MODELS,
    OTHER_DIVIDERS,
    Gain,
    Samples,
    gain_of,
    left_out,
    polarity,
    predict,
    rms,
    with_divider,
)
from antennate.antenna.fitting import FEWEST_PUSHES
from antennate.antenna.sensor import FULL_SCALE
from antennate.jackknife import student95
from antennate.studies.columns import Ends, column, percent, tabular
from antennate.types import Bools, Floats, Ints

_STEADY = 0.01
"""Share of the bend's range within which it is held."""
_SHORTEST, _FEWEST = 0.3, 20
"""Shortest hold [s], and its fewest readings."""
_END = 0.2
"""Share of a hold at its beginning and at its end over which readings are averaged."""


@tabular
class Relaxation:
    """How readings move while the bend is held, over the span of readings."""

    mean: float = percent("relaxation in a hold", "% of the span", form="+.1f", interval="mean_95")
    """Mean change in a hold: above 0 readings go on as before the hold, below 0 they go back; the
    interval is over holds, `null` with fewer than two."""
    mean_95: Ends | None
    largest: float
    """Largest change in a hold."""
    time: float = column("  length of a hold", "s", form=".2g")
    """Median length of the holds [s]."""
    holds: int
    """Number of holds."""


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
    return Relaxation(
        mean=mean,
        mean_95=interval,
        largest=max(changes, key=abs),
        time=float(np.median(times)),
        holds=len(changes),
    )


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


TURN = 0.1
"""Share of the bend's range by which it must fall back or rise again to count as a turn."""
_GRID = 41
"""Bends at which loading and unloading are compared."""
_SLICES = 20
"""Parts of the range of bends over which readings of one direction are averaged."""


@dataclass(frozen=True, slots=True)
class Pushes:
    """Readings sorted into pushes and directions.

    Attributes:
        number: Number of the push of each reading, from 0, shape (n,).
        way: 1 while it is bent, -1 while it is released, 0 while it is held, shape (n,).
    """

    number: Ints
    way: Ints

    @classmethod
    def of(cls, samples: Samples) -> Pushes:
        """Find turns of the bend in each trial, whose readings are in the order of time."""
        turn = TURN * float(np.ptp(samples.level))
        number, way = np.zeros_like(samples.trial), np.zeros_like(samples.trial)
        count = 0
        for trial in np.unique(samples.trial):
            rows = np.flatnonzero(samples.trial == trial)
            first = True
            for start, end, sign in _monotonic(samples.level[rows], turn):
                count += sign > 0 and not first
                number[rows[start:end]], way[rows[start:end]] = count, sign
                first = False
            count += 1
        return cls(number, way)

    @property
    def count(self) -> int:
        """How many pushes there are."""
        return int(self.number.max()) + 1


def _monotonic(level: Floats, turn: float) -> Iterator[tuple[int, int, int]]:
    """Parts of a row of bends: first row, row after the last, and 1, -1 or 0 for its way."""
    start, low, high, sign = 0, 0, 0, 0
    for row, value in enumerate(level.tolist()):
        low = row if value < level[low] else low
        high = row if value > level[high] else high
        if sign >= 0 and level[high] - value > turn:  # it has fallen back since its peak
            if high > start:
                yield start, high, 1
            start, low, sign = high, row, -1
        elif sign <= 0 and value - level[low] > turn:
            if low > start:
                yield start, low, -1 if sign else 0
            start, high, sign = low, row, 1
    yield start, len(level), sign


@tabular
class Hysteresis:
    """How far readings lie apart at the same bend: loading minus unloading, over their span."""

    mean: float = percent("hysteresis, mean gap", "% of the span", form="+.1f", interval="mean_95")
    """Mean gap over all bends that both directions reach; the interval is over pushes, `null` with
    fewer than two."""
    mean_95: Ends | None
    largest: float = percent("  largest gap", "% of the span", form="+.1f")
    """Largest gap of mean readings."""
    at_bend: float = column("  at a bend of")
    """Bend at which the gap is largest."""
    level: float = column("  largest gap in b", form="+.3f")
    """Largest gap in b that the curve makes of these readings."""
    pushes: int
    """Pushes that have both directions."""
    one_way_r2: Ends
    """R² of a sigmoid of its own: of loading, and of unloading."""


@tabular
class NewPush:
    """What to expect of a push that served no fit."""

    error_95: Ends | None = column("error of b in a new push, 95 %", form="+.3f")
    """Predictive interval of the error of b, curve minus bend: 95 % of the readings of a new push
    are expected in it, with 95 % confidence; `null` with two pushes, as each is judged by the other
    and both err by the same."""
    rmse: float = column("RMSE of b, pushes left out", form=".4f")
    """Root mean square error of b on pushes left out."""
    worst_rmse: float = column("  of the worst", form=".4f")
    """Root mean square error of b on the worst push left out."""
    pushes: int
    """Pushes that were left out in turn."""


@tabular
class Assessment:
    """What is known about the next push; it is not in `calibration.json`."""

    pushes: int
    """Pushes found, by trials and by turns of the bend."""
    hysteresis: Hysteresis | None
    """Gap between loading and unloading; `null` if no push has both."""
    new_push: NewPush | None
    """Error to expect of the next push; `null` with a single push."""
    rivals: dict[str, dict[str, Gain]]
    """Gain of a `line` and of an `isotonic` curve, for every check; the first is `as recorded`."""
    named: tuple[str, ...]
    """Rivals that win beyond noise under every check."""
    relaxation: Relaxation | None = None
    """Change of readings in holds; `null` without a hold after a change of the bend."""


RECORDED = "as recorded"
"""Name of the first check of a rival."""


def assess(samples: Samples, calibration: Calibration, t: Floats | None = None) -> Assessment:
    """Ask what a calibration is worth beyond its own pushes.

    Args:
        samples: The readings that it was fitted to, those of a trial in the order of time.
        calibration: The calibration.
        t: Times of the readings [s], shape (n,); None if they are not known.
    """
    pushes = Pushes.of(samples)
    full_scale = (calibration.counts_low, calibration.counts_high) == (0.0, float(FULL_SCALE))
    whole = np.ones(len(samples.counts), dtype=bool)

    def check(of: Samples, used: Bools) -> dict[str, list[Floats]]:
        return left_out(of, pushes.number, used, full_scale)

    checks = {RECORDED: check(samples, whole)}
    if pushes.count > 1:
        for name, factor in OTHER_DIVIDERS.items():
            checks[name] = check(with_divider(samples, factor), whole)
        if (pushes.way > 0).any() and (pushes.way < 0).any():
            for name, sign in (("loading alone", 1), ("unloading alone", -1)):
                checks[name] = check(samples, pushes.way == sign)
    repeated = {name: errors for name, errors in checks.items() if len(errors["sigmoid"]) > 1}
    rivals = {
        rival: {name: gain_of(errors, rival) for name, errors in repeated.items()}
        for rival in MODELS[1:]
    }
    named = tuple(r for r, gains in rivals.items() if gains and all(g.wins for g in gains.values()))
    span = calibration.counts_high - calibration.counts_low
    return Assessment(
        pushes=pushes.count,
        hysteresis=hysteresis(samples, pushes, calibration),
        new_push=_new_push(checks[RECORDED][calibration.kind]),
        rivals=rivals,
        named=named,
        relaxation=None if t is None else relaxation(samples, t, span),
    )


def _new_push(errors: list[Floats]) -> NewPush | None:
    """The predictive interval: both ends of a push's errors are normal from push to push.

    Of two pushes the errors are those of one difference with either sign: their ends agree
    wherever that difference is alike up and down, however large it is.
    """
    if len(errors) < 2:
        return None
    sizes, interval = rms(errors), None
    if len(errors) >= FEWEST_PUSHES:
        ends = np.array([np.percentile(error, [2.5, 97.5]) for error in errors])
        wide = student95(len(errors) - 1) * ends.std(axis=0, ddof=1) * np.sqrt(1 + 1 / len(errors))
        low, high = (ends.mean(axis=0) + wide * [-1.0, 1.0]).tolist()
        interval = low, high
    return NewPush(
        error_95=interval,
        rmse=float(np.sqrt(np.mean(np.concatenate(errors) ** 2))),
        worst_rmse=float(sizes.max()),
        pushes=len(errors),
    )


def branches(samples: Samples, pushes: Pushes) -> tuple[Floats, Floats, Floats]:
    """Mean readings while bent and while released at the same bends.

    Returns:
        Bends, shape (g,), and readings of loading and of unloading of each push that has both
        [counts], each of shape (pushes, g), NaN where a push has not both.
    """
    grid = np.linspace(samples.level.min(), samples.level.max(), _GRID)
    pairs = []
    for number in np.unique(pushes.number):
        rows = pushes.number == number
        both = [_branch(samples, rows & (pushes.way == sign), grid) for sign in (1, -1)]
        if np.isfinite(both[0] + both[1]).any():
            pairs.append(both)
    loaded, released = np.array(pairs).reshape(-1, 2, _GRID).swapaxes(0, 1)
    return grid, loaded, released


def _branch(samples: Samples, rows: Bools, grid: Floats) -> Floats:
    """Readings at the bends of a grid by straight lines between means of slices of the bend."""
    if rows.sum() < 2:
        return np.full(len(grid), np.nan)
    level, counts = samples.level[rows], samples.counts[rows]
    edges = np.linspace(grid[0], grid[-1], _SLICES + 1)
    place = np.clip(np.digitize(level, edges) - 1, 0, _SLICES - 1)
    size = np.bincount(place, minlength=_SLICES)
    filled = size > 0
    middle = np.bincount(place, level, _SLICES)[filled] / size[filled]
    mean = np.bincount(place, counts, _SLICES)[filled] / size[filled]
    return np.interp(grid, middle, mean, left=np.nan, right=np.nan)


def hysteresis(samples: Samples, pushes: Pushes, calibration: Calibration) -> Hysteresis | None:
    """The gap between loading and unloading; None if no push has both."""
    grid, loaded, released = branches(samples, pushes)
    usual = np.isfinite(loaded - released).sum(axis=0) >= max(1, len(loaded) / 2)
    if not usual.any():
        return None
    up, down = loaded[:, usual], released[:, usual]
    span = calibration.counts_high - calibration.counts_low
    gap = np.nanmean(up - down, axis=0) / span
    levels = np.nanmean(calibration.level(up) - calibration.level(down), axis=0)
    worst = int(np.argmax(abs(gap)))
    gaps = [float(np.nanmean(one)) / span for one in up - down if np.isfinite(one).any()]
    mean, interval = float(np.mean(gaps)), None
    if len(gaps) > 1:
        half = student95(len(gaps) - 1) * float(np.std(gaps, ddof=1)) / len(gaps) ** 0.5
        interval = (mean - half, mean + half)
    return Hysteresis(
        mean=mean,
        mean_95=interval,
        largest=float(gap[worst]),
        at_bend=float(grid[usual][worst]),
        level=float(levels[np.argmax(abs(levels))]),
        pushes=len(gaps),
        one_way_r2=one_way_r2(samples, pushes),
    )


def one_way_r2(samples: Samples, pushes: Pushes) -> Ends:
    """R² of a sigmoid fitted to loading alone, and of one fitted to unloading alone."""
    return sigmoid_r2(samples, pushes.way > 0), sigmoid_r2(samples, pushes.way < 0)


def sigmoid_r2(samples: Samples, rows: Bools) -> float:
    """R² of a sigmoid fitted to some of the readings alone, 0 of too few."""
    counts, level = samples.counts[rows], samples.level[rows]
    if len(counts) < FEWEST or np.ptp(counts) == 0 or np.ptp(level) == 0:
        return 0.0
    x = (counts - counts.min()) / np.ptp(counts)
    error = predict("sigmoid", x, level, x, polarity(samples)) - level
    return float(1.0 - (error**2).mean() / level.var())
