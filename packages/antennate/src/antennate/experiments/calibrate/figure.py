"""Figures of `calibrate`: readings against bends, what the curve leaves, and rival curves."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from antennate import figures as style
from antennate.antenna.calibration import Calibration
from antennate.antenna.curves import Samples
from antennate.experiments.calibrate.next_push import Assessment, Hysteresis, Pushes, branches
from antennate.experiments.calibrate.run import CalibrateOutcome
from antennate.types import Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_BINS = 12


@style.styled
def figures(outcome: CalibrateOutcome) -> dict[str, Figure]:
    """Readings against bends with the curve, residuals, both directions, and rival curves."""
    samples, known = outcome.recording.samples, outcome.assessment
    loop, rivals = known.hysteresis, any(known.rivals.values())
    drawn = (loop is not None) + rivals
    heights = (5.2, 2.6 * drawn)[: 1 + bool(drawn)]
    figure = style.canvas(style.WIDTH, sum(heights))
    upper, *lower = figure.subfigures(len(heights), 1, height_ratios=heights, squeeze=False)[:, 0]
    above, below = upper.subplots(2, 1, sharex=True, height_ratios=(2, 1))
    _draw_speeds(above, below, samples, outcome.levels())
    _draw_curve(above, outcome.calibration)
    if known.new_push is not None and known.new_push.error_95 is not None:
        below.axhspan(*known.new_push.error_95, color=style.FAINT, alpha=0.6, linewidth=0, zorder=0)
        below.set_title("grey: 95 % of the readings of a new push")
    below.axhline(0, color=style.MUTED, linewidth=0.8)
    below.set(xlabel="reading [counts]", ylabel="level − bend")
    panels = iter(lower[0].subplots(drawn, 1, squeeze=False)[:, 0] if drawn else ())
    if loop is not None:
        _draw_loop(next(panels), loop, samples)
    if rivals:
        _draw_rivals(next(panels), known)
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


def _draw_curve(panel: Axes, curve: Calibration) -> None:
    axis = np.linspace(*curve.valid_counts, 300)
    label = f"one {curve.kind}, R² {curve.r2:.3f}"
    panel.plot(axis, curve.level(axis), color=style.INK, label=label, zorder=3)
    panel.set_ylabel("bend, 0 straight, 1 full")
    panel.set_title(
        f"{curve.sensor_id}: {curve.trials} pushes;\nmean ± standard deviation of each bin"
    )
    panel.legend(fontsize=8)


def _draw_loop(panel: Axes, loop: Hysteresis, samples: Samples) -> None:
    bend, *ways = branches(samples, Pushes.of(samples))
    for name, counts, colour in zip(("loading", "unloading"), ways, style.series(2), strict=True):
        known = np.isfinite(counts).any(axis=0)
        panel.plot(bend[known], np.nanmean(counts[:, known], axis=0), color=colour, label=name)
    panel.axvline(loop.at_bend, color=style.MUTED, linewidth=0.8)
    panel.set(xlabel="bend", ylabel="mean reading [counts]")
    panel.set_title(
        f"Hysteresis: mean {100 * abs(loop.mean):.1f} %,\nlargest "
        f"{100 * abs(loop.largest):.1f} % of the span"
    )
    panel.legend()


def _draw_rivals(panel: Axes, known: Assessment) -> None:
    rivals = known.rivals
    checks = list(next(iter(rivals.values())))
    for i, (name, colour) in enumerate(zip(rivals, style.series(len(rivals)), strict=True)):
        rows = [rivals[name][check] for check in checks]
        middle = np.array([row.mean for row in rows])
        ends = np.array([row.interval_95 for row in rows]).T
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
    named = " and ".join(known.named) or "none"
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
