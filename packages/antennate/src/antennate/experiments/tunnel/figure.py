"""Figures of `antennate tunnel`: trials seen from above, and the controllers side by side."""

from __future__ import annotations

import math
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
from antennate.control.readings import short_names
from antennate.control.registry import looks
from antennate.experiments.tunnel.lockstep import SHOWN_TRIALS
from antennate.experiments.tunnel.physics import TrialPath, TrialResult, TunnelConfig
from antennate.experiments.tunnel.result import ControllerSummary, TunnelResult
from antennate.studies.columns import Ends
from antennate.studies.trials import Found
from antennate.types import Floats, Maneuver

MARGIN = 0.3
"""Shown around the scene and the robots at the end [m]."""
FARTHEST = 1.0
"""Robots farther out than this are cut off [m]; a trial ends before, unless the physics failed."""

_WIDTH = 5.6
"""Of the figure where its panels fill it: with letters of 8 points a phone shows them [inches]."""
_LEFT, _RIGHT, _BETWEEN, _NARROWEST, _WIDEST = 0.68, 0.05, 0.12, 1.1, 2.4
"""Beside the panels, between two of them, and the width of one [inches]."""
_HEAD, _TITLE, _AXIS, _LEGEND_LINE = 0.5, 0.42, 0.46, 0.175
"""Heights [inches]: name and title, ticks and title, ticks and label, a line of the legend."""

_OUTLINE = 0.7
"""Width of lines around the robot [points]: its antennae are thinner than that."""

_OUTCOMES = {
    "success": "crossed, {:.1f} s",
    "timeout": "out of time",
    "left": "left the scene",
    "overturned": "overturned",
    "fell": "fell",
    "invalid": "invalid",
}


def figures(found: Found[TunnelConfig, TunnelResult, TrialPath]) -> dict[str, Figure]:
    """Both figures of a run."""
    result, trials = found.result(), range(min(SHOWN_TRIALS, found.config.trials))
    return {
        "trajectories": trajectories(found.drawn, found.config.conditions, found.rows, trials),
        "summary": summary(result.controllers, found.rows, result.time_limit_s),
    }


@style.styled
def trajectories(
    paths: Mapping[tuple[str, int], TrialPath],
    controllers: Sequence[str],
    rows: Sequence[TrialResult],
    trials: Sequence[int],
) -> Figure:
    """Trials from above: a row of panels for each trial, a column for each controller.

    Args:
        paths: Courses by controller and trial; a missing one leaves its panel empty.
        controllers: Names from left to right.
        rows: The table.
        trials: Trials from top to bottom.
    """
    table = {(row.controller, row.trial): row for row in rows}
    boxes = {t: _box([paths[a, t] for a in controllers if (a, t) in paths]) for t in trials}
    known = [high - low for low, high in filter(None, boxes.values())] or [np.ones(2)]
    most = np.max(known, axis=0)
    sides = [most if box is None else box[1] - box[0] for box in boxes.values()]
    step = float(np.diff(MaxNLocator(3, steps=[1, 2, 5, 10]).tick_values(0, most.max()))[0])
    figure, panels = _panels(len(controllers), sides, step, _handles(list(paths.values())))
    for i, (controller, label) in enumerate(style.plain(short_names(controllers)).items()):
        for panel, trial in zip(panels[:, i], trials, strict=True):
            place, box = (controller, trial), boxes[trial]
            if box is not None:
                panel.set(xlim=(box[0][0], box[1][0]), ylim=(box[0][1], box[1][1]))
            said = "not run"
            if place in paths:
                _draw_trial(panel, paths[place])
                said = _OUTCOMES[table[place].outcome].format(table[place].time_s)
            panel.set_title(said, fontsize=8)
        _name_column(panels[0, i], label)
    for panel, trial in zip(panels[:, 0], trials, strict=True):
        panel.set_ylabel(f"trial {trial}, y [m]", fontsize=8)
    for panel in panels[-1]:
        panel.set_xlabel("x [m]", fontsize=8)
    return figure


