"""Figure of `bench sweep`: shapes over the map, and errors of the estimates by cue."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from antennate import figures as style
from antennate.experiments.sweep.experiment import SweepOutcome

_CUE_MARKS = {
    "flex_and_base": ("o", "#332288"),
    "flex": ("s", "#CC79A7"),
    "first_contact": ("^", "#009E73"),
    "closed_form": ("D", "#E69F00"),
    "blind": ("x", style.MUTED),
}
_CUE_NAMES = {
    "flex_and_base": "flex and base angle",
    "flex": "flex alone",
    "first_contact": "base angle at first contact",
    "closed_form": "flex and base angle, closed form",
    "blind": "nothing (mean of the calibration)",
}


@style.styled
def figures(outcome: SweepOutcome) -> dict[str, Figure]:
    """Time shares of the shapes with the base fixed and moving, and the errors.

    The map is that of the `profile` of the estimates, or of the first profile.
    """
    figure, result = style.canvas(style.WIDTH, 14.0), outcome.result()
    upper, lower = np.array(figure.subfigures(2, 1, height_ratios=(1.25, 1)))
    name = (
        result["profile"] if result["profile"] in result["shapes"] else next(iter(result["shapes"]))
    )
    shapes = result["shapes"][name]
    axes = upper.subplots(len(shapes), 1)
    for panel, (motion, row) in zip(np.atleast_1d(np.array(axes)), shapes.items(), strict=True):
        _draw_map(panel, row["map"])
        panel.set_title(f"{name}, base {motion} ({row['cells']} cells)")
        panel.set_xlabel("amplitude of the sweep [deg]")
        panel.set_ylabel("distance of the wall / length")
    handles = [
        upper.axes[0].plot([], [], marker="s", linestyle="", color=colour, label=shape)[0]
        for shape, colour in style.SHAPE_COLOURS.items()
    ]
    upper.legend(handles=handles, loc="outside lower center", ncols=3)
    panels = lower.subplots(2, 1, sharey=True)
    for panel, quantity, what in (
        (panels[0], "distance", "Distance to a wall"),
        (panels[1], "gap", "Width of a gap"),
    ):
        _draw_errors(panel, result["estimates"], quantity)
        panel.set_ylabel("mean absolute error [%]")
        key, note = ("gap", "") if quantity == "gap" else ("base_to_tip", ", base to tip")
        published = result["published_percent"][key]
        panel.axhline(published, color=style.INK, linewidth=1, linestyle=(0, (4, 2)))
        panel.set_title(f"{what}, with sensor noise (95 %);\ndashed: CITRAS, {published:g} %{note}")
    lower.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=1)
    return {"sweep": figure}


def _draw_map(panel: Axes, cells: Sequence[Mapping[str, Any]]) -> None:
    """One bar of time shares for every cell: rows are distances, groups of columns centres."""
    distances, centres, amplitudes = (
        sorted({cell[key] for cell in cells}) for key in ("distance", "centre_rad", "amplitude_rad")
    )
    step = len(amplitudes) + 0.6
    for cell in cells:
        left = step * centres.index(cell["centre_rad"]) + amplitudes.index(cell["amplitude_rad"])
        row = distances.index(cell["distance"])
        for shape, colour in style.SHAPE_COLOURS.items():
            panel.barh(row, 0.92 * cell[shape], 0.8, left=left, color=colour, linewidth=0)
            left += 0.92 * cell[shape]
    ticks = [
        (step * i + k + 0.46, f"{math.degrees(amplitude):.0f}")
        for i in range(len(centres))
        for k, amplitude in enumerate(amplitudes)
    ]
    panel.set_xticks([at for at, _ in ticks], [text for _, text in ticks])
    panel.set_yticks(range(len(distances)), [f"{d:.2f}" for d in distances])
    for i, centre in enumerate(centres):
        panel.text(
            step * i + len(amplitudes) / 2 - 0.04,
            len(distances) - 0.5,
            f"centre {math.degrees(centre):.0f}°",
            ha="center",
            fontsize=8,
        )
    panel.set_ylim(-0.5, len(distances) - 0.25)
    panel.grid(visible=False)


def _draw_errors(panel: Axes, estimates: Mapping[str, Any], quantity: str) -> None:
    by_condition = [by_noise["noisy"][quantity] for by_noise in estimates.values()]
    for k, (cue, (marker, colour)) in enumerate(_CUE_MARKS.items()):
        style.intervals(
            panel,
            [i + 0.13 * (k - 2) for i in range(len(by_condition))],
            [cues.get(cue, {}) for cues in by_condition],
            ("mape_percent", "mape_95"),
            min((cues[cue]["n"] for cues in by_condition if cue in cues), default=0),
            marker=marker,
            color=colour,
            label=_CUE_NAMES[cue],
        )
    numbers = [max((row["n"] for row in cues.values()), default=0) for cues in by_condition]
    labels = [f"{name}\nn = {n}" for name, n in zip(estimates, numbers, strict=True)]
    style.categories(panel, labels)
    panel.set_yscale("log")
    panel.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
