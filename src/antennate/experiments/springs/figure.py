"""Figure of `antenna springs`: torque over angle, and stiffness over coils of sets to wind."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from antennate import figures as style
from antennate.experiments.springs.experiment import SpringsOutcome

_SHOWN = 5
"""Sets of springs drawn."""


@style.styled
def figures(outcome: SpringsOutcome) -> dict[str, Figure]:
    """Torque of each spring up to its yield, and the errors of what could be wound instead."""
    figure, result = style.canvas(style.WIDTH, 7.4), outcome.result()
    torque, wound = figure.subplots(2, 1)
    _draw_torque(torque, result)
    _draw_windings(wound, result)
    return {"springs": figure}


def _draw_torque(panel: Axes, result: Mapping[str, Any]) -> None:
    rows = result["springs"]
    end = 1.15 * min(360.0, max(row["yield_angle_deg"] for row in rows))
    for row, colour in zip(rows, style.series(len(rows)), strict=True):
        k, limit = row["stiffness_n_mm_per_deg"], row["yield_angle_deg"]
        angle = np.array([0.0, min(limit, end)])
        panel.plot(angle, k * angle, color=colour, label=f"{row['active_coils']:g} coils, {k:.3f}")
        if limit <= end:
            panel.plot(limit, k * limit, color=colour, marker="x", markersize=7)
    panel.set(
        xlabel="angle [deg]",
        ylabel="torque [N·mm]",
        title=f"{result['wire']}, wire {result['wire_mm']:g} mm, \ncoil {result['coil_mm']:g} mm; "
        "× yields",
    )
    panel.set_xlim(0, end)
    panel.set_ylim(0)
    panel.legend(title="stiffness [N·mm/deg]", loc="lower right")


def _draw_windings(panel: Axes, result: Mapping[str, Any]) -> None:
    wanted = np.array(result["wanted_n_mm_per_deg"])
    shown = result["windings"][:_SHOWN]
    places = np.arange(len(wanted))
    for i, (row, colour) in enumerate(zip(shown, style.series(len(shown)), strict=True)):
        error = 100 * (np.array(row["stiffness_n_mm_per_deg"]) / wanted - 1)
        panel.plot(
            places + 0.08 * (i - (len(shown) - 1) / 2),
            error,
            color=colour,
            marker="o",
            linestyle="",
            label=f"wire {row['wire_mm']:.2f}, mandrel {row['mandrel_mm']:.1f} mm",
        )
    panel.axhline(0.0, color=style.MUTED, linewidth=0.8)
    panel.set_xticks(places, [f"{k:g}" for k in wanted])
    panel.set(
        xlabel="wanted stiffness [N·mm/deg]",
        ylabel="error of what can be wound [%]",
        title="Nearest sets from stock wire",
    )
    panel.set_xlim(-0.5, len(wanted) - 0.5)
    low, high = panel.get_ylim()
    panel.set_ylim(low, high + 0.75 * (high - low))
    if shown:
        panel.legend(loc="upper left", fontsize=8)
