"""The experiment `gait`."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from antennate.experiments.gait import run as gait
from antennate.studies.experiment import Experiment
from antennate.studies.measures import Measure, Table, shown

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
    share = "" if off["ratio"] is None else f", {100 * off['ratio']:.0f} % of legs that roll"
    maneuvers = Table.of(
        "Maneuvers",
        {name.upper(): row for name, row in result["maneuvers"].items()},
        MANEUVER,
        f"Body length {result['body_length_m']:g} m, {result['frequency_hz']:g} cycles a second.\n"
        f"Without the body wave {off['speed_m_s']:z.3f} m/s{share and f'{share} without slip'}.\n"
        f"The fastest lead tried is {best:.0f} deg. The chosen lead of {chosen:.0f} deg "
        f"gives {100 * cost['chosen_over_best']:.0f} % of its speed;\n"
        f"the slowest one gives {100 * cost['worst_over_best']:.0f} %.",
    )
    return (maneuvers, *_unknown(result))


def _unknown(result: Mapping[str, Any]) -> Sequence[Table]:
    """FORWARD with each unknown number at both ends of its range, and with all of them drawn."""
    if (unknown := result["unknown"]) is None:
        return ()
    rows = [
        (name, [*(f"{end:g}" for end in row["range"]), *_numbers(row["body_lengths_per_cycle"])])
        for name, row in unknown["parameters"].items()
    ]
    one = Table(
        "FORWARD with one number changed, body lengths a cycle",
        ("lower end", "upper end", "at the lower", "at the upper"),
        rows,
        f"As configured {result['maneuvers']['forward']['body_lengths_per_cycle']:.2f}.",
    )
    every = [
        ("median", [f"{unknown['median']:.2f}"]),
        ("95 % of the draws", [shown(unknown["interval95"])]),
        ("all draws", [shown(unknown["range"])]),
    ]
    if (measured := result["measured_body_lengths_per_cycle"]) is not None:
        every += [("measured on a robot", [f"{measured:.2f}"])]
        every += [("draws below that", [f"{_below(unknown, measured)} of {unknown['draws']}"])]
    return one, Table("All of them drawn", ("body lengths a cycle",), every)


def _numbers(values: Sequence[float]) -> list[str]:
    return [f"{value:.2f}" for value in values]


def _below(unknown: Mapping[str, Any], measured: float) -> int:
    return sum(value < measured for value in unknown["body_lengths_per_cycle"])


def sentence(result: Mapping[str, Any]) -> str:
    """Speed and turn of the gait."""
    forward, left = result["maneuvers"]["forward"], result["maneuvers"]["turn_l"]
    if (unknown := result["unknown"]) is not None:
        measured = result["measured_body_lengths_per_cycle"]
        low, high = unknown["interval95"]
        place = ""
        if measured is not None:
            where = "inside" if low <= measured <= high else "outside"
            place = f"; the measured {measured:.2f} is {where}"
        return (
            f"FORWARD walks {low:.2f} to {high:.2f} body lengths a cycle in 95 % of "
            f"{unknown['draws']} draws of {len(unknown['parameters'])} unknown numbers{place}."
        )
    return (
        f"FORWARD walks at {forward['speed_m_s']:.3f} m/s and TURN_L turns by "
        f"{left['yaw_deg_per_cycle']:.0f} deg a cycle in simulation. A walk "
        "has no random part: a second run gives the same."
    )


CAPTIONS = {
    "gait": "The sweep over the lead of the body wave, and the maneuvers from above.",
    "unknown": "FORWARD over all draws of the unknown numbers, and over each of them alone.",
}

EXPERIMENT = Experiment.of_folder(
    __name__,
    gait.GaitStudyConfig,
    lambda config, workers, on_step, _: gait.run(config, workers, on_step),
    tables,
    sentence,
    check=gait.check,
    filmed=True,
    parts="walks",
    logged=lambda config, workers, on_step, _, logs: gait.run(config, workers, on_step, logs=logs),
    logs=gait.log_names,
    viewed=lambda config, on_step, _, view, logs: gait.run(config, 1, on_step, view, logs),
    captions=CAPTIONS,
    explained="docs/results.md",
)
