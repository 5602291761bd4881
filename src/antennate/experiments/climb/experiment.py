"""The experiment `climb`: what feeling the ground buys a robot whose links pitch."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

from antennate.experiments.climb.config import CONTROLLERS, ClimbConfig, cells, config_of
from antennate.experiments.climb.crossing import crossing, ground_tables
from antennate.experiments.climb.measures import (
    COLUMNS,
    climbing,
    felt_tables,
    sensing,
    sentence,
    step_tables,
)
from antennate.experiments.climb.physics import ClimbPath, ClimbRow, carry_out, lost_row
from antennate.experiments.tunnel.batch import BATCH, watched
from antennate.studies.experiment import Experiment, OnRow, OnStep, Trial, Trials, no_row, no_step
from antennate.studies.measures import Table
from antennate.studies.pool import Workers

if TYPE_CHECKING:
    from antennate.telemetry.film import Film
    from antennate.telemetry.view.simulation import SimulationView


@dataclass(frozen=True, slots=True)
class ClimbOutcome:
    """All rows in the order of cells and trials, and the courses that figures draw."""

    config: ClimbConfig
    rows: list[ClimbRow]
    paths: dict[str, ClimbPath]
    interrupted: bool

    def result(self) -> dict[str, Any]:
        """The content of result.json."""
        config = self.config
        return {
            "schema": 1,
            "command": "climb",
            "seed": config.seed,
            "time_limit_s": config.time_limit,
            "heights_m": list(config.heights),
            "interrupted": self.interrupted,
            "climbing": climbing(config, self.rows),
            "grounds": crossing(config, self.rows),
            "sensing": sensing(config, self.rows),
        }


def every(config: ClimbConfig) -> list[Trial]:
    """All trials, cell by cell."""
    return [
        (name, trial)
        for name, cell in cells(config).items()
        for trial in range(config.sensing if cell.part == "sensing" else config.trials)
    ]


TRIALS = Trials[ClimbConfig](
    *("cell", every, carry_out, ClimbRow, lost_row, BATCH),
    watched=watched,
    interruptible=True,
)


def run(
    config: ClimbConfig,
    workers: int | Workers = 1,
    on_step: OnStep = no_step,
    on_row: OnRow = no_row,
    view: SimulationView | None = None,
) -> ClimbOutcome:
    """Run all trials of all cells.

    Raises:
        WorkerError: A worker process failed.
    """
    trials, interrupted = TRIALS.gather(config, workers, on_step, on_row, None, view)
    paths = {row.cell: path for row, path in trials if path is not None}
    return ClimbOutcome(config, [row for row, _ in trials], paths, interrupted)


def films(config: ClimbConfig, trial: int) -> dict[str, Callable[[], Film]]:
    """A film of each condition at the middle height, with the first gain divisor.

    It ends when the head is a body length behind the edge, as a trial of `tunnel` in that scene.
    """
    from antennate.experiments.tunnel.experiment import record

    height = sorted(config.heights)[len(config.heights) // 2]
    return {
        cell.condition: partial(
            record, config_of(config, cell), CONTROLLERS[cell.condition], trial, cell.condition
        )
        for cell in cells(config).values()
        if (cell.part, cell.height, cell.divisor) == ("climbing", height, config.divisors[0])
    }


def tables(result: Mapping[str, Any]) -> Sequence[Table]:
    """Steps, other grounds, and what is felt."""
    return [*step_tables(result), *ground_tables(result), *felt_tables(result)]


def none_valid(result: dict[str, Any]) -> bool:
    """Whether every trial of some condition is invalid."""
    summaries = [s for entry in result["climbing"] for s in entry["conditions"].values()]
    summaries += [s for e in result["grounds"] for some in e["grounds"].values() for s in some]
    return any(s["trials"] and s["trials"] == s["invalid"] for s in summaries)


CAPTIONS = {
    "success": "Success over the height of the step and the width of the gap with Wilson's 95 % "
    "interval, a row of panels for each gain divisor.",
    "side": "One climb from the side: the links at six moments, and where the plan has the head.",
    "plan": "Error of the plan when the centre of each link crosses the edge: 5, 50 and 95 % of "
    "the trials; the band is the aim.",
    "felt": "What climb takes the ground for, by the first thing that it feels.",
}

EXPERIMENT = Experiment.of_folder(
    *(__name__, ClimbConfig, run, tables, sentence),
    films=films,
    failed=none_valid,
    shown=True,
    trials=TRIALS,
    measures=COLUMNS,
    captions=CAPTIONS,
    explained="docs/results.md",
)
