"""Figures of `bench touch`: how well contact is sensed, the ROC, and one traverse in detail."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator

from antennate import figures as style
from antennate.experiments.touch.experiment import F1, ONSET, RELEASE, TouchOutcome
from antennate.experiments.touch.physics import Traverse
from antennate.experiments.touch.sensing import Comparison
from antennate.params.control import RuleParams

_TRUE, _SENSED = style.SERIES[5], style.INK
"""Colours that no profile has."""
_BAR = {"marker": "_", "markersize": 11, "markeredgewidth": 1.8, "capsize": 0}
_SHAPES = 14
"""Shapes of the antenna drawn along a wall."""


def figures(outcome: TouchOutcome) -> dict[str, Figure]:
    """All figures of a run; without an example, the first two alone."""
    result, example = outcome.result(), outcome.example()
    drawn = {"touch": measures(result), "touch_roc": curves(result)}
    return drawn if example is None else {**drawn, "touch_trace": trace(*example)}


@style.styled
def measures(result: Mapping[str, Any]) -> Figure:
    """F1 by speed and by wall, and both latencies by speed, one colour a profile."""
    figure = style.canvas(style.WIDTH, 11.5)
    by_speed, by_wall, *latencies = figure.subplots(4, 1)
    speeds, walls = result["by_speed"], result["by_wall"]
    for panel, rows, part in ((by_speed, speeds, "speed_m_s"), (by_wall, walls, "wall")):
        _draw(panel, rows, part, rows, (F1.name, "f1_95"), trials=result["trials"])
        low, high = (end(row["traverses"] for row in rows) for end in (min, max))
        over = "walls" if part == "speed_m_s" else "speeds"
        count = f"{low}" if low == high else f"{low} to {high}"
        note = style.interval_note(result["trials"])
        panel.set_title(f"All {over}, n = {count} traverses a point,\n{note}")
        panel.set(ylim=(-0.03, 1.02), ylabel=f"{F1.label} of contact, 0 to 1")
    for panel, measure in zip(latencies, (ONSET, RELEASE), strict=True):
        key = measure.name.partition(".")[0]
        latencies_by_speed = [row[key] for row in speeds]
        median = ("median_ms", "median_95_ms")
        _draw(panel, speeds, "speed_m_s", latencies_by_speed, median, trials=result["trials"])
        _draw(panel, speeds, "speed_m_s", latencies_by_speed, ("p90_ms", ""), **_BAR)
        low, high = (end(row["n"] for row in latencies_by_speed) for end in (min, max))
        note = style.interval_note(result["trials"])
        panel.set_title(f"Median, {note}, 90th percentile (bar),\nn = {low} to {high} contacts")
        panel.set_ylabel(measure.title)
        bottom, top = panel.get_ylim()
        panel.set_ylim(min(0.0, bottom), max(1.05 * top, 10.0))
    figure.legend(*by_speed.get_legend_handles_labels(), loc="outside upper center", ncols=3)
    return figure


def _draw(
    panel: Axes,
    cells: Sequence[Mapping[str, Any]],
    part: str,
    rows: Sequence[Mapping[str, Any]],
    keys: style.Keys,
    trials: int = 0,
    **look: Any,
) -> None:
    """A measure of what was found in each cell, over speeds or walls, the profiles side by side."""
    values = list(dict.fromkeys(cell[part] for cell in cells))
    values = sorted(values) if part == "speed_m_s" else values
    profiles = list(dict.fromkeys(cell["profile"] for cell in cells))
    for i, name in enumerate(profiles):
        colour, own, _ = style.PROFILE_LOOKS[name]
        aside = 0.6 * (i - (len(profiles) - 1) / 2) / max(len(profiles), 3)
        mine = [k for k, cell in enumerate(cells) if cell["profile"] == name]
        x = [values.index(cells[k][part]) + aside for k in mine]
        own_look = look or {"marker": own, "label": name}
        drawn = [rows[k] for k in mine]
        style.intervals(panel, x, drawn, keys, trials, color=colour, **own_look)
    style.categories(panel, [f"{v:g}" if isinstance(v, float) else v for v in values])
    panel.set_xlabel("speed of the traverse [m/s]" if part == "speed_m_s" else "wall")


@style.styled
def curves(result: Mapping[str, Any]) -> Figure:
    """ROC of the bending level with the default theta, and F1 over theta."""
    figure = style.canvas(style.WIDTH, 8.4)
    roc, over = figure.subplots(2, 1, height_ratios=(1.25, 1))
    roc.plot([0, 100], [0, 100], color=style.MUTED, linewidth=1.0, linestyle=(0, (2, 2)))
    roc.annotate("chance", (60, 60), (63, 55), color=style.MUTED, rotation=38, fontsize=8)
    for name, curve in result["roc"].items():
        _draw_curve(roc, over, result, name, curve)
    theta = result["threshold"]
    over.axvline(theta, color=style.MUTED, linewidth=1.0, linestyle=(0, (4, 2)))
    over.annotate(f"default {theta:g}", (theta, 0.03), (4, 0), textcoords="offset points")
    over.set_xscale("logit", one_half="0.5")
    over.set_xlim(3e-6, 1 - 1e-5)
    over.minorticks_off()
    over.set_xticks([1e-5, 1e-3, 0.5, 1 - 1e-3], ["1e-5", "1e-3", "0.5", "0.999"])
    over.set(
        ylim=(0, 1.02),
        xlabel="theta, bending level that counts as contact \n[0 to 1, logit scale]",
        ylabel="F1 of contact, 0 to 1",
        title="F1 over theta, no hysteresis;\nrings: best on these data",
    )
    ticks = sum(row["ticks"] for row in result["profiles"].values())
    roc.set(
        xlim=(-2, 102),
        ylim=(-2, 102),
        xlabel="free time taken for contact [%]",
        ylabel="contact time found [%]",
        title=f"ROC over theta, all walls and speeds,\nn = {ticks:,} ticks",
    )
    roc.set_aspect("equal")
    if roc.get_legend_handles_labels()[0]:
        roc.legend(loc="lower right", fontsize=8, title=f"filled: default theta {theta:g}")
    return figure


def _draw_curve(
    roc: Axes, over: Axes, result: Mapping[str, Any], name: str, curve: Mapping[str, Any]
) -> None:
    colour, marker, line = style.PROFILE_LOOKS[name]
    points = [p for p in curve["curve"] if None not in p.values()]
    if not points:
        return
    area = result["profiles"][name]
    wrong = [100 * p["false_positive_rate"] for p in points]
    right = [100 * p["true_positive_rate"] for p in points]
    label = f"{name}: area {area['auc']:.3f}, of flex itself {area['auc_flex']:.3f}"
    roc.plot([100, *wrong, 0], [100, *right, 0], color=colour, linestyle=line, label=label)
    own = curve["default"]
    at = (100 * own["false_positive_rate"], 100 * own["true_positive_rate"])
    roc.plot(*at, color=colour, marker=marker, markersize=6, linestyle="", zorder=4)
    over.plot([p["theta"] for p in points], [p["f1"] for p in points], color=colour, linestyle=line)
    best = curve["best_f1"]
    over.plot(
        best["theta"], best["f1"], color=colour, marker="o", markersize=8, markerfacecolor="white"
    )


@style.styled
def trace(traverse: Traverse, sensed: Comparison) -> Figure:
    """One traverse: the wall with shapes of the antenna, flex, b, and contact against truth."""
    figure = style.canvas(style.WIDTH, 7.2)
    plan, flex, level, state = figure.subplots(4, 1, height_ratios=(2.0, 1.2, 1.2, 0.7))
    config = traverse.plan.config
    t = np.arange(len(traverse.flex)) / config.antenna.sensor.rate
    _draw_plan(plan, traverse)
    flex.plot(t, traverse.flex, color=style.INK, linewidth=1.3)
    flex.set_ylabel("flex [rad]")
    level.plot(t, 1.0 / (1.0 + np.exp(-sensed.level)), color=style.INK, linewidth=1.3)
    _draw_bounds(level, config.rule)
    for row, (states, colour) in enumerate(((sensed.alarm, _SENSED), (sensed.truth, _TRUE))):
        state.fill_between(t, row + 0.1, row + 0.9, where=states.tolist(), color=colour, step="mid")
    state.set(xlim=(t[0], t[-1]), ylim=(0, 2), xlabel="time [s]")
    state.set_yticks([0.5, 1.5], ["sensed", "true"])
    state.grid(visible=False, axis="y")
    for panel in (flex, level):
        panel.set_xlim(t[0], t[-1])
        panel.tick_params(labelbottom=False)
        panel.fill_between(
            *(t, 0, 1),
            where=sensed.truth.tolist(),
            color=_TRUE,
            alpha=0.15,
            transform=panel.get_xaxis_transform(),
            linewidth=0,
            step="mid",
        )
    return figure


def _draw_bounds(panel: Axes, rule: RuleParams) -> None:
    for bound, lift, side, name in (
        (rule.threshold, 2, "bottom", "contact"),
        (rule.threshold - rule.hysteresis, -2, "top", "free"),
    ):
        panel.axhline(bound, color=_SENSED, linewidth=0.9, linestyle=(0, (4, 2)))
        panel.annotate(
            *(name, (0.0, bound), (4, lift)),
            textcoords="offset points",
            va=side,
            fontsize=8,
            color=_SENSED,
        )
    panel.set(ylim=(-0.05, 1.05), ylabel="b, 0 to 1")


def _draw_plan(panel: Axes, traverse: Traverse) -> None:
    plan = traverse.plan
    for line in plan.outline():
        if plan.wall == "boulders":
            panel.plot(*line.T, color=style.MUTED, marker="o", markersize=3, linestyle="")
        else:
            panel.plot(*line.T, color=style.MUTED, linewidth=2.2)
    shown = traverse.joints[np.linspace(0, len(traverse.joints) - 1, _SHAPES).astype(int)]
    colour = style.PROFILE_LOOKS[plan.profile][0]
    panel.add_collection(LineCollection(list(shown), colors=colour, linewidths=1.3))
    panel.plot(*shown[:, 0].T, color=style.INK, marker="o", markersize=3, linestyle="")
    panel.set_aspect("equal", adjustable="datalim")
    panel.set_title(
        f"Wall {plan.wall}, {plan.profile} antenna, {plan.speed:g} m/s, trial 0;\n"
        f"the base moves to the right along y = 0"
    )
    panel.set(xlabel="x [m]", ylabel="y [m]")
    panel.yaxis.set_major_locator(MultipleLocator(0.05))
    panel.margins(0.02)
