"""Figure of `antennate gait`: the worth of the body wave's lead, and where the maneuvers go."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator

from antennate import figures as style
from antennate.experiments.gait.experiment import GaitOutcome
from antennate.experiments.gait.physics import Walk
from antennate.types import Maneuver


def figures(outcome: GaitOutcome) -> dict[str, Figure]:
    """The figures of a run."""
    result = outcome.result()
    drawn = {"gait": study(result, outcome.maneuvers)}
    return drawn if result["unknown"] is None else drawn | {"unknown": unknown(result)}


@style.styled
def study(result: Mapping[str, Any], walks: Mapping[str, Walk]) -> Figure:
    """The sweep over the lead of the body wave, and the maneuvers from above."""
    figure = style.canvas(style.WIDTH, 7.2)
    sweep, plan = figure.subplots(2, 1)
    _draw_sweep(sweep, result)
    _draw_plan(plan, result, walks)
    return figure


def _draw_sweep(panel: Axes, result: Mapping[str, Any]) -> None:
    points = result["phase_sweep"]
    leads = [math.degrees(point["body_phase_rad"]) for point in points]
    speeds = [point["speed_m_s"] for point in points]
    colour = style.MANEUVER_COLOURS[Maneuver.FORWARD]
    panel.plot(leads, speeds, color=colour, marker="o", markersize=4, label="with the body wave")
    off = result["wave_off"]["speed_m_s"]
    panel.axhline(off, color=style.MUTED, linewidth=1.2, linestyle=(0, (4, 2)), label="legs alone")
    chosen = math.degrees(result["chosen_body_phase_rad"]) % 360.0
    panel.plot(
        chosen,
        result["maneuvers"]["forward"]["speed_m_s"],
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
        title=f"Speed at {result['frequency_hz']:g} cycles a second",
    )
    top = max([*speeds, off])
    panel.set_ylim(min([0.0, *speeds]) - 0.05 * top, 1.35 * top)
    panel.xaxis.set_major_locator(MultipleLocator(60))
    panel.legend(loc="upper left", ncols=2)


def _draw_plan(panel: Axes, result: Mapping[str, Any], walks: Mapping[str, Walk]) -> None:
    for maneuver, colour in style.MANEUVER_COLOURS.items():
        name = maneuver.name.lower()
        if name not in walks:
            continue
        row, points = result["maneuvers"][name], walks[name].centre
        panel.plot(
            *points.T,
            color=colour,
            label=f"{style.MANEUVER_NAMES[maneuver]}: {row['speed_m_s']:z.2f} m/s, "
            f"{row['yaw_deg_per_cycle']:z.0f} deg a cycle".replace("-", "−"),
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
def unknown(result: Mapping[str, Any]) -> Figure:
    """FORWARD over all draws of the unknown numbers, and over each of them alone."""
    heights = 2.8, 0.36 * len(result["unknown"]["parameters"]) + 1.2
    figure = style.canvas(style.WIDTH, sum(heights))
    draws, alone = figure.subplots(2, 1, height_ratios=heights)
    alone.sharex(draws)
    _draw_draws(draws, result)
    _draw_alone(alone, result)
    measured = result["measured_body_lengths_per_cycle"]
    for panel in (draws, alone):
        if measured is not None:
            panel.axvline(measured, color=style.SERIES[4], linestyle=(0, (4, 2)), label="measured")
        panel.set_xlabel("body lengths a cycle")
    draws.legend(loc="upper right", frameon=True, facecolor="white", edgecolor="none")
    return figure


def _draw_draws(panel: Axes, result: Mapping[str, Any]) -> None:
    unknown_numbers = result["unknown"]
    panel.hist(
        unknown_numbers["body_lengths_per_cycle"], bins=20, color=style.SERIES[5], label="draws"
    )
    low, high = unknown_numbers["interval95"]
    panel.axvspan(low, high, color=style.FAINT, alpha=0.5, zorder=0, label="95 % of them")
    panel.set_ylim(0, 1.5 * panel.get_ylim()[1])
    panel.set(ylabel="draws", title=f"{unknown_numbers['draws']} draws of all unknown numbers")


def _draw_alone(panel: Axes, result: Mapping[str, Any]) -> None:
    rows = result["unknown"]["parameters"]
    order = sorted(rows, key=lambda name: abs(rows[name]["change"]))
    for i, name in enumerate(order):
        low, high = rows[name]["body_lengths_per_cycle"]
        panel.plot([low, high], [i, i], color=style.INK, linewidth=2.2, zorder=2)
        panel.plot(low, i, "o", color=style.SERIES[0], zorder=3, label="" if i else "lower end")
        panel.plot(high, i, "s", color=style.SERIES[1], zorder=3, label="" if i else "upper end")
        ends = " to ".join(f"{end:g}" for end in rows[name]["range"])
        panel.annotate(
            f"{name}: {ends}",
            (0.0, i),
            xytext=(4, 6),
            xycoords=("axes fraction", "data"),
            textcoords="offset points",
            fontsize=8,
            bbox={"boxstyle": "square,pad=0.05", "facecolor": "white", "edgecolor": "none"},
        )
    forward = result["maneuvers"]["forward"]["body_lengths_per_cycle"]
    panel.axvline(forward, color=style.MUTED, linewidth=1.0, zorder=1)
    panel.set_yticks([])
    panel.set_ylim(-0.6, len(order) + 0.6)
    panel.set_title("Each alone;\nthe grey line is the run as configured")
    panel.legend(loc="upper right", ncols=2, frameon=True, facecolor="white", edgecolor="none")
