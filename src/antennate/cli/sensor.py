"""`antennate sensor`: flex to counts, step by step, and the divider that suits the film."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from antennate.cli.study import Study
from antennate.cli.tables import Cell, number, show
from antennate.experiments.sensor import run as sensor

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DESCRIPTION = """\
The sensor on its own: resistance, voltage and reading over the bend, hysteresis in a slow loop,
creep and noise under a held bend, and the fixed resistor that spreads readings farthest."""
SHOWN_BENDS = 10


def show_result(result: Mapping[str, Any]) -> None:
    """Print the curve and what disturbs it."""
    rows = result["curve"]
    step = -(-(len(rows) - 1) // (SHOWN_BENDS - 1))
    way = "rise" if result["polarity"] > 0 else "fall"
    clipped = "The range is clipped by the converter.\n" if result["clipped"] else ""
    used, best = 1e-3 * result["divider_ohm"], 1e-3 * result["best_divider_ohm"]
    show(
        "Static curve",
        _COLUMNS,
        [(f"{row['flex_deg']:.0f} deg", _cell(row)) for row in rows[::step]],
        f"A {result['kind']} film: counts {way} with bending, over "
        f"{result['counts_span']:.0f} counts.\n"
        f"Loop: {100 * result['loop_width_share']:.0f} % of the span wide. Creep: "
        f"{result['creep_counts']:.0f} counts. Noise: {result['noise_sd_counts']:.1f} counts.\n"
        f"Divider: {used:g} kOhm; {best:g} kOhm would spread over "
        f"{result['best_counts_span']:.0f} counts.\n{clipped}",
    )


_COLUMNS = {
    "R [kOhm]": {"how": ("resistance_ohm", 1e-3, ".2f")},
    "V": {"how": ("voltage_v", 1.0, ".3f")},
    "counts": {"how": ("counts", 1.0, ".0f")},
}


def _cell(row: Mapping[str, Any]) -> Cell:
    def cell(column: Mapping[str, Any]) -> str:
        key, scale, form = column["how"]
        return number(scale * row[key], form)

    return cell


def _draw(outcome: sensor.SensorOutcome) -> Mapping[str, Figure]:
    from antennate.experiments.sensor.figure import sensor as draw

    return {
        "sensor": draw(
            outcome.result(), outcome.loop, outcome.hold, outcome.resistors, outcome.spread
        )
    }


STUDY = Study(
    name="sensor",
    description=DESCRIPTION,
    model=sensor.SensorConfig,
    run=lambda config, workers, on_step, on_row: sensor.run(config),
    result=sensor.SensorOutcome.result,
    show=show_result,
    draw=_draw,
)
command = STUDY.command
