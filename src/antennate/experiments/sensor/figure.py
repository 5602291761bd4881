"""Figure of `antenna sensor`: curve and loop, a held bend, and the choice of the divider."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from antennate import figures as style
from antennate.experiments.sensor.experiment import SensorOutcome
from antennate.types import Floats


@style.styled
def figures(outcome: SensorOutcome) -> dict[str, Figure]:
    """Three panels of one sensor."""
    figure, result = style.canvas(style.WIDTH, 8.7), outcome.result()
    curve, held, choice = figure.subplots(3, 1)
    _draw_curve(curve, result, outcome.loop)
    _draw_hold(held, outcome.hold)
    _draw_choice(choice, result, outcome.resistors, outcome.spread)
    return {"sensor": figure}


def _draw_curve(panel: Axes, result: Mapping[str, Any], loop: Floats) -> None:
    first, second, _ = style.series(3)
    rows = result["curve"]
    panel.plot(np.degrees(loop[:, 0]), loop[:, 1], color=second, label="loop")
    panel.plot(
        [row["flex_deg"] for row in rows],
        [row["counts"] for row in rows],
        color=first,
        linestyle=(0, (4, 1.5)),
        label="static",
    )
    panel.set(xlabel="flex [deg]", ylabel="reading [counts]", title="Static curve and loop")
    panel.legend()


def _draw_hold(panel: Axes, hold: Floats) -> None:
    panel.plot(hold[:, 0], hold[:, 1], color=style.FAINT, linewidth=0.6, label="with noise")
    panel.plot(hold[:, 0], hold[:, 2], color=style.series(3)[0], label="without")
    panel.set(xlabel="time [s]", ylabel="reading [counts]", title="Bend held from 0 s on")
    panel.legend()


def _draw_choice(panel: Axes, result: Mapping[str, Any], resistors: Floats, spread: Floats) -> None:
    panel.plot(1e-3 * resistors, spread, color=style.series(3)[0])
    for key, marker, label in (
        ("divider_ohm", "s", "in use"),
        ("best_divider_ohm", "D", "best of E24"),
    ):
        ohm = result[key]
        panel.plot(
            1e-3 * ohm,
            np.interp(ohm, resistors, spread),
            color=style.INK,
            marker=marker,
            linestyle="",
            label=f"{label}: {1e-3 * ohm:g} kOhm",
        )
    panel.set_xscale("log")
    panel.set(xlabel="fixed resistor [kOhm]", ylabel="spread of readings [counts]", title="Divider")
    panel.set_ylim(0, 1.35 * float(spread.max()))
    panel.legend(loc="upper right")
