"""Many traverses in numbers: pooled ticks, contacts and alarms, with intervals over trials."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from antennate.experiments.touch.sensing import Comparison
from antennate.jackknife import ENOUGH, jackknife95, median95
from antennate.studies import statistics
from antennate.types import Floats, Ints

_BINS = 500
_LEVELS = np.arange(-13.0, 13.01, 0.25)
"""Logits of the thresholds on the ROC curve."""


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

    def measure(self, group: Sequence[Comparison]) -> dict[str, Any]:
        """All measures of one group."""
        matches = [v.matches for v in group]
        contacts = sum(len(m.contacts) for m in matches)
        missed = sum(int((~m.found).sum()) for m in matches)
        lost = np.concatenate([v.missed_flex for v in group]) if group else np.zeros(0)
        false = sum(m.false for m in matches)
        metres = float(self._sum(group, lambda v: v.metres).sum())
        return {
            "traverses": len(group),
            "ticks": sum(len(v.truth) for v in group),
            "metres": metres,
            **self._per_tick(group),
            "contacts": contacts,
            "missed": missed,
            "missed_wilson95": statistics.wilson95(missed, contacts),
            "carried": sum(m.carried for m in matches),
            "alarms": sum(m.alarms for m in matches),
            "false": false,
            **_rate("missed_per_m", missed, metres),
            **_rate("false_per_m", false, metres),
            "missed_flex_rad": float(np.median(lost)) if len(lost) else None,
            "onset": self._latency(group, [m.onset for m in matches]),
            "release": self._latency(group, [m.release for m in matches]),
            **self._area("auc", group, [v.level for v in group], self._level_edges),
            **self._area("auc_flex", group, [abs(v.flex) for v in group], self._flex_edges),
        }

    def _per_tick(self, group: Sequence[Comparison]) -> dict[str, Any]:
        hit, wrong, lost = self._ticks(group)
        truth, ticks = hit + lost, self._sum(group, lambda v: len(v.truth))
        return {
            **self._ratio("contact_share", truth, ticks),
            **self._ratio("f1", 2 * hit, 2 * hit + wrong + lost),
            **self._ratio("precision", hit, hit + wrong),
            **self._ratio("recall", hit, truth),
            **self._lead(hit, truth, 2 * hit + wrong + lost, ticks),
        }

    def _lead(self, hit: Floats, truth: Floats, called: Floats, ticks: Floats) -> dict[str, Any]:
        """F1 less that of a sensor that always says contact, a trial left out of both at once."""
        (one, ones), (two, twos) = (
            self._left_out(2 * right, whole)
            for right, whole in ((hit, called), (truth, truth + ticks))
        )
        return {
            "f1_over_always_contact": _finite(one - two),
            "f1_over_always_contact_95": _interval(one - two, ones - twos, -1.0, 1.0),
        }

    def _ticks(self, group: Sequence[Comparison]) -> tuple[Floats, Floats, Floats]:
        """True positive, false positive and false negative ticks by trial, each (trials,)."""
        return (
            self._sum(group, lambda v: (v.truth & v.alarm).sum()),
            self._sum(group, lambda v: (~v.truth & v.alarm).sum()),
            self._sum(group, lambda v: (v.truth & ~v.alarm).sum()),
        )

    def f1_difference(
        self, first: Sequence[Comparison], second: Sequence[Comparison]
    ) -> dict[str, Any]:
        """F1 of the first group less that of the second, a trial left out of both at once."""
        (one, ones), (two, twos) = (
            self._left_out(2 * hit, 2 * hit + wrong + lost)
            for hit, wrong, lost in map(self._ticks, (first, second))
        )
        return {
            "f1_difference": _finite(one - two),
            "f1_difference_95": _interval(one - two, ones - twos, -1.0, 1.0),
        }

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

    def _ratio(self, name: str, part: Floats, whole: Floats) -> dict[str, Any]:
        value, left = self._left_out(part, whole)
        return {name: _finite(value), f"{name}_95": _interval(value, left, 0.0, 1.0)}

    def _latency(self, group: Sequence[Comparison], ticks: Sequence[Ints]) -> dict[str, Any]:
        """Median with its interval and 90th percentile [ms], and the median way meanwhile [mm]."""
        values = np.concatenate([np.zeros(0, dtype=np.int64), *ticks])
        if not len(values):
            keys = ("median_ms", "median_95_ms", "p90_ms", "median_mm")
            return {"n": 0, **dict.fromkeys(keys)}
        trials = np.concatenate(
            [np.full(len(t), v.trial) for v, t in zip(group, ticks, strict=True)]
        )
        way = np.concatenate(
            [v.speed * t * self._tick_ms for v, t in zip(group, ticks, strict=True)]
        )
        return {
            "n": len(values),
            "median_ms": float(np.median(values)) * self._tick_ms,
            "median_95_ms": _within(median95(np.float64(self._tick_ms) * values, trials), least=0.0)
            if len(np.unique(trials)) >= ENOUGH
            else None,
            "p90_ms": float(np.percentile(values, 90)) * self._tick_ms,
            "median_mm": float(np.median(way)),
        }

    def _area(
        self, name: str, group: Sequence[Comparison], scores: Sequence[Floats], edges: Floats
    ) -> dict[str, Any]:
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
        return {name: _finite(whole), f"{name}_95": _interval(whole, left, 0.0, 1.0)}


def _interval(value: float, left: Floats, least: float, most: float) -> tuple[float, float] | None:
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


def _within(
    ends: Floats, least: float = -np.inf, most: float = np.inf
) -> tuple[float, float] | None:
    low, high = ends.tolist()
    return (max(least, low), min(most, high)) if np.isfinite(ends).all() else None


def _rate(name: str, count: int, metres: float) -> dict[str, Any]:
    """Counts per metre with their exact interval."""
    if metres == 0.0:
        return {name: None, f"{name}_95": None}
    low, high = statistics.poisson95(count)
    return {name: count / metres, f"{name}_95": (low / metres, high / metres)}


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


def roc(group: Sequence[Comparison], threshold: float) -> dict[str, Any]:
    """ROC curve of b without hysteresis, and where a threshold lies on it."""
    truth = np.concatenate([np.zeros(0, dtype=bool), *(v.truth for v in group)])
    level = np.concatenate([np.zeros(0), *(v.level for v in group)])
    touching, free = np.sort(level[truth]), np.sort(level[~truth])
    own = float(np.log(threshold / (1.0 - threshold)))
    points = [_point(z, touching, free) for z in (*_LEVELS, own)]
    *curve, default = points
    best = max(curve, key=lambda point: point["f1"] or 0.0)
    share = len(touching) / len(truth) if len(truth) else float("nan")
    noise = np.random.default_rng(0).random(len(truth))
    return {
        "curve": curve,
        "default": default,
        "best_f1": best,
        "f1_always_contact": _finite(2.0 * share / (1.0 + share)),
        "auc_random": _finite(_auc(noise[truth], noise[~truth])),
    }


def _point(z: float, touching: Floats, free: Floats) -> dict[str, Any]:
    hit = len(touching) - int(np.searchsorted(touching, z))
    wrong = len(free) - int(np.searchsorted(free, z))
    whole = len(touching) + hit + wrong
    return {
        "theta": float(1.0 / (1.0 + np.exp(-z))),
        "true_positive_rate": hit / len(touching) if len(touching) else None,
        "false_positive_rate": wrong / len(free) if len(free) else None,
        "f1": 2.0 * hit / whole if whole else None,
    }
