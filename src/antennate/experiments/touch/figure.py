"""Figures of `antennate touch`: how well contact is sensed, the ROC, and one traverse in detail."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator

from antennate import figures as style
from antennate.experiments.touch.run import Trace
from antennate.experiments.touch.traverse import Traverse

_TRUE, _SENSED = "#0072B2", "#D55E00"
_SHAPES = 14
"""Shapes of the antenna drawn along a wall."""


@style.styled
def measures(result: Mapping[str, Any]) -> Figure:
    """F1 by speed and by wall, and both latencies by speed, one colour a profile.

    Args:
        result: The content of result.json.
    """
    figure = style.canvas(10.0, 6.6)
    (by_speed, by_wall), (onset, release) = figure.subplots(2, 2)
    _draw_by_speed(by_speed, result)
    _draw_by_wall(by_wall, result)
    for panel, key in ((onset, "onset"), (release, "release")):
        _draw_latency(panel, result, key)
    handles, labels = by_speed.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=len(labels))
    return figure


def _profiles(result: Mapping[str, Any]) -> list[tuple[str, float]]:
    """Profiles, and how far each is moved aside, as a share of the room."""
    names = list(result["profiles"])
    return [(name, (i - (len(names) - 1) / 2) / max(len(names), 3)) for i, name in enumerate(names)]


def _points(
    panel: Axes,
    name: str,
    x: Sequence[float],
    y: Sequence[float | None],
    interval: Sequence[Sequence[float] | None],
) -> None:
    """Points with their intervals; what does not exist is left out."""
    colour, marker, _ = style.PROFILE_LOOKS[name]
    known = [(a, b, i) for a, b, i in zip(x, y, interval, strict=True) if b is not None]
    if not known:
        panel.plot([], [], color=colour, marker=marker, linestyle="", label=name)
        return
    where = [a for a, _, _ in known]
    value = np.array([b for _, b, _ in known])
    ends = np.array([i if i is not None else (b, b) for _, b, i in known]).T
    panel.errorbar(
        where,
        value,
        yerr=np.maximum(0.0, np.array([value - ends[0], ends[1] - value])),
        color=colour,
        marker=marker,
        markersize=5,
        linestyle="",
        capsize=2.5,
        elinewidth=1.2,
        label=name,
    )


def _speeds(result: Mapping[str, Any]) -> list[float]:
    return sorted({row["speed_m_s"] for row in result["by_speed"]})


def _by_speed(result: Mapping[str, Any], name: str) -> list[Mapping[str, Any]]:
    rows = [row for row in result["by_speed"] if row["profile"] == name]
    return sorted(rows, key=lambda row: row["speed_m_s"])


def _speed_axis(panel: Axes, speeds: Sequence[float]) -> None:
    panel.set_xticks(range(len(speeds)), [f"{speed:g}" for speed in speeds])
    panel.set_xlim(-0.6, len(speeds) - 0.4)
    panel.set_xlabel("speed of the traverse [m/s]")
    panel.grid(visible=False, axis="x")


def _draw_by_speed(panel: Axes, result: Mapping[str, Any]) -> None:
    for name, aside in _profiles(result):
        rows = _by_speed(result, name)
        x = [i + 0.6 * aside for i in range(len(rows))]
        _points(panel, name, x, [r["f1"] for r in rows], [r["f1_95"] for r in rows])
    traverses = sorted({row["traverses"] for row in result["by_speed"]})
    count = f"{traverses[0]}" if len(traverses) == 1 else f"{traverses[0]} to {traverses[-1]}"
    panel.set(ylim=(0, 1.02), ylabel="F1 of contact, 0 to 1")
    panel.set_title(f"All walls, n = {count} traverses a point, 95 %")
    _speed_axis(panel, _speeds(result))


def _draw_by_wall(panel: Axes, result: Mapping[str, Any]) -> None:
    walls = list(dict.fromkeys(row["wall"] for row in result["by_wall"]))
    for name, aside in _profiles(result):
        rows = [row for row in result["by_wall"] if row["profile"] == name]
        x = [walls.index(r["wall"]) + 0.6 * aside for r in rows]
        _points(panel, name, x, [r["f1"] for r in rows], [r["f1_95"] for r in rows])
    panel.set_xticks(range(len(walls)), walls)
    panel.set_xlim(-0.6, len(walls) - 0.4)
    panel.grid(visible=False, axis="x")
    panel.set(ylim=(-0.03, 1.02), xlabel="wall", ylabel="F1 of contact, 0 to 1")
    counts = sorted({row["traverses"] for row in result["by_wall"]})
    many = f"{counts[0]}" if len(counts) == 1 else f"{counts[0]} to {counts[-1]}"
    panel.set_title(f"All speeds, n = {many} traverses a point, 95 %")


def _draw_latency(panel: Axes, result: Mapping[str, Any], key: str) -> None:
    counts = []
    for name, aside in _profiles(result):
        rows = [row[key] for row in _by_speed(result, name)]
        x = [i + 0.6 * aside for i in range(len(rows))]
        counts += [row["n"] for row in rows]
        _points(panel, name, x, [r["median_ms"] for r in rows], [r["median_95_ms"] for r in rows])
        known = [(a, r["p90_ms"]) for a, r in zip(x, rows, strict=True) if r["n"]]
        if known:
            panel.plot(
                *zip(*known, strict=True),
                color=style.PROFILE_LOOKS[name][0],
                marker="_",
                markersize=11,
                markeredgewidth=1.8,
                linestyle="",
            )
    low, high = min(counts, default=0), max(counts, default=0)
    panel.set_title(f"Median, 95 %, and 90th percentile (bar), n = {low} to {high} contacts")
    panel.set_ylabel(f"{key} latency [ms]")
    bottom, top = panel.get_ylim()
    panel.set_ylim(min(0.0, bottom), max(1.05 * top, 10.0))
    _speed_axis(panel, _speeds(result))


@style.styled
def curves(result: Mapping[str, Any]) -> Figure:
    """ROC of the bending level with the default theta, and F1 over theta.

    Args:
        result: The content of result.json.
    """
    figure = style.canvas(10.0, 4.4)
    roc, over = figure.subplots(1, 2)
    roc.plot([0, 100], [0, 100], color=style.MUTED, linewidth=1.0, linestyle=(0, (2, 2)))
    roc.annotate("chance", (60, 60), (63, 55), color=style.MUTED, rotation=38, fontsize=8)
    for name, found in result["roc"].items():
        _draw_curve(roc, over, result, name, found)
    theta = result["threshold"]
    over.axvline(theta, color=style.MUTED, linewidth=1.0, linestyle=(0, (4, 2)))
    over.annotate(f"default {theta:g}", (theta, 0.03), (4, 0), textcoords="offset points", va="top")
    over.set_xscale("logit", one_half="0.5")
    over.set_xlim(3e-6, 1 - 1e-5)
    over.minorticks_off()
    over.set_xticks([1e-5, 1e-3, 0.5, 1 - 1e-3], ["1e-5", "1e-3", "0.5", "0.999"])
    over.set(
        ylim=(0, 1.02),
        xlabel="theta, bending level that counts as contact [0 to 1, logit scale]",
        ylabel="F1 of contact, 0 to 1",
        title="F1 over theta, no hysteresis; rings: best on these data",
    )
    ticks = sum(row["ticks"] for row in result["profiles"].values())
    roc.set(
        xlim=(-2, 102),
        ylim=(-2, 102),
        xlabel="free time taken for contact [%]",
        ylabel="contact time found [%]",
        title=f"ROC over theta, all walls and speeds, n = {ticks:,} ticks",
    )
    roc.set_aspect("equal")
    if roc.get_legend_handles_labels()[0]:
        roc.legend(loc="lower right", fontsize=8, title=f"filled: default theta {theta:g}")
    return figure


def _draw_curve(
    roc: Axes, over: Axes, result: Mapping[str, Any], name: str, found: Mapping[str, Any]
) -> None:
    colour, marker, line = style.PROFILE_LOOKS[name]
    points = [p for p in found["curve"] if None not in p.values()]
    if not points:
        return
    area = result["profiles"][name]
    wrong = [100 * p["false_positive_rate"] for p in points]
    right = [100 * p["true_positive_rate"] for p in points]
    label = f"{name}: area {area['auc']:.3f}, of flex itself {area['auc_flex']:.3f}"
    roc.plot([100, *wrong, 0], [100, *right, 0], color=colour, linestyle=line, label=label)
    own = found["default"]
    at = (100 * own["false_positive_rate"], 100 * own["true_positive_rate"])
    roc.plot(*at, color=colour, marker=marker, markersize=6, linestyle="", zorder=4)
    over.plot([p["theta"] for p in points], [p["f1"] for p in points], color=colour, linestyle=line)
    best = found["best_f1"]
    over.plot(
        best["theta"], best["f1"], color=colour, marker="o", markersize=8, markerfacecolor="white"
    )


@style.styled
def trace(example: Trace) -> Figure:
    """One traverse: the wall with shapes of the antenna, flex, b, and contact against truth."""
    figure = style.canvas(10.0, 7.2)
    plan, flex, level, state = figure.subplots(4, 1, height_ratios=(2.0, 1.2, 1.2, 0.7))
    one, t = example.traverse, example.t
    _draw_plan(plan, one)
    plan.set_title(
        f"Wall {one.wall}, {one.profile} antenna, {one.speed:g} m/s, trial 0; "
        f"the base moves to the right along y = 0"
    )
    flex.plot(t, one.course.flex, color=style.INK, linewidth=1.3)
    flex.set_ylabel("flex [rad]")
    _draw_level(level, example)
    _draw_states(state, example)
    for panel in (flex, level):
        panel.set_xlim(t[0], t[-1])
        panel.tick_params(labelbottom=False)
        panel.fill_between(
            t,
            0,
            1,
            where=example.comparison.truth.tolist(),
            color=_TRUE,
            alpha=0.08,
            transform=panel.get_xaxis_transform(),
            linewidth=0,
            step="mid",
        )
    return figure


def _draw_level(panel: Axes, example: Trace) -> None:
    panel.plot(example.t, example.b, color=style.INK, linewidth=1.3)
    bounds = (
        (example.threshold, 2, "bottom", "contact from here"),
        (example.threshold - example.hysteresis, -2, "top", "free below"),
    )
    for bound, lift, side, name in bounds:
        panel.axhline(bound, color=_SENSED, linewidth=0.9, linestyle=(0, (4, 2)))
        panel.annotate(
            name,
            (0.0, bound),
            (4, lift),
            textcoords="offset points",
            va=side,
            fontsize=7,
            color=_SENSED,
        )
    panel.set(ylim=(-0.05, 1.05), ylabel="b, 0 to 1")


def _draw_states(panel: Axes, example: Trace) -> None:
    t, comparison = example.t, example.comparison
    for row, (states, colour) in enumerate(
        ((comparison.alarm, _SENSED), (comparison.truth, _TRUE))
    ):
        panel.fill_between(t, row + 0.1, row + 0.9, where=states.tolist(), color=colour, step="mid")
    panel.set(xlim=(t[0], t[-1]), ylim=(0, 2), xlabel="time [s]")
    panel.set_yticks([0.5, 1.5], ["sensed", "true"])
    panel.grid(visible=False, axis="y")


def _draw_plan(panel: Axes, one: Traverse) -> None:
    for line in one.outline:
        if one.wall == "boulders":
            panel.plot(*line.T, color=style.MUTED, marker="o", markersize=3, linestyle="")
        else:
            panel.plot(*line.T, color=style.MUTED, linewidth=2.2)
    joints = one.course.joints
    if len(joints):
        shown = joints[np.linspace(0, len(joints) - 1, _SHAPES).astype(int)]
        colour = style.PROFILE_LOOKS[one.profile][0]
        panel.add_collection(LineCollection(list(shown), colors=colour, linewidths=1.3))
        panel.plot(*shown[:, 0].T, color=style.INK, marker="o", markersize=3, linestyle="")
    panel.set_aspect("equal", adjustable="datalim")
    panel.set(xlabel="x [m]", ylabel="y [m]")
    panel.yaxis.set_major_locator(MultipleLocator(0.05))
    panel.margins(0.02)
