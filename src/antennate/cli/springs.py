"""`antennate springs`: stiffness from wire and coils, and back."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from antennate.cli.study import Study
from antennate.cli.tables import Cell, number, show
from antennate.experiments.springs import run as springs
from antennate.params import SpringParams

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DESCRIPTION = """\
Torsion springs: stiffness from wire, coil diameter and active coils, beside the paper's table; and
back, the sets of stock wire and mandrel that come nearest to wanted stiffnesses."""
SHOWN_WINDINGS = 6


def show_result(result: Mapping[str, Any]) -> None:
    """Print the springs and the sets that could be wound."""
    wire = f"{result['wire']}, wire {result['wire_mm']:g} mm, coil {result['coil_mm']:g} mm"
    show(
        "Springs",
        {f"{row['active_coils']:g} coils": row for row in result["springs"]},
        _SPRING_ROWS,
        f"{wire}, index {result['spring_index']:.1f}, E {result['modulus_pa'] / 1e9:g} GPa.\n"
        f"{_rounding(result)}",
    )
    sets = result["windings"][:SHOWN_WINDINGS]
    wanted = ", ".join(f"{k:g}" for k in result["wanted_n_mm_per_deg"])
    if not sets:
        show("Sets to wind", {}, [], f"No stock wire gives {wanted} N·mm/deg within the limits.\n")
        return
    show(
        "Sets to wind",
        {f"{row['wire_mm']:.2f} mm": row for row in sets},
        _WINDING_ROWS,
        f"Wanted: {wanted} N·mm/deg. The best mandrel of each stock wire, nearest first.\n",
    )


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


_SPRING_ROWS: list[tuple[str, Cell]] = [
    ("stiffness [N·mm/deg]", lambda row: number(row["stiffness_n_mm_per_deg"], ".4f")),
    ("  the paper prints", lambda row: number(row["paper_n_mm_per_deg"], ".3f")),
    ("stiffness [N·m/rad]", lambda row: number(row["stiffness_n_m_per_rad"], ".5f")),
    ("torque at the angle [N·mm]", lambda row: number(row["torque_at_angle_n_mm"], ".2f")),
    ("yields at [deg]", lambda row: number(row["yield_angle_deg"], ".0f")),
]

_WINDING_ROWS: list[tuple[str, Cell]] = [
    ("mandrel [mm]", lambda row: number(row["mandrel_mm"], ".1f")),
    ("spring index", lambda row: number(row["spring_index"], ".1f")),
    ("active coils", lambda row: " ".join(f"{n:g}" for n in row["active_coils"])),
    ("largest error [%]", lambda row: number(100 * row["largest_error"], ".1f")),
    ("yields at [deg]", lambda row: number(row["yield_angle_deg"], ".0f")),
    ("longest body [mm]", lambda row: number(row["body_length_mm"], ".1f")),
]


def _draw(outcome: springs.SpringsOutcome) -> Mapping[str, Figure]:
    from antennate.experiments.springs.figure import springs as draw

    return {"springs": draw(outcome.result())}


STUDY = Study(
    name="springs",
    description=DESCRIPTION,
    model=SpringParams,
    run=lambda config, workers, on_step, on_row: springs.run(config),
    result=springs.SpringsOutcome.result,
    show=show_result,
    draw=_draw,
)
command = STUDY.command
