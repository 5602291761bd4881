"""Figure of `antennate gait`: the worth of the body wave's lead, and where the maneuvers go."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator

from antennate import figures as style
from antennate.types import Floats, Maneuver
from antennate_lab.gait.experiment import Walks
from antennate_lab.gait.physics import Walk
from antennate_lab.gait.result import GaitResult, UnknownNumbers


def figures(outcome: Walks) -> dict[str, Figure]:
    """The figures of a run."""
    result: GaitResult = outcome.result()
    drawn = {"gait": study(result, outcome.walks)}
    if result.unknown is not None:
        configured = result.maneuvers["forward"].body_lengths_per_cycle
        measured = result.measured_body_lengths_per_cycle
        drawn["unknown"] = unknown(result.unknown, configured, measured)
    return drawn


@style.styled
def study(result: GaitResult, walks: Mapping[str, Walk]) -> Figure:
    """The sweep over the lead of the body wave, and the maneuvers from above."""
    figure = style.canvas(style.WIDTH, 7.2)
    sweep, plan = figure.subplots(2, 1)
    _draw_sweep(sweep, result)
    _draw_plan(plan, result, walks)
    return figure


def _draw_sweep(panel: Axes, result: GaitResult) -> None:
    leads = [math.degrees(point.body_phase_rad) for point in result.phase_sweep]
    speeds = [point.speed_m_s for point in result.phase_sweep]
    colour = style.MANEUVER_COLOURS[Maneuver.FORWARD]
    panel.plot(leads, speeds, color=colour, marker="o", markersize=4, label="with the body wave")
    off = result.wave_off.speed_m_s
    panel.axhline(off, color=style.MUTED, linewidth=1.2, linestyle=(0, (4, 2)), label="legs alone")
    chosen = math.degrees(result.chosen_body_phase_rad) % 360.0
    panel.plot(
        chosen,
        result.maneuvers["forward"].speed_m_s,
        color=style.INK,
        linestyle="",
        marker="D",
        markersize=7,
        label=f"chosen lead, {chosen:.0f} deg",
        zorder=4,
    )
    panel.axhline(0.0, color=style.MUTED, linewidth=0.8)
    panel.set(
        xlim=(-5, 365),
        xlabel="lead of the body wave over the legs [deg]",
        ylabel="speed of FORWARD [m/s]",
        title=f"Speed at {result.frequency_hz:g} cycles a second",
    )
    top = max([*speeds, off])
    panel.set_ylim(min([0.0, *speeds]) - 0.05 * top, 1.35 * top)
    panel.xaxis.set_major_locator(MultipleLocator(60))
    panel.legend(loc="upper left", ncols=2)


def _draw_plan(panel: Axes, result: GaitResult, walks: Mapping[str, Walk]) -> None:
    for maneuver, colour in style.MANEUVER_COLOURS.items():
        name = maneuver.name.lower()
        if name not in walks:
            continue
        pace, points = result.maneuvers[name], walks[name].centre
        panel.plot(
            *points.T,
            color=colour,
            label=f"{style.MANEUVER_NAMES[maneuver]}: {pace.speed_m_s:z.2f} m/s, "
            f"{pace.yaw_deg_per_cycle:z.0f} deg a cycle".replace("-", "−"),
        )
        panel.plot(*points[-1], color=colour, marker="o", markersize=6)
    panel.plot(*next(iter(walks.values())).centre[0], color=style.INK, marker="s", markersize=6)
    panel.set_aspect("equal", adjustable="datalim")
    panel.margins(0.08)
    panel.set(
        xlabel="x [m]", ylabel="y [m]", title="Centre of the robot from above, square at the start"
    )
    panel.legend(loc="upper center", bbox_to_anchor=(0.5, -0.2), fontsize=8)


@style.styled
def unknown(numbers: UnknownNumbers, configured: float, measured: float | None) -> Figure:
    """FORWARD over all draws of the unknown numbers, and over each of them alone.

    Args:
        numbers: What is drawn.
        configured: Body lengths a cycle of the run as configured.
        measured: Body lengths a cycle of a real robot; None if nobody measured them.
    """
    heights = 2.8, 0.36 * len(numbers.parameters) + 1.2
    figure = style.canvas(style.WIDTH, sum(heights))
    draws, alone = figure.subplots(2, 1, height_ratios=heights)
    alone.sharex(draws)
    _draw_draws(draws, numbers)
    _draw_alone(alone, numbers)
    rows = np.arange(len(numbers.parameters), dtype=float)
    title = "Each alone;\ngrey is the run as configured"
    _mark(alone, configured, rows, color=style.MUTED, linewidth=1.5)
    if measured is not None:
        draws.axvline(measured, color=style.SERIES[4], linestyle=(0, (4, 2)), label="measured")
        _mark(alone, measured, rows, color=style.SERIES[4], linewidth=2.0)
        title += ", red what was measured"
    alone.set_title(title)
    for panel in (draws, alone):
        panel.set_xlabel("body lengths a cycle")
    draws.legend(loc="upper right", frameon=True, facecolor="white", edgecolor="none")
    return figure


def _mark(panel: Axes, value: float, rows: Floats, **look: Any) -> None:
    """A value at each row, in pieces that leave room for the names between the rows."""
    panel.vlines(np.full(len(rows), value), rows - 0.35, rows + 0.1, zorder=1, **look)


def _draw_draws(panel: Axes, numbers: UnknownNumbers) -> None:
    panel.hist(numbers.body_lengths_per_cycle, bins=20, color=style.SERIES[5], label="draws")
    low, high = numbers.interval95
    panel.axvspan(low, high, color=style.FAINT, alpha=0.5, zorder=0, label="95 % of them")
    panel.set_ylim(0, 1.5 * panel.get_ylim()[1])
    panel.set(ylabel="draws", title=f"{numbers.draws} draws of all unknown numbers")


def _draw_alone(panel: Axes, numbers: UnknownNumbers) -> None:
    order = sorted(numbers.parameters.items(), key=lambda item: abs(item[1].change))
    for i, (name, each) in enumerate(order):
        low, high = each.body_lengths_per_cycle
        panel.plot([low, high], [i, i], color=style.INK, linewidth=2.2, zorder=2)
        panel.plot(low, i, "o", color=style.SERIES[0], zorder=3, label="" if i else "lower end")
        panel.plot(high, i, "s", color=style.SERIES[1], zorder=3, label="" if i else "upper end")
        ends = " to ".join(f"{end:g}" for end in each.range)
        panel.annotate(
            f"{name}: {ends}",
            (0.0, i),
            xytext=(4, 6),
            xycoords=("axes fraction", "data"),
            textcoords="offset points",
            fontsize=8,
        )
    panel.set_yticks([])
    panel.grid(visible=False)
    panel.set_ylim(-0.6, len(order) + 0.6)
    panel.legend(loc="upper right", ncols=2, frameon=True, facecolor="white", edgecolor="none")
