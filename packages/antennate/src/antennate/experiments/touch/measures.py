"""Many traverses in numbers: pooled ticks, contacts and alarms, with intervals over trials."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from antennate.experiments.touch.result import Latency, Measures, Pair, Point, Roc, Threshold
from antennate.experiments.touch.sensing import Comparison
from antennate.jackknife import ENOUGH, jackknife95, median95
from antennate.studies import statistics
from antennate.studies.columns import Ends
from antennate.types import Floats, Ints

_BINS = 500
_LEVELS = np.arange(-13.0, 13.01, 0.25)
"""Logits of the thresholds on the ROC curve."""


class Estimate(NamedTuple):
    """A number and its 95 % interval; None where they do not exist."""

    value: float | None
    ends: Ends | None


class Pool:
    """Measures of groups of comparisons, with 95 % intervals.

    Those of counts per metre are the exact ones of Poisson counts. All others are over trials:
    jackknife (each trial left out in turn) and Student's t; median latencies as in `median95`. Ends
    are cut where the measure ends.

    Args:
        comparisons: All valid traverses.
        trials: Number of trials; a trial without valid traverses weighs nothing.
        rate: Ticks per second [Hz].
    """

    def __init__(self, comparisons: Sequence[Comparison], trials: int, rate: float) -> None:
        self._trials, self._tick_ms = trials, 1e3 / rate
        self._others = 1.0 - np.eye(trials)  # one trial left out in each row
        self._level_edges = _edges([v.level for v in comparisons])
        self._flex_edges = _edges([abs(v.flex) for v in comparisons])

    def measure(self, group: Sequence[Comparison]) -> Measures:
        """All measures of one group."""
        matches = [v.matches for v in group]
        contacts = sum(len(m.contacts) for m in matches)
        missed = sum(int((~m.found).sum()) for m in matches)
        bends = np.concatenate([v.missed_flex for v in group]) if group else np.zeros(0)
        false = sum(m.false for m in matches)
        metres = float(self._sum(group, lambda v: v.metres).sum())
        hit, wrong, lost = self._ticks(group)
        truth, ticks = hit + lost, self._sum(group, lambda v: len(v.truth))
        either, flexes = 2 * hit + wrong + lost, [abs(v.flex) for v in group]
        always = self._left_out(2 * truth, truth + ticks)
        return Measures(
            traverses=len(group),
            ticks=sum(len(v.truth) for v in group),
            metres=metres,
            contacts=contacts,
            missed=missed,
            missed_wilson95=statistics.wilson95(missed, contacts),
            carried=sum(m.carried for m in matches),
            alarms=sum(m.alarms for m in matches),
            false=false,
            missed_flex_rad=float(np.median(bends)) if len(bends) else None,
            onset=self._latency(group, [m.onset for m in matches]),
            release=self._latency(group, [m.release for m in matches]),
            **_with_ends(
                contact_share=self._ratio(truth, ticks),
                f1=self._ratio(2 * hit, either),
                f1_over_always_contact=_less(self._left_out(2 * hit, either), always),
                precision=self._ratio(hit, hit + wrong),
                recall=self._ratio(hit, truth),
                missed_per_m=_rate(missed, metres),
                false_per_m=_rate(false, metres),
                auc=self._area(group, [v.level for v in group], self._level_edges),
                auc_flex=self._area(group, flexes, self._flex_edges),
            ),
        )

    def _ticks(self, group: Sequence[Comparison]) -> tuple[Floats, Floats, Floats]:
        """True positive, false positive and false negative ticks by trial, each (trials,)."""
        return (
            self._sum(group, lambda v: (v.truth & v.alarm).sum()),
            self._sum(group, lambda v: (~v.truth & v.alarm).sum()),
            self._sum(group, lambda v: (v.truth & ~v.alarm).sum()),
        )

    def f1_difference(self, first: Sequence[Comparison], second: Sequence[Comparison]) -> Pair:
        """F1 of the first group less that of the second, a trial left out of both at once."""
        one, two = (
            self._left_out(2 * hit, 2 * hit + wrong + lost)
            for hit, wrong, lost in map(self._ticks, (first, second))
        )
        return Pair(**_with_ends(f1_difference=_less(one, two)))

    def _sum(self, group: Sequence[Comparison], value: Any) -> Floats:
        """Sums of value(comparison) by trial, shape (trials,)."""
        total = np.zeros(self._trials)
        for comparison in group:
            total[comparison.trial] += value(comparison)
        return total

    def _left_out(self, part: Floats, whole: Floats) -> tuple[float, Floats]:
        """A ratio of sums over trials, and the same without each trial, shape (trials,).

        NaN for a trial that adds nothing to the whole.
        """
        with np.errstate(invalid="ignore", divide="ignore"):
            left = (self._others @ part) / (self._others @ whole)
            value = float(np.divide(part.sum(), whole.sum()))
        return value, np.where(whole > 0, left, np.nan)

    def _ratio(self, part: Floats, whole: Floats) -> Estimate:
        value, left = self._left_out(part, whole)
        return Estimate(_finite(value), _interval(value, left, 0.0, 1.0))

    def _latency(self, group: Sequence[Comparison], ticks: Sequence[Ints]) -> Latency:
        """Median with its interval and 90th percentile [ms], and the median way meanwhile [mm]."""
        values = np.concatenate([np.zeros(0, dtype=np.int64), *ticks])
        if not len(values):
            return Latency(n=0, median_ms=None, median_95_ms=None, p90_ms=None, median_mm=None)
        trials = np.concatenate(
            [np.full(len(t), v.trial) for v, t in zip(group, ticks, strict=True)]
        )
        way = np.concatenate(
            [v.speed * t * self._tick_ms for v, t in zip(group, ticks, strict=True)]
        )
        enough = len(np.unique(trials)) >= ENOUGH
        all_ms = np.float64(self._tick_ms) * values
        return Latency(
            n=len(values),
            median_ms=float(np.median(values)) * self._tick_ms,
            median_95_ms=_within(median95(all_ms, trials), least=0.0) if enough else None,
            p90_ms=float(np.percentile(values, 90)) * self._tick_ms,
            median_mm=float(np.median(way)),
        )

    def _area(
        self, group: Sequence[Comparison], scores: Sequence[Floats], edges: Floats
    ) -> Estimate:
        """Area under the ROC curve, ties counted half, from histograms by trial."""
        touching = np.zeros((self._trials, len(edges) + 1))
        free = np.zeros_like(touching)
        for comparison, score in zip(group, scores, strict=True):
            place = np.searchsorted(edges, score)
            for state, counts in ((comparison.truth, touching), (~comparison.truth, free)):
                counts[comparison.trial] += np.bincount(place[state], minlength=counts.shape[1])
        below = np.cumsum(free, axis=1) - free / 2
        order = touching @ below.T  # ordered pairs of a trial's touching and another's free
        pairs = np.outer(touching.sum(axis=1), free.sum(axis=1))
        others = self._others
        with np.errstate(invalid="ignore", divide="ignore"):
            whole = float(np.divide(order.sum(), pairs.sum()))
            left = ((others @ order) * others).sum(axis=1)
            left = left / ((others @ pairs) * others).sum(axis=1)
        left[touching.sum(axis=1) + free.sum(axis=1) == 0] = np.nan
        return Estimate(_finite(whole), _interval(whole, left, 0.0, 1.0))


def _with_ends(**estimates: Estimate) -> dict[str, Any]:
    """Fields of these numbers, and of their intervals with `_95` behind the name."""
    values = {name: estimate.value for name, estimate in estimates.items()}
    return {**values, **{f"{name}_95": estimate.ends for name, estimate in estimates.items()}}


def _less(first: tuple[float, Floats], second: tuple[float, Floats]) -> Estimate:
    """A difference of two ratios, each given with what it is without each trial."""
    (one, ones), (two, twos) = first, second
    return Estimate(_finite(one - two), _interval(one - two, ones - twos, -1.0, 1.0))


def _interval(value: float, left: Floats, least: float, most: float) -> Ends | None:
    """Jackknife interval by Student's t, within the bounds.

    Args:
        value: Of all trials.
        left: The same without each trial, NaN where that does not exist, shape (trials,).
        least: Where the measure ends below.
        most: Where it ends above.

    Returns:
        None with fewer than `ENOUGH` trials, or when it does not matter which one is left out: that
        tells nothing of the next.
    """
    left = left[np.isfinite(left)]
    return _within(jackknife95(value, left), least, most) if len(left) >= ENOUGH else None


def _within(ends: Floats, least: float = -np.inf, most: float = np.inf) -> Ends | None:
    low, high = ends.tolist()
    return (max(least, low), min(most, high)) if np.isfinite(ends).all() else None


def _rate(count: int, metres: float) -> Estimate:
    """Counts per metre with their exact interval."""
    if metres == 0.0:
        return Estimate(None, None)
    low, high = statistics.poisson95(count)
    return Estimate(count / metres, (low / metres, high / metres))


def _finite(value: float) -> float | None:
    return value if np.isfinite(value) else None


def _edges(scores: Sequence[Floats]) -> Floats:
    """Bounds of bins that are about equally full."""
    if not scores:
        return np.zeros(1)
    return np.unique(np.quantile(np.concatenate(scores), np.linspace(0, 1, _BINS + 1)[1:-1]))


def _auc(touching: Floats, free: Floats) -> float:
    """Chance that a touching tick scores above a free one, for scores (n,) and (m,)."""
    from scipy import stats  # takes long; only where it is needed

    if not len(touching) or not len(free):
        return float("nan")
    test = stats.mannwhitneyu(touching, free)
    return float(test.statistic) / (len(touching) * len(free))


def roc(
    group: Sequence[Comparison], threshold: float, flex_at: Callable[[float], float | None]
) -> Roc:
    """ROC curve of b without hysteresis, and where a threshold lies on it.

    Args:
        group: What was sensed.
        threshold: The threshold.
        flex_at: flex_at(level) -> the least flex at which b reaches a level [rad].
    """
    truth = np.concatenate([np.zeros(0, dtype=bool), *(v.truth for v in group)])
    level = np.concatenate([np.zeros(0), *(v.level for v in group)])
    touching, free = np.sort(level[truth]), np.sort(level[~truth])
    own = _point(float(np.log(threshold / (1.0 - threshold))), touching, free)
    curve = [_point(z, touching, free) for z in _LEVELS]
    place = max(range(len(curve)), key=lambda i: curve[i].f1 or 0.0)
    default, best = (
        Threshold(**vars(point), flex_rad=flex_at(point.theta)) for point in (own, curve[place])
    )
    curve[place] = best
    share = len(touching) / len(truth) if len(truth) else float("nan")
    noise = np.random.default_rng(0).random(len(truth))
    return Roc(
        curve=curve,
        default=default,
        best_f1=best,
        f1_always_contact=_finite(2.0 * share / (1.0 + share)),
        auc_random=_finite(_auc(noise[truth], noise[~truth])),
    )


def _point(z: float, touching: Floats, free: Floats) -> Point:
    hit = len(touching) - int(np.searchsorted(touching, z))
    wrong = len(free) - int(np.searchsorted(free, z))
    whole = len(touching) + hit + wrong
    return Point(
        theta=float(1.0 / (1.0 + np.exp(-z))),
        true_positive_rate=hit / len(touching) if len(touching) else None,
        false_positive_rate=wrong / len(free) if len(free) else None,
        f1=2.0 * hit / whole if whole else None,
    )
