"""`antennate gait`: walk on a flat floor and say how fast, how tightly and at what cost."""

from __future__ import annotations

import math
import sys
from collections.abc import Mapping, Sequence
from typing import Any

from antennate.cli import OK
from antennate.cli.arguments import parse
from antennate.cli.folder import RunFolder, to_json
from antennate.cli.progress import progress, terminate_as_interrupt
from antennate.cli.tables import Cell, number, show
from antennate.experiments import gait

DESCRIPTION = """\
Walk on a flat floor: each of the four maneuvers, the legs without the body wave, and FORWARD once
for every lead of the body wave over the legs."""


def command(argv: Sequence[str]) -> int:
    """Run the command and return its exit code.

    Raises:
        BadInputError: Something given cannot be used.
        SimulationError: The physics became invalid.
        WorkerError: A worker died.
    """
    config, options = parse("gait", DESCRIPTION, gait.GaitStudyConfig, argv)
    with RunFolder.open("gait", options.out, options.overwrite) as folder:
        folder.describe("gait", argv, config)
        with progress("walks") as step, terminate_as_interrupt():
            outcome = gait.run(config, options.worker_count, step)
        result = outcome.result()
        folder.finish(result, [])
        if options.json:
            sys.stdout.write(to_json(result))
        else:
            show_result(result)
        if not options.no_figures:
            _draw(outcome, folder)
        sys.stderr.write(f"written to {folder.path}\n")
    return OK


def _draw(outcome: gait.GaitOutcome, folder: RunFolder) -> None:
    from antennate.figures import style
    from antennate.figures.gait import study

    figure = study(outcome.result(), outcome.maneuvers)
    for suffix, data in style.render(figure).items():
        folder.write(f"figures/gait.{suffix}", data)


def show_result(result: Mapping[str, Any]) -> None:
    """Print the maneuvers and what the lead of the body wave is worth."""
    cost, off = result["cost_of_phase"], result["wave_off"]
    chosen, best = (math.degrees(result[f"{k}_body_phase_rad"]) for k in ("chosen", "best"))
    show(
        "Maneuvers",
        result["maneuvers"],
        _ROWS,
        f"Body length {result['body_length_m']:g} m, {result['frequency_hz']:g} cycles a second.\n"
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
