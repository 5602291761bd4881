"""Figure of `antenna ringdown`: the swing, animals beside it, and a cone as a chain."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from antennate import figures as style
from antennate.experiments.ringdown.run import ANIMAL_CYCLE, REJECTED, RingdownOutcome
from antennate.types import Floats


@style.styled
def figures(outcome: RingdownOutcome) -> dict[str, Figure]:
    """Three panels of one antenna."""
    figure, result = style.canvas(style.WIDTH, 9.6), outcome.result()
    swing, beside, cones = figure.subplots(3, 1)
    _draw_swing(swing, result, outcome.t, outcome.tip)
    _draw_animals(beside, result)
    _draw_cones(cones, result)
    return {"ringdown": figure}


def _draw_swing(panel: Axes, result: Mapping[str, Any], t: Floats, tip: Floats) -> None:
    first, second, _ = style.series(3)
    cycle, chain = 1e3 * result["engine"]["cycle_s"], result["chain"]
    decay = np.exp(-chain["damping"] * 2 * np.pi * chain["natural_hz"] * t)
    panel.axhspan(REJECTED - 1, 1 - REJECTED, color=style.FAINT, zorder=0, linewidth=0)
    panel.plot(1e3 * t, tip, color=first, label="tip in the engine")
    panel.plot(1e3 * t, decay, color=second, linestyle=(0, (4, 1.5)), label="decay of the chain")
    panel.axvline(cycle, color=style.MUTED, linewidth=0.8)
    panel.axvline(1e3 * ANIMAL_CYCLE, color=style.MUTED, linewidth=0.8, linestyle=":")
    panel.set(xlabel="time [ms]", ylabel="deflection, 1 at the start")
    panel.set_title(
        f"Let go: {100 * result['engine']['rejected']:.0f} % rejected in {cycle:.0f} ms (line);\n"
        f"cockroach {1e3 * ANIMAL_CYCLE:.0f} ms (dots), grey: 90 % rejected"
    )
    panel.legend()


def _draw_animals(panel: Axes, result: Mapping[str, Any]) -> None:
    rows = [row for row in result["animals"] if row["natural_hz"]]
    for row, colour in zip(rows, style.series(len(rows)), strict=True):
        (left, right), (low, high) = row["natural_hz"], row["damping"]
        middle, centre = (low + high) / 2, (left * right) ** 0.5
        bars: dict[str, Any] = {"color": colour, "linewidth": 3.0, "solid_capstyle": "butt"}
        panel.plot([left, right], [middle, middle], **bars)
        panel.plot([centre, centre], [low, high], **bars)
        panel.text(right * 1.15, middle, row["name"].split()[0], va="center", fontsize=8)
    engine = result["engine"]
    ours = [{"name": "this antenna", **engine}, *result["beside"]]
    for row in ours:
        at = row["natural_hz"], row["damping"]
        panel.scatter(*at, color=style.INK, zorder=3)
        panel.annotate(row["name"], at, (6, -1), textcoords="offset points", va="top", fontsize=8)
    panel.axhline(result["animal_damping"], color=style.MUTED, linewidth=0.8)
    panel.set_xscale("log")
    panel.set_xlim(min(1.0, engine["natural_hz"] / 2), 1000)
    panel.set_ylim(0, 1.05)
    panel.set(xlabel="frequency [Hz]", ylabel="damping ratio")
    panel.set_title("Animals; above the line 90 % are\nrejected in one cycle")


def _draw_cones(panel: Axes, result: Mapping[str, Any]) -> None:
    rows = result["cones"]
    hinges, error = [r["hinges"] for r in rows], [100 * abs(1 - r["ratio"]) for r in rows]
    panel.plot(hinges, error, color=style.series(1)[0], marker="o")
    panel.set_xscale("log")
    panel.set_yscale("log")
    panel.set_xticks(hinges, [str(n) for n in hinges])
    panel.minorticks_off()
    panel.set(xlabel="hinges", ylabel="frequency below the closed form [%]")
    panel.set_title("A cone as a chain")
