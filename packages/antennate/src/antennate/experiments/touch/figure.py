"""Figures of `bench touch`: how well contact is sensed, the ROC, and one traverse in detail."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator

from antennate import figures as style
from antennate.experiments.touch.experiment import F1, TouchOutcome
from antennate.experiments.touch.physics import Traverse
from antennate.experiments.touch.result import Latency, ProfileMeasures, Roc, TouchResult
from antennate.experiments.touch.sensing import Comparison
from antennate.params.control import RuleParams
from antennate.studies.columns import Ends, shown

_TRUE, _SENSED = style.SERIES[5], style.INK
"""Colours that no profile has."""
_BAR = {"marker": "_", "markersize": 11, "markeredgewidth": 1.8, "capsize": 0}
_SHAPES = 14
"""Shapes of the antenna drawn along a wall."""
_Cells = Sequence[tuple[float | str, ProfileMeasures]]
"""Measures, each with the speed or the wall that it is of."""
_Known = tuple[float | None, Ends | None]
"""A number and its interval."""
_KEYS = ("value", "ends")


def figures(outcome: TouchOutcome) -> dict[str, Figure]:
    """All figures of a run; without an example, the first two alone."""
    result, example = outcome.result(), outcome.example()
    drawn = {"touch": measures(result), "touch_roc": curves(result)}
    return drawn if example is None else {**drawn, "touch_trace": trace(*example)}


@style.styled
def measures(result: TouchResult) -> Figure:
    """F1 by speed and by wall, and both latencies by speed, one colour a profile."""
    figure, note = style.canvas(style.WIDTH, 11.5), style.interval_note(result.trials)
    by_speed, by_wall, onset, release = figure.subplots(4, 1)
    speeds = sorted(((row.speed_m_s, row) for row in result.by_speed), key=lambda cell: cell[0])
    walls = [(row.wall, row) for row in result.by_wall]
    for panel, cells, over in ((by_speed, speeds, "walls"), (by_wall, walls, "speeds")):
        _draw(panel, cells, lambda row: (row.f1, row.f1_95), trials=result.trials)
        low, high = (end(row.traverses for _, row in cells) for end in (min, max))
        count = f"{low}" if low == high else f"{low} to {high}"
        panel.set_title(f"All {over}, n = {count} traverses a point,\n{note}")
        panel.set(ylim=(-0.03, 1.02), ylabel=f"{F1.label} of contact, 0 to 1")
    _draw_latency(onset, speeds, lambda row: row.onset, result.trials)
    _draw_latency(release, speeds, lambda row: row.release, result.trials)
    onset.set_ylabel("onset latency [ms]")
    release.set_ylabel("release latency [ms]")
    figure.legend(*by_speed.get_legend_handles_labels(), loc="outside upper center", ncols=3)
    return figure


def _draw_latency(
    panel: Axes, cells: _Cells, latency: Callable[[ProfileMeasures], Latency], trials: int
) -> None:
    """A latency in each cell: its median and its 90th percentile."""
    found = [latency(row) for _, row in cells]

    def median(row: ProfileMeasures) -> _Known:
        return latency(row).median_ms, latency(row).median_95_ms

    _draw(panel, cells, median, trials)
    _draw(panel, cells, lambda row: (latency(row).p90_ms, None), **_BAR)
    low, high = (end(each.n for each in found) for end in (min, max))
    note = style.interval_note(trials)
    panel.set_title(f"Median, {note}, 90th percentile (bar),\nn = {low} to {high} contacts")
    bottom, top = panel.get_ylim()
    panel.set_ylim(min(0.0, bottom), max(1.05 * top, 10.0))


def _draw(
    panel: Axes,
    cells: _Cells,
    measure: Callable[[ProfileMeasures], _Known],
    trials: int = 0,
    **look: Any,
) -> None:
    """A measure of each cell, over speeds or walls, the profiles side by side."""
    values = list(dict.fromkeys(at for at, _ in cells))
    profiles = list(dict.fromkeys(row.profile for _, row in cells))
    for i, name in enumerate(profiles):
        colour, own, _ = style.PROFILE_LOOKS[name]
        aside = 0.6 * (i - (len(profiles) - 1) / 2) / max(len(profiles), 3)
        mine = [(at, row) for at, row in cells if row.profile == name]
        x = [values.index(at) + aside for at, _ in mine]
        own_look = look or {"marker": own, "label": name}
        drawn = [dict(zip(_KEYS, measure(row), strict=True)) for _, row in mine]
        style.intervals(panel, x, drawn, _KEYS, trials, color=colour, **own_look)
    style.categories(panel, [v if isinstance(v, str) else f"{v:g}" for v in values])
    panel.set_xlabel("wall" if isinstance(values[0], str) else "speed of the traverse [m/s]")


@style.styled
def curves(result: TouchResult) -> Figure:
    """ROC of the bending level with the default theta, and F1 over theta."""
    figure = style.canvas(style.WIDTH, 8.4)
    roc, over = figure.subplots(2, 1, height_ratios=(1.25, 1))
    roc.plot([0, 100], [0, 100], color=style.MUTED, linewidth=1.0, linestyle=(0, (2, 2)))
    roc.annotate("chance", (60, 60), (63, 55), color=style.MUTED, rotation=38, fontsize=8)
    for name, profile in result.profiles.items():
        _draw_curve(roc, over, profile, result.roc[name])
    theta = result.threshold
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
    ticks = sum(profile.ticks for profile in result.profiles.values())
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


def _draw_curve(roc: Axes, over: Axes, profile: ProfileMeasures, found: Roc) -> None:
    name, curve = profile.profile, found.curve
    colour, marker, line = style.PROFILE_LOOKS[name]
    points = [(p.false_positive_rate, p.true_positive_rate) for p in (*curve, found.default)]
    *rates, own = 100 * np.array(points, float)
    if np.isnan(own).any():  # all of the time is contact, or none
        return
    area, of_flex = shown(profile.auc, ".3f"), shown(profile.auc_flex, ".3f")
    label = f"{name}: area {area}, of flex itself {of_flex}"
    ends = np.array([(100.0, 100.0), *rates, (0.0, 0.0)])
    roc.plot(*ends.T, color=colour, linestyle=line, label=label)
    roc.plot(*own, color=colour, marker=marker, markersize=6, linestyle="", zorder=4)
    *scores, best = np.array([(p.theta, p.f1) for p in (*curve, found.best_f1)], float)
    over.plot(*np.transpose(scores), color=colour, linestyle=line)
    over.plot(*best, color=colour, marker="o", markersize=8, markerfacecolor="white")


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
            t,
            y1=0,
            y2=1,
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
            name,
            xy=(0.0, bound),
            xytext=(4, lift),
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
