"""`antennate wall`: which antenna passes a line of boulders."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from antennate.cli.study import Study
from antennate.cli.tables import Cell, number, show, span
from antennate.experiments.wall import run as wall

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DESCRIPTION = """\
The boulder wall: an antenna at a fixed angle moves along touching spheres. It jams if its tip stays
while the base goes on, slips if it touches nothing for long, and succeeds if it does neither. The
arms are the paper's three profiles and two controls; all meet the same walls and disturbances."""


def show_result(result: Mapping[str, Any]) -> None:
    """Print the arms, and the reference against each other one."""
    start = 1e3 * result["start_m"]
    show(
        "Arms",
        result["arms"],
        _ARM_ROWS,
        f"Seed {result['seed']}, gravity {result['gravity']}. `after` leaves out the first "
        f"{start:g} mm of travel.\nMedians over trials; invalid trials are left out of them.\n",
    )
    if result["paired"]:
        show(
            f"{wall.REFERENCE} (first) against each, trial by trial",
            {name.split("-")[1]: p for name, p in result["paired"].items()},
            _PAIR_ROWS,
            "McNemar's test, exact, two-sided.\n",
        )


_ARM_ROWS: list[tuple[str, Cell]] = [
    ("trials", lambda arm: str(arm["trials"])),
    ("successes", lambda arm: str(arm["successes"])),
    ("  Wilson 95 % [%]", lambda arm: span(arm["wilson95"], ".0f", 100.0)),
    ("jams", lambda arm: str(arm["jams"])),
    ("slips", lambda arm: str(arm["slips"])),
    ("invalid", lambda arm: str(arm["invalid"])),
    ("successes after", lambda arm: str(arm["after_start"]["successes"])),
    ("  Wilson 95 % [%]", lambda arm: span(arm["after_start"]["wilson95"], ".0f", 100.0)),
    ("jams after", lambda arm: str(arm["after_start"]["jams"])),
    ("slips after", lambda arm: str(arm["after_start"]["slips"])),
    ("least advance [mm]", lambda arm: number(arm["least_advance_mm"], ".2f")),
    ("longest stick [mm]", lambda arm: number(arm["longest_stick_mm"], ".1f")),
    ("longest gap [s]", lambda arm: number(arm["longest_gap_s"], ".2f")),
    ("force, mean [N]", lambda arm: number(arm["force_mean_n"], ".3f")),
    ("force, largest [N]", lambda arm: number(arm["force_max_n"], ".2f")),
    ("flex, largest [deg]", lambda arm: number(arm["flex_max_deg"], ".0f")),
]

_PAIR_ROWS: list[tuple[str, Cell]] = [
    ("only the first succeeded", lambda pair: str(pair["only_first"])),
    ("only the second", lambda pair: str(pair["only_second"])),
    ("McNemar p", lambda pair: number(pair["mcnemar_p"], ".3g")),
    ("only the first, after", lambda pair: str(pair["after_start"]["only_first"])),
    ("only the second, after", lambda pair: str(pair["after_start"]["only_second"])),
    ("McNemar p, after", lambda pair: number(pair["after_start"]["mcnemar_p"], ".3g")),
]


def _draw(outcome: wall.WallOutcome) -> Mapping[str, Figure]:
    from antennate.experiments.wall.figure import fates, passages

    figures = {"wall": fates(outcome.result())}
    if outcome.examples:
        ordered = {a: outcome.examples[a] for a in outcome.config.arms if a in outcome.examples}
        figures["passages"] = passages(ordered)
    return figures


STUDY = Study(
    name="wall",
    description=DESCRIPTION,
    model=wall.WallConfig,
    run=wall.run,
    result=wall.WallOutcome.result,
    show=show_result,
    draw=_draw,
    rows=lambda outcome: outcome.rows,
)
command = STUDY.command
