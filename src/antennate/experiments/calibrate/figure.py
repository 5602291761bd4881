"""Figure of `antennate calibrate`: readings over the bend, the one curve, what it leaves."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from antennate import figures as style
from antennate.experiments.calibrate.run import CalibrateOutcome
from antennate.types import Floats

_BINS = 12


def figures(outcome: CalibrateOutcome) -> dict[str, Figure]:
    """The figure of a run."""
    s = outcome.recording.samples
    return {"calibrate": calibrate(outcome.result(), s.counts, s.level, s.speed, outcome.levels())}


@style.styled
def calibrate(
    result: Mapping[str, Any], counts: Floats, bend: Floats, speed: Floats, level: Floats
) -> Figure:
    """Readings against bends with the curve above, residuals below.

    Args:
        result: The content of result.json.
        counts: Readings [counts], shape (n,).
        bend: Bends, 0 to 1, shape (n,).
        speed: Pushing speeds [m/s], NaN where unknown, shape (n,).
        level: What the curve makes of the readings, shape (n,).
    """
    found = result["calibration"]
    figure = style.canvas(6.4, 5.6)
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(2, 1))
    keys = np.where(np.isnan(speed), -1.0, speed)
    known = np.unique(keys).tolist()
    for key, colour in zip(known, style.series(len(known)), strict=True):
        here = keys == key
        name = "all" if key < 0 else f"{100 * key:g} cm/s"
        label = f"{name}, {here.sum()} readings"
        _draw_bins(above, counts[here], bend[here], colour, label)
        _draw_bins(below, counts[here], level[here] - bend[here], colour, "")
    low, high = found["valid_counts"]
    axis = np.linspace(low, high, 300)
    x = (axis - found["counts_low"]) / (found["counts_high"] - found["counts_low"])
    z = found["polarity"] * found["slope"] * (x - found["midpoint"])
    above.plot(
        axis,
        1 / (1 + np.exp(-z)),
        color=style.INK,
        label=f"one sigmoid, R² {found['r2']:.3f}",
        zorder=3,
    )
    below.axhline(0, color=style.MUTED, linewidth=0.8)
    above.set_ylabel("bend, 0 straight, 1 full")
    above.set_title(
        f"{found['sensor_id']}: {found['trials']} pushes; mean ± standard deviation of each bin"
    )
    below.set(xlabel="reading [counts]", ylabel="level − bend")
    above.legend(fontsize=8)
    return figure


def _draw_bins(panel: Axes, x: Floats, y: Floats, colour: str, label: str) -> None:
    edges = np.linspace(x.min(), x.max(), _BINS + 1)
    place = np.clip(np.digitize(x, edges) - 1, 0, _BINS - 1)
    held = [b for b in range(_BINS) if (place == b).sum() >= 2]
    panel.errorbar(
        [float(x[place == b].mean()) for b in held],
        [float(y[place == b].mean()) for b in held],
        [float(y[place == b].std()) for b in held],
        color=colour,
        marker="o",
        markersize=4,
        linewidth=0.0,
        elinewidth=1.2,
        capsize=2,
        label=label,
    )
