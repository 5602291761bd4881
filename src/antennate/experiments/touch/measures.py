"""Many traverses in numbers: pooled ticks, contacts and alarms, with intervals over trials."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from antennate.experiments.touch.sensing import Comparison
from antennate.studies import statistics
from antennate.types import Floats, Ints

_DRAWS = 2000
_BINS = 500
_LEVELS = np.arange(-13.0, 13.01, 0.25)
"""Logits of the thresholds on the ROC curve."""


class Pool:
    """Measures of groups of comparisons; intervals resample trials, the same way in every group.

    Args:
        comparisons: All valid traverses.
        trials: Number of trials; a trial without valid traverses weighs nothing.
        rate: Ticks per second [Hz].
    """

    def __init__(self, comparisons: Sequence[Comparison], trials: int, rate: float) -> None:
        self._trials, self._tick_ms = trials, 1e3 / rate
        rng = np.random.default_rng(0)
        draws = rng.multinomial(trials, np.full(trials, 1.0 / trials), _DRAWS)
        self._weights = draws.astype(float)
        self._level_edges = _edges([v.level for v in comparisons])
        self._flex_edges = _edges([abs(v.flex) for v in comparisons])

    def measure(self, group: Sequence[Comparison]) -> dict[str, Any]:
        """All measures of one group."""
        matches = [v.matches for v in group]
        contacts = sum(len(m.contacts) for m in matches)
        missed = sum(int((~m.found).sum()) for m in matches)
        lost = np.concatenate([v.missed_flex for v in group]) if group else np.zeros(0)
        metres = self._sum(group, lambda v: v.metres)
        return {
            "traverses": len(group),
            "ticks": sum(len(v.truth) for v in group),
            "metres": float(metres.sum()),
            **self._per_tick(group),
            "contacts": contacts,
            "missed": missed,
            "missed_wilson95": statistics.wilson95(missed, contacts),
            "carried": sum(m.carried for m in matches),
            "alarms": sum(m.alarms for m in matches),
            "false": sum(m.false for m in matches),
            **self._ratio(
                "missed_per_m", self._sum(group, lambda v: (~v.matches.found).sum()), metres
            ),
            **self._ratio("false_per_m", self._sum(group, lambda v: v.matches.false), metres),
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
        """F1 of the first group less that of the second, trials resampled in both at once."""
        ends = []
        for group in (first, second):
            hit, wrong, lost = self._ticks(group)
            ends.append(self._drawn(2 * hit, 2 * hit + wrong + lost))
        (one, ones), (two, twos) = ends
        return {
            "f1_difference": _finite(one - two),
            "f1_difference_95": self._interval(ones - twos),
        }

    def _sum(self, group: Sequence[Comparison], value: Any) -> Floats:
        """Sums of value(comparison) by trial, shape (trials,)."""
        total = np.zeros(self._trials)
        for comparison in group:
            total[comparison.trial] += value(comparison)
        return total

    def _drawn(self, part: Floats, whole: Floats) -> tuple[float, Floats]:
        """A ratio of sums over trials, and the same of every resample, shape (draws,)."""
        with np.errstate(invalid="ignore", divide="ignore"):
            drawn = (self._weights @ part) / (self._weights @ whole)
            return float(np.divide(part.sum(), whole.sum())), drawn

    def _ratio(self, name: str, part: Floats, whole: Floats) -> dict[str, Any]:
        value, drawn = self._drawn(part, whole)
        return {name: _finite(value), f"{name}_95": self._interval(drawn)}

    def _interval(self, drawn: NDArray[Any]) -> tuple[float, float] | None:
        """Percentile interval of what exists; None with one trial or too little."""
        drawn = drawn[np.isfinite(drawn)]
        if self._trials < 2 or len(drawn) < _DRAWS / 2:
            return None
        low, high = np.percentile(drawn, [2.5, 97.5])
        return float(low), float(high)

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
        order = np.argsort(values, kind="stable")
        weight = self._weights[:, trials[order]].cumsum(axis=1)
        drawn = weight[:, -1] > 0
        half = (weight[drawn] >= weight[drawn, -1:] / 2).argmax(axis=1)
        return {
            "n": len(values),
            "median_ms": float(np.median(values)) * self._tick_ms,
            "median_95_ms": self._interval(values[order][half] * self._tick_ms),
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
        weights = self._weights
        with np.errstate(invalid="ignore", divide="ignore"):
            whole = np.divide(order.sum(), pairs.sum())
            drawn = ((weights @ order) * weights).sum(axis=1)
            drawn = drawn / ((weights @ pairs) * weights).sum(axis=1)
        return {name: _finite(float(whole)), f"{name}_95": self._interval(drawn)}


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
    """ROC curve of b without hysteresis, and where a threshold lies on it.

    Args:
        group: Valid traverses.
        threshold: Theta.
    """
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