def _panels(
    columns: int, sides: Sequence[Floats], step: float, handles: Sequence[Any]
) -> tuple[Figure, Any]:
    """A figure with its legend and its panels, shape (rows, columns), all of one scale.

    Every place is known, so nothing is left to a layout engine: with panels of a fixed aspect it
    puts titles on the letters above them.
    """
    room = _WIDTH - _LEFT - _RIGHT - (columns - 1) * _BETWEEN
    width = min(max(_NARROWEST, room / columns), _WIDEST)
    sizes = [side * width / max(side[0] for side in sides) for side in sides]
    across = _LEFT + _RIGHT + (columns - 1) * _BETWEEN + columns * width
    in_line = max(1, int(across // 1.8))
    top = _HEAD + _LEGEND_LINE * (1 + math.ceil(len(handles) / in_line))
    high = top + sum(size[1] for size in sizes) + (len(sizes) - 1) * _TITLE + _AXIS
    figure = Figure(figsize=(across, high))
    panels = np.empty((len(sides), columns), object)
    for j, i in np.ndindex(panels.shape):
        left = _LEFT + i * (width + _BETWEEN)
        base = high - top - sum(size[1] for size in sizes[: j + 1]) - j * _TITLE
        shape = left / across, base / high, sizes[j][0] / across, sizes[j][1] / high
        panels[j, i] = panel = figure.add_axes(shape)
        panel.set_aspect("equal", adjustable="box")
        panel.grid(visible=False)
        for axis in (panel.xaxis, panel.yaxis):
            axis.set_major_locator(MultipleLocator(step))
        panel.tick_params(labelleft=i == 0)
    figure.legend(handles=handles, loc="upper center", ncols=in_line, fontsize=8)
    return figure, panels


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
    controllers: Mapping[str, ControllerSummary],
    rows: Sequence[TrialResult],
    time_limit: float | None,
) -> Figure:
    """Success, time inside and restricted mean time of every controller.

    Args:
        controllers: Summary of each controller.
        rows: The table.
        time_limit: Time after which a trial has failed [s]; None where each trial has its own,
            then times are shares of it.
    """
    figure = style.canvas(style.WIDTH, 2.6 + 2 * (1.0 + 0.4 * len(controllers)))
    heights = 1.0 + 0.4 * len(controllers), 2.6, 1.0 + 0.4 * len(controllers)
    rate, inside, mean = figure.subplots(3, 1, height_ratios=heights)
    drawn = looks(controllers)
    short = style.plain(short_names(controllers))
    for i, (name, row) in enumerate(controllers.items()):
        valid, (colour, line) = row.trials - row.invalid, drawn[name]
        if not valid:
            continue
        time, ends = row.restricted_mean_time_s, row.restricted_mean_time_95
        if time_limit is None:
            time, ends = row.restricted_mean_share, row.restricted_mean_share_95
        _interval(rate, i, row.successes / valid, row.wilson95, colour)
        assert time is not None  # noqa: S101  there is a valid trial
        _interval(mean, i, time, ends if valid >= style.ENOUGH_TRIALS else None, colour)
        exits = sorted(
            r.time_s / (r.limit_s if time_limit is None else 1.0)
            for r in rows
            if r.controller == name and r.outcome == "success"
        )
        inside.step(
            [0.0, *exits, time_limit or 1.0],
            [*(left := 1.0 - np.arange(len(exits) + 1) / valid), left[-1]],
            where="post",
            color=colour,
            linestyle=line,
            linewidth=max(1.2, 3.2 - 0.8 * i),
            label=short[name],
        )
    valid = [row.trials - row.invalid for row in controllers.values()]
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


def _title_panels(
    rate: Axes, inside: Axes, mean: Axes, time_limit: float | None, trials: int
) -> None:
    shares, most = time_limit is None, time_limit or 1.0
    time = "time, share of the limit [%]" if shares else "time [s]"
    until = "its limit" if shares else f"{time_limit:g} s"
    rate.set(
        xlim=(-0.02, 1.02),
        xlabel="trials that succeeded [%]",
        title="Success; Wilson 95 %",
    )
    mean.set(
        xlim=(0, 1.02 * most),
        xlabel=f"restricted mean {time}",
        title=f"Time to the exit; {style.interval_note(trials)}",
    )
    inside.set(
        xlim=(0, most),
        ylim=(-0.03, 1.03),
        xlabel=time,
        ylabel="trials still inside [%]",
        title=f"Trials still inside; failures until {until}",
    )
    for axis in (rate.xaxis, inside.yaxis, *((mean.xaxis, inside.xaxis) if shares else ())):
        axis.set_major_formatter(PercentFormatter(1.0, symbol=""))


def _interval(panel: Axes, at: int, value: float, ends: Ends | None, colour: str) -> None:
    """A value, and its interval if it has one."""
    panel.plot(
        list(ends or ()),
        [at] * len(ends or ()),
        color=colour,
        linewidth=2.4,
        solid_capstyle="butt",
        clip_on=False,
    )
    panel.plot(value, at, color=colour, marker="o", markersize=8, clip_on=False)
