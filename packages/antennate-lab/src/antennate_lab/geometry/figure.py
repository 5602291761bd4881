"""Figures of `antennate geometry`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator

from antennate import figures as style
from antennate.studies.columns import Frame, column_of
from antennate.studies.pooling import frame
from antennate_lab.geometry.experiment import GeometryOutcome
from antennate_lab.geometry.result import (
    Agreement,
    BestLead,
    Gait,
    GeometryResult,
    NamedGait,
    Turns,
)
from antennate_lab.geometry.torus import Torus
from antennate_lab.swimmers import swimmer_figure
from geometric_locomotion.chain import purcell
from geometric_locomotion.maps import curvature_map
from geometric_locomotion.twist import TwistMap

_DASHED = (0, (4, 2))


def figures(outcome: GeometryOutcome) -> dict[str, Figure]:
    """The figures of a run, and the swimmer; torus and twist map only where legs roll."""
    result: GeometryResult = outcome.result()
    drawn = {
        "agreement": agreement(
            frame(row for row in outcome.rows if row.part == "random"), result.agreement
        ),
        "leads": leads(result.leads),
        "front": front(result.front, result.named),
    }
    if outcome.torus is not None:
        drawn["torus"] = torus(outcome.torus, outcome.config.gait.body_phase)
    if outcome.twists is not None:
        drawn["twists"] = twists(outcome.twists, result.turns)
    drawn["swimmer"] = swimmer_figure(curvature_map(purcell()))
    return drawn


@style.styled
def agreement(rows: Frame, found: Agreement) -> Figure:
    """Speed and yaw by the model against those by the engine."""
    figure = style.canvas(style.WIDTH, 8.2)
    speed, yaw = figure.subplots(2, 1)
    _draw_pair(speed, rows.model_speed_m_s, rows.speed_m_s, "speed [m/s]", found.speed_r.value)
    speed.axvline(
        found.rival_speed_m_s,
        color=style.SERIES[1],
        linestyle=_DASHED,
        label=f"rival, {found.rival_speed_m_s:.3f} m/s for all",
    )
    speed.legend(loc="upper left")
    turned = rows.model_yaw_deg_per_cycle, rows.yaw_deg_per_cycle
    _draw_pair(yaw, *turned, "yaw [deg a cycle]", found.yaw_r.value)
    return figure


def _draw_pair(panel: Axes, model: Any, engine: Any, what: str, r: float) -> None:
    ends = [min(model.min(), engine.min()), max(model.max(), engine.max())]
    panel.plot(ends, ends, color=style.MUTED, linewidth=1.0, label="equal")
    panel.plot(model, engine, "o", color=style.SERIES[0], markersize=4)
    panel.set_aspect("equal", adjustable="datalim")
    panel.set(
        xlabel=f"{what}, model",
        ylabel=f"{what}, engine",
        title=f"{len(model)} random gaits, correlation {r:.3f}",
    )


@style.styled
def leads(found: Sequence[BestLead]) -> Figure:
    """The best lead over wave numbers."""
    figure = style.canvas(style.WIDTH, 3.8)
    panel = figure.subplots()
    number = [lead.wave_number for lead in found]
    looks = {
        "law_deg": (style.MUTED, "", _DASHED),
        "model_deg": (style.SERIES[0], "o", "solid"),
        "engine_deg": (style.SERIES[1], "s", ""),
    }
    for name, (colour, marker, line) in looks.items():
        column = column_of(BestLead, name)
        degrees = np.array([column.value(lead) for lead in found], float)
        if np.isfinite(degrees).all():  # lifting legs know no law
            angles = np.degrees(np.unwrap(np.radians(degrees)))
            mark = marker or ("_" if len(number) == 1 else "")  # one number makes no line
            look = {"color": colour, "marker": mark, "linestyle": line}
            panel.plot(number, angles, label=column.label, **look)
    panel.set(xlabel="wave number", ylabel="best lead [deg]", title="Lead that walks fastest")
    panel.legend()
    return figure


@style.styled
def front(gaits: Sequence[Gait], named: Sequence[NamedGait]) -> Figure:
    """Speed and cost of transport of the gaits that may be fast or cheap."""
    figure = style.canvas(style.WIDTH, 5.0)
    panel = figure.subplots()
    speed, number = [gait.speed_m_s for gait in gaits], [gait.wave_number for gait in gaits]
    cost, own = (
        np.array([gait.cost_of_transport for gait in some], float) for some in (gaits, named)
    )
    dots = panel.scatter(speed, cost, c=number, cmap="viridis", s=18, label="largest amplitude")
    for gait, height, colour, marker in zip(
        named, own, ("#D55E00", "#CC79A7", "#222222", "#E69F00") * 9, "*D^vPX", strict=False
    ):
        panel.plot(
            gait.speed_m_s,
            height,
            color=colour,
            marker=marker,
            markersize=11 if marker == "*" else 7,
            linestyle="",
            label=gait.name,
            markeredgecolor="white",
        )
    panel.axhline(own[0], color=style.MUTED, linewidth=0.8)
    panel.axvline(named[0].speed_m_s, color=style.MUTED, linewidth=0.8)
    panel.set(
        xlabel=column_of(Gait, "speed_m_s").title,
        ylabel=column_of(Gait, "cost_of_transport").title,
        title="Engine; right and low is good",
    )
    low, high = np.nanmin([*cost, *own]), np.nanmax([np.nanpercentile(cost, 75), *own])
    panel.set_ylim(0.9 * low, 1.25 * high)
    waves = column_of(Gait, "wave_number").title
    figure.colorbar(dots, ax=panel, label=waves, location="bottom", shrink=0.7)
    figure.legend(*panel.get_legend_handles_labels(), loc="outside upper left", ncols=2)
    return figure


@style.styled
def torus(motion: Torus, lead: float) -> Figure:
    """Curvature over body and leg phase, with the loops of two leads, and steps over the lead."""
    figure = style.canvas(style.WIDTH, 7.4)
    panel, below = figure.subplots(2, 1, height_ratios=(4.4, 2.4))
    largest = 1e3 * float(abs(motion.curvature).max())
    image = panel.pcolormesh(
        np.degrees(motion.phase),
        np.degrees(motion.phase),
        1e3 * motion.curvature.T,
        cmap="RdBu_r",
        vmin=-largest,
        vmax=largest,
        shading="nearest",
    )
    best = float(motion.phase[motion.steps.argmax()])
    loops = {"configured lead": (lead, "solid"), "best lead": (best, (0, (2, 2)))}
    for name, (angle, line) in loops.items():
        body = np.linspace(0.0, 360.0, 721)
        leg = (body + math.degrees(angle)) % 360.0
        leg[1:][abs(np.diff(leg)) > 180.0] = math.nan
        label = f"{name}, {math.degrees(angle) % 360.0:.0f} deg"
        panel.plot(body, leg, color=style.INK, linestyle=line, label=label)
    panel.set(
        xlim=(0, 360),
        ylim=(0, 360),
        xlabel="body phase [deg]",
        ylabel="leg phase [deg]",
        title="Curvature of the forward motion [mm/rad²]",
    )
    panel.set_aspect("equal")
    for axis in (panel.xaxis, panel.yaxis):
        axis.set_major_locator(MultipleLocator(90))
    figure.colorbar(image, ax=panel)
    panel.legend(loc="lower center", bbox_to_anchor=(0.5, 1.1), ncols=2, fontsize=8)
    below.plot(np.degrees(motion.phase), 1e3 * motion.steps, color=style.SERIES[0], marker="o")
    below.axhline(0.0, color=style.MUTED, linewidth=0.8)
    below.xaxis.set_major_locator(MultipleLocator(90))
    below.set(xlabel="lead [deg]", ylabel="step a cycle [mm]", title="Step along each loop")
    return figure


@style.styled
def twists(table: TwistMap, turns: Turns | None) -> Figure:
    """The twist map, and wanted twists as the engine walked them."""
    figure = style.canvas(style.WIDTH, 8.4)
    panel, walked = figure.subplots(2, 1)
    amplitude, offset = np.degrees(table.amplitude), np.degrees(table.offset)
    for i, value in enumerate(amplitude):
        colour = style.SERIES[0] if i in (0, len(amplitude) - 1) else style.FAINT
        panel.plot(table.curvature[i], table.speed[i], color=colour, linewidth=1.2)
        panel.annotate(f"{value:.0f}°", (table.curvature[i, 0], table.speed[i, 0]), fontsize=7)
    for j in range(len(offset)):
        panel.plot(table.curvature[:, j], table.speed[:, j], color=style.FAINT, linewidth=1.2)
        place = table.curvature[0, j], table.speed[0, j]
        panel.annotate(f"{offset[j]:.0f}°", place, fontsize=7, va="top", color=style.SERIES[1])
    panel.set(
        xlabel="curvature [1/m]",
        ylabel="forward speed [m/s]",
        title="Amplitudes (at the left) and offsets (below) of the map",
    )
    if turns is not None:
        bend, wanted = turns.wanted_per_m, turns.wanted_m_s
        curvature, speed = turns.curvature_per_m, turns.speed_m_s
        for ends in zip(bend, curvature, wanted, speed, strict=True):
            walked.plot(ends[:2], ends[2:], color=style.MUTED, linewidth=1.0)
        walked.plot(bend, wanted, "o", color="none", markeredgecolor=style.INK, label="wanted")
        walked.plot(curvature, speed, "o", color=style.SERIES[1], markersize=5, label="engine")
        walked.legend(loc="lower center")
    walked.set(xlabel="curvature [1/m]", ylabel="forward speed [m/s]", title="Twists as walked")
    return figure
