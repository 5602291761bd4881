"""Figures of `antennate tunnel`: trials seen from above, and the controllers side by side."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator, PercentFormatter

from antennate import figures as style
from antennate.experiments.tunnel.monitor import TrialPath, TrialResult
from antennate.experiments.tunnel.run import TunnelOutcome
from antennate.messages import short_name
from antennate.types import Floats, Maneuver

SHOWN_TRIALS = 5
"""Trials drawn in the figure of trajectories."""
MARGIN = 0.3
"""Shown around the scene and the robots at the end [m]."""
FARTHEST = 1.0
"""Robots farther out than this are cut off [m]; a trial ends before, unless the physics failed."""

_OUTCOMES = {
    "success": "out after {:.1f} s",
    "timeout": "out of time, {:.0f} s",
    "left": "left the scene",
    "invalid": "invalid",
}


def figures(outcome: TunnelOutcome) -> dict[str, Figure]:
    """Both figures of a run."""
    config, trials = outcome.config, range(min(SHOWN_TRIALS, outcome.config.trials))
    return {
        "trajectories": trajectories(outcome.paths, config.controllers, outcome.rows, trials),
        "summary": summary(outcome.result()["controllers"], outcome.rows, config.time_limit),
    }


@style.styled
def trajectories(
    paths: Mapping[tuple[str, int], TrialPath],
    controllers: Sequence[str],
    rows: Sequence[TrialResult],
    trials: Sequence[int],
) -> Figure:
    """Trials from above: a column for each trial, a row for each controller.

    Args:
        paths: Courses by controller and trial; a missing one leaves its panel empty.
        controllers: Names from top to bottom.
        rows: The table.
        trials: Trials from left to right.
    """
    table = {(row.controller, row.trial): row for row in rows}
    boxes = {t: _box([paths[a, t] for a in controllers if (a, t) in paths]) for t in trials}
    sides = [box[1] - box[0] for box in boxes.values() if box is not None] or [np.ones(2)]
    aspect = float(max(side[1] for side in sides) / max(side[0] for side in sides))
    width = 0.5 + 2.3 * len(trials)
    figure = style.canvas(max(width, 6.4), 0.9 + len(controllers) * (2.0 * aspect + 0.35))
    panels = figure.subplots(len(controllers), len(trials), squeeze=False)
    for i, controller in enumerate(controllers):
        for j, trial in enumerate(trials):
            panel, box = panels[i, j], boxes[trial]
            _frame(panel, box)
            if (controller, trial) in paths:
                _draw_trial(panel, paths[controller, trial])
                row = table[controller, trial]
                outcome = _OUTCOMES[row.outcome].format(row.time_s)
                panel.set_title(f"trial {trial}: {outcome}", fontsize=8.5)
            else:
                panel.set_title(f"trial {trial}: not run", fontsize=8.5)
            if i == len(controllers) - 1:
                panel.set_xlabel("x [m]")
        panels[i, 0].set_ylabel("y [m]")
        panels[i, 0].annotate(
            short_name(controller),
            (0.0, 0.5),
            (-54.0, 0.0),
            xycoords="axes fraction",
            textcoords="offset points",
            rotation=90,
            ha="center",
            va="center",
            fontsize=11,
            fontweight="bold",
        )
    handles = _handles(list(paths.values()))
    figure.legend(handles=handles, loc="outside lower center", ncols=min(5, 2 + len(trials)))
    return figure


def _box(paths: Sequence[TrialPath]) -> tuple[Floats, Floats] | None:
    """Lower and upper corner of what is shown of one scene [m]; None without a course."""
    if not paths:
        return None
    path = paths[0]
    points = np.concatenate([*path.fixed, *path.before, path.exit, path.head[:1]])
    low, high = points.min(axis=0) - MARGIN, points.max(axis=0) + MARGIN
    links = np.concatenate([path.links for path in paths])
    near = ((links > low - FARTHEST) & (links < high + FARTHEST)).all(axis=1)  # false for NaN
    points = np.concatenate([points, links[near]])
    return points.min(axis=0) - MARGIN, points.max(axis=0) + MARGIN


def _frame(panel: Axes, box: tuple[Floats, Floats] | None) -> None:
    panel.set_aspect("equal", adjustable="box")
    panel.grid(visible=False)
    for axis in (panel.xaxis, panel.yaxis):
        axis.set_major_locator(MaxNLocator(4, steps=[1, 2, 5, 10]))
    if box is not None:
        panel.set_xlim(box[0][0], box[1][0])
        panel.set_ylim(box[0][1], box[1][1])


def _draw_trial(panel: Axes, path: TrialPath) -> None:
    for polygons, face, edge in (
        (path.after, style.FAINT, "none"),
        (path.before, "none", style.MUTED),
        (path.fixed, style.MUTED, style.MUTED),
    ):
        shapes = [polygon.tolist() for polygon in polygons]
        drawn = PolyCollection(shapes, facecolors=face, edgecolors=edge, linewidths=0.4)
        panel.add_collection(drawn, autolim=False)
    panel.plot(*path.exit.T, color=style.MUTED, linewidth=1.0, linestyle=(0, (2, 2)))
    for maneuver, points in _stretches(path):
        colour = style.MANEUVER_COLOURS[maneuver]
        panel.plot(*points.T, color=colour, linewidth=1.4, zorder=3)
    panel.plot(*path.links.T, color=style.INK, linewidth=2.4, alpha=0.75, zorder=4)
    panel.plot(*path.links.T, color=style.INK, linestyle="", marker="o", markersize=3, zorder=4)
    panel.plot(*path.links[0], color=style.INK, marker="o", markersize=5.5, zorder=5)


def _stretches(path: TrialPath) -> Iterator[tuple[Maneuver, Floats]]:
    """The course cut where the maneuver changes; a sample carries the maneuver that led to it."""
    cuts = [0, *(np.flatnonzero(np.diff(path.maneuver[1:])) + 1), len(path.head) - 1]
    for first, last in pairwise(cuts):
        if last > first:
            yield Maneuver(int(path.maneuver[last])), path.head[first : last + 1]


def _handles(paths: Sequence[TrialPath]) -> list[Any]:
    """What is drawn: of the scene only what it has."""
    lines = [
        Line2D([], [], color=colour, label=f"head, {style.MANEUVER_NAMES[maneuver]}")
        for maneuver, colour in style.MANEUVER_COLOURS.items()
    ]
    robot = {"linewidth": 2.4, "marker": "o", "markersize": 5, "label": "robot at the end"}
    lines.append(Line2D([], [], color=style.INK, **robot))
    dashed = {"linewidth": 1.0, "linestyle": (0, (2, 2))}
    lines.append(Line2D([], [], color=style.MUTED, **dashed, label="exit"))
    walls = [Patch(facecolor=style.MUTED, label="wall")]
    obstacles = [
        Patch(facecolor="white", edgecolor=style.MUTED, linewidth=0.6, label="obstacle at first"),
        Patch(facecolor=style.FAINT, label="obstacle at the end"),
    ]
    has_walls = any(len(path.fixed) for path in paths)
    has_obstacles = any(len(path.before) for path in paths)
    return [*lines, *(walls if has_walls else []), *(obstacles if has_obstacles else [])]


@style.styled
def summary(
    controllers: Mapping[str, Mapping[str, Any]], rows: Sequence[TrialResult], time_limit: float
) -> Figure:
    """Success, time inside and restricted mean time of every controller.

    Args:
        controllers: Per controller what result.json says of it.
        rows: The table.
        time_limit: Time after which a trial has failed [s].
    """
    figure = style.canvas(10.5, 3.4)
    rate, inside, mean = figure.subplots(1, 3, width_ratios=(1, 1.5, 1))
    names, colours = list(controllers), style.controller_colours(list(controllers))
    for i, (name, found) in enumerate(controllers.items()):
        valid = found["trials"] - found["invalid"]
        if not valid:
            continue
        colour, time = colours[name], found["restricted_mean_time_s"]
        _interval(rate, i, found["successes"] / valid, found["wilson95"], colour)
        _interval(mean, i, time, found["restricted_mean_time_95"] or (time, time), colour)
        exits = sorted(r.time_s for r in rows if r.controller == name and r.outcome == "success")
        left = 1.0 - np.arange(len(exits) + 1) / valid
        inside.step(
            [0.0, *exits, time_limit],
            [*left, left[-1]],
            where="post",
            color=colour,
            linestyle=style.CONTROLLER_LINES.get(name, "solid"),
            linewidth=3.2 - 0.8 * i,
            label=short_name(name),
        )
    for panel in (rate, mean):
        panel.set_yticks(range(len(names)), [_label(name, controllers[name]) for name in names])
        panel.tick_params(axis="y", labelsize=9, labelcolor=style.INK, length=0)
        panel.set_ylim(len(names) - 0.5, -0.5)
        panel.grid(visible=False, axis="y")
    rate.set(
        xlim=(-0.02, 1.02), xlabel="trials that succeeded [%]", title="Success with Wilson 95 %"
    )
    rate.xaxis.set_major_formatter(PercentFormatter(1.0, symbol=""))
    mean.set(
        xlim=(0, 1.02 * time_limit),
        xlabel="restricted mean time [s]",
        title="Failures count as the time limit; 95 %",
    )
    mean.set_yticklabels([short_name(name) for name in names])
    inside.set(
        xlim=(0, time_limit),
        ylim=(-0.03, 1.03),
        xlabel="time [s]",
        ylabel="trials still inside [%]",
        title=f"Trials still inside; failures until {time_limit:g} s",
    )
    inside.yaxis.set_major_formatter(PercentFormatter(1.0, symbol=""))
    if inside.lines:
        inside.legend(loc="upper right")
    return figure


def _label(name: str, found: Mapping[str, Any]) -> str:
    return f"{short_name(name)}\nn = {found['trials'] - found['invalid']}"


def _interval(panel: Axes, at: int, value: float, ends: Sequence[float], colour: str) -> None:
    panel.plot(
        list(ends), [at, at], color=colour, linewidth=2.4, solid_capstyle="butt", clip_on=False
    )
    panel.plot(value, at, color=colour, marker="o", markersize=8, clip_on=False)
