"""Figure of `antennate servo`: goals, measured positions and those of the models."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from antennate import figures as style
from antennate.experiments.servo.run import SHOWN, ServoOutcome, stalled
from antennate.robots.servo_model import STEP
from antennate.types import Floats

_MOST = 8
"""Recordings drawn."""


@style.styled
def figures(outcome: ServoOutcome) -> dict[str, Figure]:
    """Each recording with two models, the simplest and that of the simulation or of its form."""
    count = min(_MOST, len(outcome.recordings))
    figure = style.canvas(style.WIDTH, 1.0 + 1.6 * count)
    panels = figure.subplots(count, 1, squeeze=False, sharex=True)[:, 0]
    traces = np.degrees(outcome.traces())
    for i, panel in enumerate(panels):
        _draw(panel, outcome, i, traces[:, :, i])
    panels[-1].set_xlabel("time [s]")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=2)
    return {"servo": figure, "recordings": _by_recording(outcome)}


@style.styled
def _by_recording(outcome: ServoOutcome) -> Figure:
    """The error of each recording: over all, while the shaft stalls, and else."""
    rows = outcome.rows
    figure = style.canvas(style.WIDTH, 1.2 + 0.3 * len(rows))
    panel, places = figure.subplots(), np.arange(len(rows))
    panel.barh(places, [row.error_deg for row in rows], color=style.FAINT, label="all of its time")
    for name, colour, label in (
        ("error_else_deg", style.SERIES[0], "without stalls"),
        ("error_stalled_deg", style.SERIES[4], "while it stalls"),
    ):
        panel.plot([getattr(row, name) for row in rows], places, "o", color=colour, label=label)
    panel.set_yticks(places, [f"{row.name}, gain {row.p_gain:g}" for row in rows])
    panel.invert_yaxis()
    panel.set_xlim(left=0.0)
    panel.set_xlabel("mean error [deg]")
    panel.grid(visible=False, axis="y")
    figure.legend(*panel.get_legend_handles_labels(), loc="outside upper center", ncols=3)
    return figure


def _draw(panel: Axes, outcome: ServoOutcome, place: int, traces: Floats) -> None:
    recording, names = outcome.recordings[place], [model.name for model in outcome.models]
    t = STEP * SHOWN * np.arange(len(traces))
    inside = t <= recording.t[-1]
    panel.plot(recording.t, np.degrees(recording.goal), color=style.FAINT, label="goal")
    panel.plot(recording.t, np.degrees(recording.position), color=style.INK, label="measured")
    for row, colour in ((0, style.SERIES[4]), (outcome.shown, style.SERIES[0])):
        drawn = traces[inside, row]
        panel.plot(t[inside], drawn, color=colour, linewidth=1.1, label=names[row])
    ends = np.flatnonzero(np.diff(stalled(recording).astype(int), prepend=0, append=0))
    for first, last in ends.reshape(-1, 2):
        begin, end = recording.t[[first, min(last, len(recording.t) - 1)]].tolist()
        panel.axvspan(begin, end, color=style.SERIES[4], alpha=0.15, linewidth=0)
    off = ~recording.torque
    if off.any():
        first = recording.t[int(np.argmax(off))]
        panel.axvline(first, color=style.MUTED, linewidth=0.8, linestyle=":")
        where = {"xycoords": ("data", "axes fraction"), "textcoords": "offset points"}
        aside = {"xytext": (-3, -3), "ha": "right", "va": "top"}
        panel.annotate("torque off", (first, 1), fontsize=8, **aside, **where)
    panel.set_ylabel("position [deg]")
    panel.set_title(f"{recording.name}, gain {recording.p_gain:g}")
