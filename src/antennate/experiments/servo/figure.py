"""Figure of `antennate servo`: goals, measured positions and those of the models."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from antennate import figures as style
from antennate.experiments.servo.run import SHOWN, ServoOutcome
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
    return {"servo": figure}


def _draw(panel: Axes, outcome: ServoOutcome, place: int, traces: Floats) -> None:
    recording, names = outcome.recordings[place], [model.name for model in outcome.models]
    t = STEP * SHOWN * np.arange(len(traces))
    inside = t <= recording.t[-1]
    panel.plot(recording.t, np.degrees(recording.goal), color=style.FAINT, label="goal")
    panel.plot(recording.t, np.degrees(recording.position), color=style.INK, label="measured")
    for row, colour in ((0, style.SERIES[4]), (outcome.shown, style.SERIES[0])):
        drawn = traces[inside, row]
        panel.plot(t[inside], drawn, color=colour, linewidth=1.1, label=names[row])
    off = ~recording.torque
    if off.any():
        first = recording.t[int(np.argmax(off))]
        panel.axvline(first, color=style.MUTED, linewidth=0.8, linestyle=":")
        where = {"xycoords": ("data", "axes fraction"), "textcoords": "offset points"}
        aside = {"xytext": (-3, -3), "ha": "right", "va": "top"}
        panel.annotate("torque off", (first, 1), fontsize=8, **aside, **where)
    panel.set_ylabel("position [deg]")
    panel.set_title(f"{recording.name}, gain {recording.p_gain:g}")
