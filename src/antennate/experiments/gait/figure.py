"""Figure of `antennate gait`: the worth of the body wave's lead, and where the maneuvers go."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator

from antennate import figures as style
from antennate.experiments.gait.pace import Walk
from antennate.experiments.gait.run import GaitOutcome
from antennate.types import Maneuver


def figures(outcome: GaitOutcome) -> dict[str, Figure]:
    """The figure of a run."""
    return {"gait": study(outcome.result(), outcome.maneuvers)}


@style.styled
def study(result: Mapping[str, Any], walks: Mapping[str, Walk]) -> Figure:
    """The sweep over the lead of the body wave, and the maneuvers from above.

    Args:
        result: The content of result.json.
        walks: The four maneuvers by name.
    """
    figure = style.canvas(10.0, 4.2)
    sweep, plan = figure.subplots(1, 2, width_ratios=(1.15, 1))
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
    panel.margins(0.08, 0.35)
    panel.set(
        xlabel="x [m]", ylabel="y [m]", title="Centre of the robot from above, square at the start"
    )
    panel.legend(loc="upper left", fontsize=8)
