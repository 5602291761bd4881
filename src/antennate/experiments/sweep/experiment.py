"""The experiment `sweep`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from antennate.experiments.sweep import outlines
from antennate.experiments.sweep import run as sweep
from antennate.experiments.sweep.config import SweepConfig
from antennate.experiments.sweep.reach import CUES
from antennate.sim.chain import require_solver
from antennate.studies.experiment import Experiment
from antennate.studies.measures import Table, shown

QUANTITIES = ("distance", "gap", "base_to_tip")


def tables(result: Mapping[str, Any]) -> Sequence[Table]:
    """The shares of the shapes, and the errors of the estimates."""
    columns = {
        f"{profile}, {motion}": row
        for profile, motions in result["shapes"].items()
        for motion, row in motions.items()
        if profile == result["profile"] or result["profile"] not in result["shapes"]
    }
    shapes = Table(
        "Share of time of each shape, mean over the map (spread over cells)",
        list(columns),
        [
            (name, [_with_interval(*row["share"][name]) for row in columns.values()])
            for name in (*sweep.SHAPES, "free")
        ],
        "The map is a grid that was chosen. The spread over its cells, Student's t of their mean, "
        "is no interval of chance.",
    )
    return shapes, *(_errors(name, noise) for name, noise in result["estimates"].items())


def _errors(condition: str, by_noise: Mapping[str, Any]) -> Table:
    noisy = by_noise["noisy"]
    return Table(
        f"Mean absolute error [%] (95 %), sweep {condition}, with sensor noise",
        QUANTITIES,
        [
            (cue.replace("_", " "), [_error(noisy[quantity], cue) for quantity in QUANTITIES])
            for cue in CUES
        ],
        f"{noisy['sweeps']} test sweeps, {noisy['missed']} felt nothing, "
        f"{noisy['invalid']} invalid.",
    )


def _error(found: Mapping[str, Any], cue: str) -> str:
    if cue not in found:
        return shown(None)
    return _with_interval(found[cue]["mape_percent"], *(found[cue]["mape_95"] or (None, None)))


def _with_interval(mean: float | None, low: float | None, high: float | None) -> str:
    return shown(mean) if low is None else f"{shown(mean)} ({shown(low)}–{shown(high)})"


def sentence(result: Mapping[str, Any]) -> str:
    """How well active touch tells distances, beside the published figures."""
    found = result["estimates"]["same"]["noisy"]
    published = result["published_percent"]
    return (
        "Flex and base angle together tell the distance of a wall with an error of "
        f"{_error(found['distance'], 'flex_and_base')} % (95 % interval), that of the tip "
        f"{_error(found['base_to_tip'], 'flex_and_base')} % and a gap "
        f"{_error(found['gap'], 'flex_and_base')} %; published for CITRAS: "
        f"{published['base_to_tip']:g} % and {published['gap']:g} %."
    )


def _files(outcome: sweep.SweepOutcome) -> Mapping[str, str]:
    return {"points.csv": outlines.to_csv(outcome.outlines)} if outcome.outlines else {}


CAPTIONS = {
    "sweep": "Shares of the time in each shape, with the base fixed and moving, and "
    "the errors of the estimates.",
}

EXPERIMENT = Experiment.of_folder(
    *(__name__, SweepConfig, sweep.run, tables, sentence),
    filmed=True,
    files=_files,
    check=require_solver,
    parts="sweeps",
    captions=CAPTIONS,
    explained="docs/results.md",
)
