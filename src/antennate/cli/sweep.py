"""`antennate sweep`: sweep an antenna beside walls, and estimate how far they are."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from antennate.cli.study import Study
from antennate.cli.tables import Cell, number, show
from antennate.experiments.sweep import run as sweep

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DESCRIPTION = """\
Sweep the base of an antenna beside a wall: which shapes appear at which distance, centre and
amplitude, with the base fixed and moving along; and how well flex and base angle together tell the
distance of a wall and the width of a gap, beside what each tells alone."""


def show_result(result: Mapping[str, Any]) -> None:
    """Print the shares of the shapes, and the errors of the estimates."""
    columns = {
        f"{profile}, {motion}": row
        for profile, motions in result["shapes"].items()
        for motion, row in motions.items()
        if profile == result["profile"] or result["profile"] not in result["shapes"]
    }
    show("Share of time of each shape, mean over the map", columns, _SHAPES, "")
    for condition, by_noise in result["estimates"].items():
        noisy = by_noise["noisy"]
        show(
            f"Mean absolute error [%] (95 %), sweep {condition}, with sensor noise",
            {name: noisy[name] for name in ("distance", "gap", "base_to_tip")},
            _CUES,
            f"{noisy['sweeps']} sweeps to judge, {noisy['missed']} felt nothing, "
            f"{noisy['invalid']} invalid.\n",
        )
    published = result["published_percent"]
    sys.stdout.write(
        f"Published for CITRAS: base to tip {published['base_to_tip']:g} %, "
        f"gap {published['gap']:g} %.\n"
    )


def _share(name: str) -> Cell:
    def cell(row: Mapping[str, Any]) -> str:
        mean, low, high = row["share"][name]
        return f"{number(mean, '.2f')} ({number(low, '.2f')}–{number(high, '.2f')})"

    return cell


def _error(cue: str) -> Cell:
    def cell(column: Mapping[str, Any]) -> str:
        if cue not in column:
            return number(None)
        low, high = column[cue]["mape_95"]
        mean = column[cue]["mape_percent"]
        return f"{number(mean, '.2f')} ({number(low, '.2f')}–{number(high, '.2f')})"

    return cell


_SHAPES = [(name, _share(name)) for name in (*sweep.SHAPES, "free")]
_CUES = [(cue.replace("_", " "), _error(cue)) for cue in sweep.CUES]


def _draw(outcome: sweep.SweepOutcome) -> Mapping[str, Figure]:
    from antennate.experiments.sweep.figure import study

    return {"sweep": study(outcome.result())}


STUDY = Study(
    name="sweep",
    description=DESCRIPTION,
    model=sweep.SweepConfig,
    run=sweep.run,
    result=sweep.SweepOutcome.result,
    show=show_result,
    draw=_draw,
    rows=lambda outcome: outcome.rows,
    parts="sweeps",
)
command = STUDY.command
