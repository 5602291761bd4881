"""`antennate gait`: walk on a flat floor and say how fast, how tightly and at what cost."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from antennate.cli.study import Study
from antennate.cli.tables import Cell, number, show
from antennate.experiments.gait import run as gait

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DESCRIPTION = """\
Walk on a flat floor: each of the four maneuvers, the legs without the body wave, and FORWARD once
for every lead of the body wave over the legs."""


def show_result(result: Mapping[str, Any]) -> None:
    """Print the maneuvers and what the lead of the body wave is worth."""
    cost, off = result["cost_of_phase"], result["wave_off"]
    chosen, best = (math.degrees(result[f"{k}_body_phase_rad"]) for k in ("chosen", "best"))
    show(
        "Maneuvers",
        result["maneuvers"],
        _ROWS,
        f"Robot length {result['body_length_m']:g} m, {result['frequency_hz']:g} cycles a second.\n"
        f"Without the body wave {off['speed_m_s']:.3f} m/s, {100 * off['ratio']:.0f} % of legs "
        f"that roll without slip.\n"
        f"The chosen lead of {chosen:.0f} deg gives {100 * cost['chosen_over_best']:.0f} % of the "
        f"sweep's best speed, at {best:.0f} deg;\n"
        f"its worst lead gives {100 * cost['worst_over_best']:.0f} %.\n",
    )


_ROWS: list[tuple[str, Cell]] = [
    ("speed [m/s]", lambda row: number(row["speed_m_s"], "+.3f")),
    ("body lengths a cycle", lambda row: number(row["body_lengths_per_cycle"], "+.2f")),
    ("yaw a cycle [deg]", lambda row: number(row["yaw_deg_per_cycle"], "+.1f")),
    ("cost of transport", lambda row: number(row["cost_of_transport"], ".3f")),
]


def _draw(outcome: gait.GaitOutcome) -> Mapping[str, Figure]:
    from antennate.experiments.gait.figure import study

    return {"gait": study(outcome.result(), outcome.maneuvers)}


STUDY = Study(
    name="gait",
    description=DESCRIPTION,
    model=gait.GaitStudyConfig,
    run=lambda config, workers, on_step, on_row: gait.run(config, workers, on_step),
    result=gait.GaitOutcome.result,
    show=show_result,
    draw=_draw,
    parts="walks",
)
command = STUDY.command
