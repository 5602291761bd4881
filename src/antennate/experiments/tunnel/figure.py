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
from matplotlib.ticker import MaxNLocator, MultipleLocator, PercentFormatter

from antennate import figures as style
from antennate.experiments.tunnel.batch import SHOWN_TRIALS
from antennate.experiments.tunnel.monitor import TrialPath, TrialResult
from antennate.experiments.tunnel.run import TunnelOutcome
from antennate.messages import short_names
from antennate.types import Floats, Maneuver

MARGIN = 0.3
"""Shown around the scene and the robots at the end [m]."""
FARTHEST = 1.0
"""Robots farther out than this are cut off [m]; a trial ends before, unless the physics failed."""

_OUTLINE = 0.7
"""Width of lines around the robot [points]: its antennae are thinner than that."""

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
    """Trials from above: a row for each trial, a column for each controller.

    Of a single trial the panels are larger and stand below one another.

    Args:
        paths: Courses by controller and trial; a missing one leaves its panel empty.
        controllers: Names from left to right.
        rows: The table.
        trials: Trials from top to bottom.
    """
    table = {(row.controller, row.trial): row for row in rows}
    boxes = {t: _box([paths[a, t] for a in controllers if (a, t) in paths]) for t in trials}
    sides = [high - low for low, high in filter(None, boxes.values())] or [np.ones(2)]
    figure, panels = _panels(len(trials), len(controllers), sides)
    step = float(np.diff(MaxNLocator(4, steps=[1, 2, 5, 10]).tick_values(0, np.max(sides)))[0])
    for i, (controller, label) in enumerate(short_names(controllers).items()):
        for j, trial in enumerate(trials):
            panel, place = panels[j, i], (controller, trial)
            _frame(panel, boxes[trial], step)
            said = "not run"
            if place in paths:
                _draw_trial(panel, paths[place])
                said = _OUTCOMES[table[place].outcome].format(table[place].time_s)
            panel.set_title(f"trial {trial}: {said}", fontsize=8)
        _name_column(panels[0, i], label)
    for panel in panels[-1]:
        panel.set_xlabel("x [m]")
    for panel in panels[:, 0]:
        panel.set_ylabel("y [m]")
    handles = _handles(list(paths.values()))
    columns = int(figure.get_figwidth() // 2)
    figure.legend(handles=handles, loc="outside lower center", ncols=columns)
    return figure


def _panels(rows: int, columns: int, sides: Sequence[Floats]) -> tuple[Figure, Any]:
    """An empty figure and its panels, shape (rows, columns), as high as the boxes need."""
    aspect = float(max(side[1] for side in sides) / max(side[0] for side in sides))
    width = 1.6 if rows > 1 and columns > 1 else style.WIDTH - 0.5
    height = (width - 0.3) * aspect + 0.35
    if rows == 1:
        figure = style.canvas(style.WIDTH, 1.5 + columns * (height + 0.3))
        return figure, figure.subplots(columns, 1, squeeze=False).T
    around = 1.5 + 0.25 * max(0, SHOWN_TRIALS - rows)  # few rows have little room to give away
    figure = style.canvas(max(0.5 + width * columns, style.WIDTH), around + rows * height)
    return figure, figure.subplots(rows, columns, squeeze=False)


def _name_column(panel: Axes, label: str) -> None:
    panel.annotate(
        label,
        (0.0, 1.0),
        (0.0, 18.0),
        xycoords="axes fraction",
        textcoords="offset points",
        fontsize=11,
        fontweight="bold",
    )


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
    low, high = points.min(axis=0) - MARGIN, points.max(axis=0) + MARGIN
    pushed = np.concatenate([low[None], *(each for path in paths for each in path.after)])
    pushed = pushed[((pushed > low - FARTHEST) & (pushed < high + FARTHEST)).all(axis=1)]
    return np.minimum(low, pushed.min(axis=0)), np.maximum(high, pushed.max(axis=0))


def _frame(panel: Axes, box: tuple[Floats, Floats] | None, step: float) -> None:
    panel.set_aspect("equal", adjustable="box")
    panel.grid(visible=False)
    for axis in (panel.xaxis, panel.yaxis):
        axis.set_major_locator(MultipleLocator(step))
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
    robot = PolyCollection(
        [part.tolist() for part in path.parts],
        facecolors=style.INK,
        edgecolors=style.INK,
        linewidths=_OUTLINE,
        zorder=4,
    )
    panel.add_collection(robot, autolim=False)


def _stretches(path: TrialPath) -> Iterator[tuple[Maneuver, Floats]]:
    """The course cut where the maneuver changes; a sample carries the maneuver that led to it."""
    cuts = [0, *(np.flatnonzero(np.diff(path.maneuver[1:])) + 1), len(path.head) - 1]
    for first, last in pairwise(cuts):
        if last > first:
            yield Maneuver(int(path.maneuver[last])), path.head[first : last + 1]


def _handles(paths: Sequence[TrialPath]) -> list[Any]:
    """What is drawn: of the scene only what it has."""
    lines: list[Any] = [
        Line2D([], [], color=colour, label=f"head, {style.MANEUVER_NAMES[maneuver]}")
        for maneuver, colour in style.MANEUVER_COLOURS.items()
    ]
    lines.append(Patch(facecolor=style.INK, label="robot at the end"))
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
    figure = style.canvas(style.WIDTH, 2.6 + 2 * (1.0 + 0.4 * len(controllers)))
    heights = 1.0 + 0.4 * len(controllers), 2.6, 1.0 + 0.4 * len(controllers)
    rate, inside, mean = figure.subplots(3, 1, height_ratios=heights)
    colours, short = style.controller_colours(list(controllers)), short_names(controllers)
    for i, (name, found) in enumerate(controllers.items()):
        valid, colour = found["trials"] - found["invalid"], colours[name]
        if not valid:
            continue
        time = found["restricted_mean_time_s"]
        ends = found["wilson95"], found["restricted_mean_time_95"]
        share95, time95 = ends if valid >= style.ENOUGH_TRIALS else ((), ())
        _interval(rate, i, found["successes"] / valid, share95, colour)
        _interval(mean, i, time, time95 or (), colour)
        exits = sorted(r.time_s for r in rows if r.controller == name and r.outcome == "success")
        inside.step(
            [0.0, *exits, time_limit],
            [*(left := 1.0 - np.arange(len(exits) + 1) / valid), left[-1]],
            where="post",
            color=colour,
            linestyle=style.CONTROLLER_LINES.get(name, "solid"),
            linewidth=max(1.2, 3.2 - 0.8 * i),
            label=short[name],
        )
    valid = [found["trials"] - found["invalid"] for found in controllers.values()]
    counted = [f"{label}\nn = {n}" for label, n in zip(short.values(), valid, strict=True)]
    _name_lines(rate, counted)
    _name_lines(mean, list(short.values()))
    _title_panels(rate, inside, mean, time_limit, min(valid))
    if inside.lines:
        inside.legend(loc="upper right")
    return figure


def _name_lines(panel: Axes, labels: Sequence[str]) -> None:
    """A line for each controller, from top to bottom."""
    panel.set_yticks(range(len(labels)), labels)
    panel.tick_params(axis="y", labelsize=9, labelcolor=style.INK, length=0)
    panel.set_ylim(len(labels) - 0.5, -0.5)
    panel.grid(visible=False, axis="y")


def _title_panels(rate: Axes, inside: Axes, mean: Axes, time_limit: float, trials: int) -> None:
    rate.set(
        xlim=(-0.02, 1.02),
        xlabel="trials that succeeded [%]",
        title=f"Success; {style.interval_note('Wilson 95 %', trials)}",
    )
    mean.set(
        xlim=(0, 1.02 * time_limit),
        xlabel="restricted mean time [s]",
        title=style.interval_note("Time to the exit; 95 %", trials).capitalize(),
    )
    inside.set(
        xlim=(0, time_limit),
        ylim=(-0.03, 1.03),
        xlabel="time [s]",
        ylabel="trials still inside [%]",
        title=f"Trials still inside; failures until {time_limit:g} s",
    )
    for axis in (rate.xaxis, inside.yaxis):
        axis.set_major_formatter(PercentFormatter(1.0, symbol=""))


def _interval(panel: Axes, at: int, value: float, ends: Sequence[float], colour: str) -> None:
    """A value, and its interval if it has one."""
    panel.plot(
        list(ends),
        [at] * len(ends),
        color=colour,
        linewidth=2.4,
        solid_capstyle="butt",
        clip_on=False,
    )
    panel.plot(value, at, color=colour, marker="o", markersize=8, clip_on=False)
