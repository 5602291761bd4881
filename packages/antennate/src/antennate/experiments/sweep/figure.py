"""Figure of `bench sweep`: shapes over the map, and errors of the estimates by cue."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from antennate import figures as style
from antennate.experiments.sweep.experiment import Sweeps
from antennate.experiments.sweep.result import ERROR, Cell, CueErrors, SweepResult

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
def figures(outcome: Sweeps) -> dict[str, Figure]:
    """Time shares of the shapes with the base fixed and moving, and the errors.

    The map is that of the `profile` of the estimates, or of the first profile.
    """
    result: SweepResult = outcome.result()
    figure = style.canvas(style.WIDTH, 14.0)
    upper, lower = np.array(figure.subfigures(2, 1, height_ratios=(1.25, 1)))
    name = result.profile if result.profile in result.shapes else next(iter(result.shapes))
    shapes = result.shapes[name]
    axes = upper.subplots(len(shapes), 1)
    for panel, (motion, each) in zip(np.atleast_1d(np.array(axes)), shapes.items(), strict=True):
        _draw_map(panel, each.map)
        panel.set_title(f"{name}, base {motion} ({each.cells} cells)")
        panel.set_xlabel("amplitude of the sweep [deg]")
        panel.set_ylabel("distance of the wall / length")
    handles = [
        upper.axes[0].plot([], [], marker="s", linestyle="", color=colour, label=shape)[0]
        for shape, colour in style.SHAPE_COLOURS.items()
    ]
    upper.legend(handles=handles, loc="outside lower center", ncols=3)
    panels = lower.subplots(2, 1, sharey=True)
    noisy = {name: each.noisy for name, each in result.estimates.items()}
    distance = {name: each.distance for name, each in noisy.items()}
    gap = {name: each.gap for name, each in noisy.items()}
    published = result.published_percent
    for panel, conditions, what, value, note in (
        (panels[0], distance, "Distance to a wall", published.base_to_tip, ", base to tip"),
        (panels[1], gap, "Width of a gap", published.gap, ""),
    ):
        _draw_errors(panel, conditions)
        panel.set_ylabel(ERROR.title)
        panel.axhline(value, color=style.INK, linewidth=1, linestyle=(0, (4, 2)))
        panel.set_title(f"{what}, with sensor noise (95 %);\ndashed: CITRAS, {value:g} %{note}")
    lower.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=1)
    return {"sweep": figure}


def _draw_map(panel: Axes, cells: Sequence[Cell]) -> None:
    """One bar of time shares for every cell: rows are distances, groups of columns centres."""
    distances = sorted({cell.distance for cell in cells})
    centres = sorted({cell.centre_rad for cell in cells})
    amplitudes = sorted({cell.amplitude_rad for cell in cells})
    step = len(amplitudes) + 0.6
    for cell in cells:
        left = step * centres.index(cell.centre_rad) + amplitudes.index(cell.amplitude_rad)
        row = distances.index(cell.distance)
        for shape, colour in style.SHAPE_COLOURS.items():
            width = 0.92 * getattr(cell, shape)
            panel.barh(row, width, 0.8, left=left, color=colour, linewidth=0)
            left += width
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


def _draw_errors(panel: Axes, conditions: Mapping[str, Mapping[str, CueErrors]]) -> None:
    """Errors of each cue, side by side in each condition."""
    for k, (cue, (marker, colour)) in enumerate(_CUE_MARKS.items()):
        found = [cues.get(cue) for cues in conditions.values()]
        style.intervals(
            panel,
            [i + 0.13 * (k - 2) for i in range(len(found))],
            [vars(each) if each else {} for each in found],
            (ERROR.name, ERROR.interval),
            min((each.n for each in found if each), default=0),
            marker=marker,
            color=colour,
            label=_CUE_NAMES[cue],
        )
    counts = {
        name: max((each.n for each in cues.values()), default=0)
        for name, cues in conditions.items()
    }
    style.categories(panel, [f"{name}\nn = {n}" for name, n in counts.items()])
    panel.set_yscale("log")
    panel.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
