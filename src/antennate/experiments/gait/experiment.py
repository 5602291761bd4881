"""The experiment `gait`."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from antennate.control.gait import require_step
from antennate.experiments.gait import run as gait
from antennate.studies.experiment import Experiment
from antennate.studies.measures import Measure, Table

MANEUVER = (
    Measure("speed_m_s", "speed", "m/s", form="+.3f"),
    Measure("body_lengths_per_cycle", "body lengths a cycle", form="+.2f"),
    Measure("yaw_deg_per_cycle", "yaw a cycle", "deg", form="+.1f"),
    Measure("cost_of_transport", "cost of transport", form=".3f"),
)


def tables(result: Mapping[str, Any]) -> Sequence[Table]:
    """The maneuvers, and what the lead of the body wave is worth."""
    cost, off = result["cost_of_phase"], result["wave_off"]
    chosen, best = (math.degrees(result[f"{k}_body_phase_rad"]) for k in ("chosen", "best"))
    maneuvers = Table.of(
        "Maneuvers",
        result["maneuvers"],
        MANEUVER,
        f"Robot length {result['body_length_m']:g} m, {result['frequency_hz']:g} cycles a second.\n"
        f"Without the body wave {off['speed_m_s']:.3f} m/s, {100 * off['ratio']:.0f} % of legs "
        f"that roll without slip.\n"
        f"The chosen lead of {chosen:.0f} deg gives {100 * cost['chosen_over_best']:.0f} % of the "
        f"best speed of all leads, at {best:.0f} deg;\n"
        f"the worst lead gives {100 * cost['worst_over_best']:.0f} %.",
    )
    return (maneuvers,)


def sentence(result: Mapping[str, Any]) -> str:
    """Speed and turn of the gait."""
    forward, left = result["maneuvers"]["forward"], result["maneuvers"]["turn_l"]
    return (
        f"FORWARD walks at {forward['speed_m_s']:.3f} m/s and TURN_L turns by "
        f"{left['yaw_deg_per_cycle']:.0f} deg a cycle in simulation. A walk "
        "has no random part: a second run gives the same."
    )


EXPERIMENT = Experiment.of_folder(
    __name__,
    gait.GaitStudyConfig,
    lambda config, workers, on_step, _: gait.run(config, workers, on_step),
    tables,
    sentence,
    check=lambda config: require_step(config.robot),
    filmed=True,
    parts="walks",
)
