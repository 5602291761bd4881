"""The experiment `climb`: what feeling the ground buys a robot whose links pitch."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

from antennate.experiments.climb.config import CONTROLLERS, ClimbConfig, cells, config_of
from antennate.experiments.climb.measures import summarise
from antennate.experiments.climb.physics import carry_out, lost_row
from antennate.experiments.climb.result import ClimbResult
from antennate.experiments.climb.rows import ClimbRow
from antennate.experiments.climb.tables import sentence, tables
from antennate.experiments.tunnel.batch import BATCH
from antennate.studies.experiment import Experiment
from antennate.studies.trials import Batches, Found, Trial, Trials

if TYPE_CHECKING:
    from antennate.telemetry.film import Film


def every(config: ClimbConfig) -> list[Trial]:
    """All trials, cell by cell."""
    return [
        (name, trial)
        for name, cell in cells(config).items()
        for trial in range(config.sensing if cell.part == "sensing" else config.trials)
    ]


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


def _result_of(found: Found[ClimbConfig, ClimbResult, object]) -> ClimbResult:
    return summarise(found.config, found.frame)


EXPERIMENT = Experiment.of_folder(
    __name__,
    ClimbConfig,
    Trials[ClimbConfig](
        Batches(carry_out, BATCH),
        row=ClimbRow,
        summarise=_result_of,
        every=every,
        invalid=lost_row,
    ),
    tables,
    sentence,
    result=ClimbResult,
    films=films,
    captions={
        "success": "Success over the height of the step and the width of the gap with Wilson's "
        "95 % interval, a row of panels for each gain divisor.",
        "side": "One climb from the side: the links at six moments, and where the plan has the "
        "head.",
        "plan": "Error of the plan when the centre of each link crosses the edge: 5, 50 and 95 % "
        "of the trials; the band is the aim.",
        "felt": "What climb takes the ground for, by the first thing that it feels.",
    },
)
