"""`antennate force`: how much of a contact's force one scalar tells."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from antennate.cli.study import Study
from antennate.cli.tables import Cell, number, show
from antennate.experiments.force import run as force
from antennate.experiments.force.loads import ForceConfig

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DESCRIPTION = """\
Press antennae of every profile at many places, by statics and by dragging them past a post, and say
how much of the force the flex tells: R2 of the best increasing curve, on loads it was not fitted
to, with one curve for every place and with one for all places."""


def show_result(result: Mapping[str, Any]) -> None:
    """Print what flex explains, profile by profile."""
    rows: list[tuple[str, Cell]] = [
        ("largest force [N]", lambda profile: number(profile["force_max_n"], ".4f"))
    ]
    for name, path in _PARTS.items():
        for known in ("known", "unknown"):
            rows.append((f"{name}, {known}", _cell(path, known, lambda r: number(r["r2"], ".2f"))))
            rows.append(("  95 %", _cell(path, known, _interval)))
    show(
        "Share of the force that flex explains (R2)",
        result["profiles"],
        rows,
        f"Places from {result['from_place']:g} of the length to the tip, hinges up to "
        f"{result['hinge_limit_deg']:g} deg; friction {result['friction']:g}.\n"
        "`known` is one curve for every place, `unknown` one for all.\n",
    )


def _interval(row: Mapping[str, Any]) -> str:
    low, high = row["r2_95"]
    return f"{number(low, '.2f')}–{number(high, '.2f')}"


def _cell(path: Sequence[str], known: str, form: Cell) -> Cell:
    def cell(profile: Mapping[str, Any]) -> str:
        for key in path:
            profile = profile[key]
        return form(profile[known]["flex"])

    return cell


_PARTS = {
    "at rest": ("statics", "frictionless"),
    "with friction": ("statics", "friction"),
    "dragged": ("traverses",),
}
"""Where a result holds each part."""


def _draw(outcome: force.ForceOutcome) -> Mapping[str, Figure]:
    from antennate.experiments.force.figure import study

    return {"force": study(outcome.result(), outcome.profiles)}


STUDY = Study(
    name="force",
    description=DESCRIPTION,
    model=ForceConfig,
    run=force.run,
    result=force.ForceOutcome.result,
    show=show_result,
    draw=_draw,
    rows=lambda outcome: outcome.rows,
    parts="profiles",
)
command = STUDY.command
