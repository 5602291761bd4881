"""The experiment `springs`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from antennate.experiments.springs import run as springs
from antennate.params import SpringParams
from antennate.studies.experiment import Experiment
from antennate.studies.measures import Measure, Table

SHOWN_WINDINGS = 6

SPRING = (
    Measure("stiffness_n_mm_per_deg", "stiffness", "N·mm/deg", form=".4f"),
    Measure("paper_n_mm_per_deg", "  the paper prints", form=".3f"),
    Measure("stiffness_n_m_per_rad", "stiffness", "N·m/rad", form=".5f"),
    Measure("torque_at_angle_n_mm", "torque at the angle", "N·mm"),
    Measure("yield_angle_deg", "yields at", "deg", form=".0f"),
)
WINDING = (
    Measure("mandrel_mm", "mandrel", "mm", form=".1f"),
    Measure("spring_index", "spring index", form=".1f"),
    Measure("coils", "active coils"),
    Measure("largest_error", "largest error", "%", form=".1f", scale=100.0),
    Measure("yield_angle_deg", "yields at", "deg", form=".0f"),
    Measure("body_length_mm", "longest body", "mm", form=".1f"),
)


def tables(result: Mapping[str, Any]) -> Sequence[Table]:
    """The springs, and the sets that could be wound."""
    wire = f"{result['wire']}, wire {result['wire_mm']:g} mm, coil {result['coil_mm']:g} mm"
    asked = Table.of(
        "Springs",
        {f"{row['active_coils']:g} coils": row for row in result["springs"]},
        SPRING,
        f"{wire}, index {result['spring_index']:.1f}, E {result['modulus_pa'] / 1e9:g} GPa.\n"
        f"{_rounding(result)}",
    )
    wound = Table.of(
        "Sets to wind",
        {
            f"{row['wire_mm']:.2f} mm": {
                **row,
                "coils": " ".join(f"{n:g}" for n in row["active_coils"]),
            }
            for row in result["windings"][:SHOWN_WINDINGS]
        },
        WINDING if result["windings"] else (),
        "The best mandrel of each stock wire, nearest first.\n" if result["windings"] else "",
    )
    return asked, wound


def _rounding(result: Mapping[str, Any]) -> str:
    """Where the paper's table is rounded."""
    said = [
        f"{row['active_coils']:g} coils {row['paper_exact_n_mm_per_deg']:.4f}, printed "
        f"{row['paper_n_mm_per_deg']:.{springs.PAPER_DIGITS}f}"
        for row in result["springs"]
        if row["paper_n_mm_per_deg"] is not None
        and abs(row["paper_exact_n_mm_per_deg"] - row["paper_n_mm_per_deg"]) > 1e-9
    ]
    exact = "Stiffness goes with 1 / coils"
    return f"{exact}; the paper rounds: {'; '.join(said)} N·mm/deg.\n" if said else f"{exact}.\n"


def sentence(result: Mapping[str, Any]) -> str:
    """How near the wanted stiffnesses can be wound."""
    wanted = ", ".join(f"{k:g}" for k in result["wanted_n_mm_per_deg"])
    if not result["windings"]:
        return f"No stock wire gives {wanted} N·mm/deg within the limits."
    best = result["windings"][0]
    return (
        f"Wire of {best['wire_mm']:.2f} mm on a mandrel of {best['mandrel_mm']:.1f} mm comes "
        f"within {100 * best['largest_error']:.1f} % of {wanted} N·mm/deg; computed, not measured."
    )


EXPERIMENT = Experiment.of_folder(
    __name__, SpringParams, lambda config, *_: springs.run(config), tables, sentence
)
