"""Figures of `antennate fit`: errors before and after, a walk, intervals."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from antennate import figures as style
from antennate_lab.fit.residuals import YAW_AXIS, moving
from antennate_lab.fit.run import FitOutcome
from antennate_lab.fit.servo_recordings import ServoFit
from antennate_lab.servo import experiment as servo

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_BEFORE, _AFTER, _UNSEEN = style.MUTED, style.SERIES[0], style.SERIES[4]


@style.styled
def figures(outcome: FitOutcome | ServoFit) -> dict[str, Figure]:
    """Errors by step beside a walk, or recordings of a servo; parameters with their intervals."""
    if isinstance(outcome, ServoFit):
        return servo.figures(outcome.servo) | {"intervals": _intervals(outcome)}
    return {"steps": _steps(outcome), "intervals": _intervals(outcome)}


def _steps(outcome: FitOutcome) -> Figure:
    rows = outcome.result().steps
    figure = style.canvas(style.WIDTH, 1.0 + 0.16 * max(12, len(rows)))
    errors, walk = figure.subplots(1, 2)
    y = np.arange(len(rows))[::-1]
    colours = [_AFTER if row.fitted else _UNSEEN for row in rows]
    before, after = [[getattr(r, n) for r in rows] for n in ("error_before_deg", "error_deg")]
    errors.hlines(y, after, before, colors=style.FAINT, linewidth=1)
    errors.scatter(before, y, facecolors="none", edgecolors=colours, s=18)
    errors.scatter(after, y, c=colours, s=18)
    errors.set_yticks(y, [row.step for row in rows], fontsize=7)
    errors.set_xscale("log")
    errors.set_xlabel("error of angles [deg]")
    _draw_walk(walk, outcome)
    return figure


def _draw_walk(panel: Axes, outcome: FitOutcome) -> None:
    """The head's turning in the first step that the fit did not see, else how joints lag."""
    names = [course.name for _, course in outcome.courses]
    at = next((i for i, name in enumerate(names) if name in outcome.held), 0)
    _, course = outcome.courses[at]
    t = course.period * np.arange(len(course.commands))
    three = ((course, style.FAINT, "measured"), (outcome.made[at][0], _BEFORE, "before"))
    for each, colour, label in (*three, (outcome.made[at][1], _AFTER, "fitted")):
        joints = moving(course)
        turning = course.gyro.size > 0
        values = (
            each.gyro[:, YAW_AXIS]
            if turning
            else np.degrees(each.positions - each.commands)[:, joints[:1]]
        )
        width = 3.0 if each is course else 1.0
        panel.plot(t, values, color=colour, label=label, linewidth=width)
        panel.set_ylabel("turning of the head [rad/s]" if turning else "lag [deg]")
    panel.set_xlabel("time [s]")
    panel.set_title(course.name)
    low, high = panel.get_ylim()
    panel.set_ylim(low, high + 0.1 * (high - low))  # room for words above the lines
    short = {"handlelength": 0.5, "handletextpad": 0.3, "columnspacing": 0.5}
    panel.legend(loc="upper center", ncols=3, fontsize=7, borderpad=0.0, **short)


def _intervals(outcome: FitOutcome | ServoFit) -> Figure:
    rows = [row for row in outcome.rows if row.before > 0.0]
    figure = style.canvas(style.WIDTH, 1.0 + 0.18 * len(rows))
    panel = figure.subplots()
    for y, row in enumerate(reversed(rows)):
        colour = _AFTER if row.told else style.FAINT
        panel.plot([row.low / row.before, row.high / row.before], [y, y], color=colour)
        panel.plot(row.value / row.before, y, "o", color=colour, markersize=4)
    panel.axvline(1.0, color=style.MUTED, linewidth=0.8, linestyle=":")
    panel.set_yticks(range(len(rows)), [row.name for row in reversed(rows)], fontsize=7)
    panel.set_xscale("log")
    for axis in (panel.xaxis.set_major_formatter, panel.xaxis.set_minor_formatter):
        axis("{x:g}")
    panel.tick_params(axis="x", which="both", labelsize=7, rotation=45)
    panel.set_xlabel("over its value before")
    return figure
