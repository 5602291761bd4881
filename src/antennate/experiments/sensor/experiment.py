"""The experiment `sensor`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from antennate.experiments.sensor import run as sensor
from antennate.studies.experiment import Experiment
from antennate.studies.measures import Measure, Table

SHOWN_ROWS = 10
CURVE = (
    Measure("resistance_ohm", "R", "kOhm", scale=1e-3),
    Measure("voltage_v", "V", form=".3f"),
    Measure("counts", "counts", form=".0f"),
)


def tables(result: Mapping[str, Any]) -> Sequence[Table]:
    """The static curve, and what disturbs it."""
    rows = result["curve"]
    step = -(-(len(rows) - 1) // (SHOWN_ROWS - 1))
    way = "rise" if result["polarity"] > 0 else "fall"
    clipped = "\nThe range is clipped by the converter." if result["clipped"] else ""
    curve = Table(
        "Static curve",
        [measure.title for measure in CURVE],
        [(f"{row['flex_deg']:.0f} deg", [m.cell(row) for m in CURVE]) for row in rows[::step]],
        f"A {result['kind']} flex sensor: counts {way} with flex, over "
        f"{result['counts_span']:.0f} counts.\n"
        f"Loop: {100 * result['loop_width_share']:.0f} % of the span wide. Creep: "
        f"{result['creep_counts']:.0f} counts. Noise: {result['noise_sd_counts']:.1f} counts."
        f"{clipped}",
    )
    return (curve,)


def sentence(result: Mapping[str, Any]) -> str:
    """How much of the converter's range the divider uses."""
    used, best = 1e-3 * result["divider_ohm"], 1e-3 * result["best_divider_ohm"]
    return (
        f"A divider of {used:g} kOhm spreads readings over {result['counts_span']:.0f} counts, the "
        f"best of E24, {best:g} kOhm, over {result['best_counts_span']:.0f}; computed from the "
        "model of the flex sensor."
    )


EXPERIMENT = Experiment.of_folder(
    __name__, sensor.SensorConfig, lambda config, *_: sensor.run(config), tables, sentence
)
