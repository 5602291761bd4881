"""`antennate taper`: the animal's stiffness proxy beside the robot's ladder of springs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from antennate.cli.study import Study
from antennate.cli.tables import Cell, number, show
from antennate.experiments.taper import run as taper

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DESCRIPTION = """\
The taper of an antenna: diameters to the stiffness proxy (d / d_1)^4, beside the robot's ladder of
springs, and the ladder that follows the taper best within limits of coils."""
SHOWN_SEGMENTS = 20


def show_result(result: Mapping[str, Any]) -> None:
    """Print segments, stretches and ladders."""
    rows = result["segments"]
    step = -(-len(rows) // SHOWN_SEGMENTS)
    show(
        "Animal",
        _COLUMNS,
        [(f"segment {i + 1}", _cell(row)) for i, row in enumerate(rows) if i % step == 0],
        f"Base over tip {result['base_over_tip']:.0f} : 1.\n",
    )
    ladder, suggested = result["ladder"], result["suggested"]
    show(
        "One spring a stretch, over the first",
        {
            "animal": {"values": result["stretches"]},
            "ladder": {"values": ladder["proxy"]},
            "suggested": {"values": suggested["proxy"]},
        },
        [(f"spring {i + 1}", _value(i)) for i in range(len(result["stretches"]))],
        f"Stretches of the animal fall {result['stretch_ratio']:.0f} : 1. The ladder "
        f"{_coils(ladder)} falls {ladder['base_over_tip']:.3g} : 1\n"
        f"and is {ladder['distance_decades']:.2f} decades away (root mean square); "
        f"{_coils(suggested)}\nfalls {suggested['base_over_tip']:.3g} : 1, "
        f"{suggested['distance_decades']:.2f} decades away.\n",
    )


_COLUMNS = {
    "d [mm]": {"key": "diameter_mm"},
    "I [mm⁴]": {"key": "second_moment_mm4"},
    "proxy": {"key": "proxy"},
}


def _coils(row: Mapping[str, Any]) -> str:
    return "-".join(f"{n:g}" for n in row["active_coils"])


def _cell(row: Mapping[str, Any]) -> Cell:
    return lambda column: number(row[column["key"]], ".3g")


def _value(i: int) -> Cell:
    return lambda column: number(column["values"][i], ".3g")


def _draw(outcome: taper.TaperOutcome) -> Mapping[str, Figure]:
    from antennate.experiments.taper.figure import taper as draw

    return {"taper": draw(outcome.result())}


STUDY = Study(
    name="taper",
    description=DESCRIPTION,
    model=taper.TaperConfig,
    run=lambda config, workers, on_step, on_row: taper.run(config),
    result=taper.TaperOutcome.result,
    show=show_result,
    draw=_draw,
)
command = STUDY.command
