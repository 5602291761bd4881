"""Figure of `antennate calibrate`: readings over the bend, the one curve, what it leaves."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from antennate import figures as style
from antennate.antenna.curves import Samples
from antennate.antenna.next_push import Pushes, branches
from antennate.experiments.calibrate.run import CalibrateOutcome
from antennate.types import Floats

_BINS = 12


@style.styled
def figures(outcome: CalibrateOutcome) -> dict[str, Figure]:
    """Readings against bends with the curve, residuals, both directions, and rival curves."""
    result, samples = outcome.result(), outcome.recording.samples
    known = result["assessment"]
    drawn = [part for part in ("hysteresis", "rivals") if known[part] and any(known[part].values())]
    heights = (5.2, 2.6 * len(drawn))[: 1 + bool(drawn)]
    figure = style.canvas(style.WIDTH, sum(heights))
    upper, *lower = figure.subfigures(len(heights), 1, height_ratios=heights, squeeze=False)[:, 0]
    above, below = upper.subplots(2, 1, sharex=True, height_ratios=(2, 1))
    _draw_speeds(above, below, samples, outcome.levels())
    _draw_curve(above, result["calibration"])
    if known["new_push"] is not None and known["new_push"]["error_95"] is not None:
        ends = known["new_push"]["error_95"]
        below.axhspan(*ends, color=style.FAINT, alpha=0.6, linewidth=0, zorder=0)
        below.set_title("grey: 95 % of the readings of a new push")
    below.axhline(0, color=style.MUTED, linewidth=0.8)
    below.set(xlabel="reading [counts]", ylabel="level − bend")
    if drawn:
        panels = lower[0].subplots(len(drawn), 1, squeeze=False)[:, 0]
        for panel, part in zip(panels, drawn, strict=True):
            if part == "hysteresis":
                _draw_loop(panel, known[part], samples)
            else:
                _draw_rivals(panel, known)
    return {"calibrate": figure}


def _draw_speeds(above: Axes, below: Axes, s: Samples, level: Floats) -> None:
    keys = np.where(np.isnan(s.speed), -1.0, s.speed)
    known = np.unique(keys).tolist()
    for key, colour in zip(known, style.series(len(known)), strict=True):
        rows = keys == key
        name = "all" if key < 0 else f"{100 * key:g} cm/s"
        label = f"{name}, {rows.sum()} readings"
        _draw_bins(above, s.counts[rows], s.level[rows], colour, label)
        _draw_bins(below, s.counts[rows], (level - s.level)[rows], colour, "")


def _draw_curve(panel: Axes, curve: Mapping[str, Any]) -> None:
    low, high = curve["valid_counts"]
    axis = np.linspace(low, high, 300)
    x = (axis - curve["counts_low"]) / (curve["counts_high"] - curve["counts_low"])
    z = curve["polarity"] * curve["slope"] * (x - curve["midpoint"])
    panel.plot(
        axis,
        1 / (1 + np.exp(-z)),
        color=style.INK,
        label=f"one sigmoid, R² {curve['r2']:.3f}",
        zorder=3,
    )
    panel.set_ylabel("bend, 0 straight, 1 full")
    panel.set_title(
        f"{curve['sensor_id']}: {curve['trials']} pushes;\nmean ± standard deviation of each bin"
    )
    panel.legend(fontsize=8)


def _draw_loop(panel: Axes, loop: Mapping[str, Any], samples: Samples) -> None:
    bend, *ways = branches(samples, Pushes.of(samples))
    for name, counts, colour in zip(("loading", "unloading"), ways, style.series(2), strict=True):
        known = np.isfinite(counts).any(axis=0)
        panel.plot(bend[known], np.nanmean(counts[:, known], axis=0), color=colour, label=name)
    panel.axvline(loop["at_bend"], color=style.MUTED, linewidth=0.8)
    panel.set(xlabel="bend", ylabel="mean reading [counts]")
    panel.set_title(
        f"Hysteresis: mean {100 * abs(loop['mean']):.1f} %,\nlargest "
        f"{100 * abs(loop['largest']):.1f} % of the span"
    )
    panel.legend()


def _draw_rivals(panel: Axes, known: Mapping[str, Any]) -> None:
    rivals = known["rivals"]
    checks = list(next(iter(rivals.values())))
    for i, (name, colour) in enumerate(zip(rivals, style.series(len(rivals)), strict=True)):
        rows = [rivals[name][check] for check in checks]
        middle = np.array([row["mean"] for row in rows])
        ends = np.array([row["interval_95"] for row in rows]).T
        panel.errorbar(
            middle,
            -np.arange(len(checks)) - 0.2 * i,
            xerr=abs(ends - middle),
            color=colour,
            label=name,
            marker="o",
            markersize=4,
            linestyle="",
            capsize=2.5,
        )
    panel.axvline(0, color=style.MUTED, linewidth=0.8)
    panel.set_yticks(-np.arange(len(checks)) - 0.1, checks)
    panel.set_xlabel("gain: error of the sigmoid minus the rival's")
    named = " and ".join(known["named"]) or "none"
    panel.set_title(f"Beats the sigmoid under every check:\n{named}")
    panel.set_ylim(-len(checks) + 0.4, 0.4)
    panel.legend(loc="upper center", bbox_to_anchor=(0.5, -0.35), ncols=2)


def _draw_bins(panel: Axes, x: Floats, y: Floats, colour: str, label: str) -> None:
    edges = np.linspace(x.min(), x.max(), _BINS + 1)
    place = np.clip(np.digitize(x, edges) - 1, 0, _BINS - 1)
    bins = [b for b in range(_BINS) if (place == b).sum() >= 2]
    panel.errorbar(
        [float(x[place == b].mean()) for b in bins],
        [float(y[place == b].mean()) for b in bins],
        [float(y[place == b].std()) for b in bins],
        color=colour,
        marker="o",
        markersize=4,
        linewidth=0.0,
        elinewidth=1.2,
        capsize=2,
        label=label,
    )
