"""The boulder wall: which antenna passes a line of small spheres, which jams, which slips.

Everything is defined before any run. The base comes in along the wall's normal until the straight
antenna would reach behind the crests by the overlap, then moves along the wall. A trial *jams* if
the tip advances less than `jam_advance` over some `jam_travel` of the base, *slips* if no sphere is
touched for longer than `slip_time`, and succeeds if it does neither over the whole travel. The same
is counted once more without the `start`. A trial that does both counts as a jam.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from antennate.antenna.statics import Profile
from antennate.errors import SimulationError
from antennate.experiments.wall import measures
from antennate.experiments.wall.config import WallConfig
from antennate.experiments.wall.outcome import Traverse, WallTrial, classify, invalid
from antennate.experiments.wall.passage import passage
from antennate.sim import chain
from antennate.sim.bench import Bench, Watch, unwatched
from antennate.studies.experiment import OnRow, OnStep, Trial, no_row, no_step
from antennate.studies.pool import Workers, gather
from antennate.studies.work import Failure
from antennate.telemetry.view.pace import Restart
from antennate.telemetry.view.simulation import SimulationView

REFERENCE: Profile = "descending"
"""The profile that all others are compared with."""


@dataclass(frozen=True)
class WallOutcome:
    """All trials of a run.

    Attributes:
        rows: Sorted by profile and trial.
        examples: The first trial of every profile.
    """

    config: WallConfig
    rows: list[WallTrial]
    examples: dict[str, Traverse]

    def result(self) -> dict[str, Any]:
        """The content of result.json."""
        by_profile = {
            p: [row for row in self.rows if row.profile == p] for p in self.config.profiles
        }
        return {
            "schema": 2,
            "command": "wall",
            "seed": self.config.seed,
            "gravity": self.config.wall.gravity,
            "start_m": self.config.wall.start,
            "profiles": {p: measures.summary(rows) for p, rows in by_profile.items()},
            "border": measures.border(self.config.wall.jam_travel, self.rows),
            "paired": measures.paired(REFERENCE, by_profile),
        }


_Task = tuple[WallConfig, str, int]


def every(config: WallConfig) -> list[Trial]:
    """All trials, number by number."""
    return [(profile, trial) for trial in range(config.trials) for profile in config.profiles]


def run_rows(config: WallConfig, trials: Sequence[Trial], emit: Callable[[int, Any], None]) -> None:
    """Run some trials; emit the index and the row of each."""
    for i, (profile, trial) in enumerate(trials):
        emit(i, run_trial(config, profile, trial)[0])


def run_trial(
    config: WallConfig, profile: str, trial: int, watch: Watch = unwatched
) -> tuple[WallTrial, Traverse | None]:
    """One trial, and of the first of a profile its passage."""
    try:
        seen = passage(config, profile, trial, watch)
    except SimulationError as error:
        return invalid(config.seed, trial, profile, str(error)), None
    row = classify(config.wall, config.seed, trial, profile, seen)
    return row, seen if trial == 0 else None


def _run_viewed(
    tasks: Sequence[_Task], on_step: OnStep, on_row: OnRow, view: SimulationView
) -> Iterator[tuple[WallTrial, Traverse | None]]:
    """All trials on a page, one after the other; with another seed whenever a person wants that."""

    def watch(bench: Bench) -> None:
        view.tick(bench.model, bench.data)

    for done, (config, profile, trial) in enumerate(tasks, start=1):
        seed = config.seed
        while True:
            view.begin(f"{profile}, trial {trial}", seed)
            changed = config.model_copy(update={"seed": seed})
            try:
                found = run_trial(changed, profile, trial, watch)
                break
            except Restart as wish:
                seed = wish.seed
        on_row(found[0])
        on_step(done, len(tasks))
        yield found


def run(
    config: WallConfig,
    workers: int | Workers = 1,
    on_step: OnStep = no_step,
    on_row: OnRow = no_row,
    view: SimulationView | None = None,
) -> WallOutcome:
    """Run all trials of all profiles.

    With a view they run in this process, one after the other, and give the same.

    Raises:
        MissingPackageError: The solver needs a package that is not installed.
        WorkerError: A worker process failed.
    """
    chain.warm_up(config.solver)
    trials = every(config)
    tasks: list[_Task] = [(config, *trial) for trial in trials]

    def lost(place: int, failure: Failure) -> tuple[WallTrial, Traverse | None]:
        if failure.status == "failed":
            raise failure.raised()
        profile, trial = trials[place]
        return invalid(config.seed, trial, profile, failure.reason), None

    if view is None:
        how = {"on_result": lambda item: on_row(item[0]), "lost": lost}
        passages = gather(run_trial, tasks, workers, on_step, **how)
    else:
        passages = list(_run_viewed(tasks, on_step, on_row, view))
    passages.sort(key=lambda item: config.profiles.index(item[0].profile))
    examples = {row.profile: seen for row, seen in passages if seen is not None}
    return WallOutcome(config, [row for row, _ in passages], examples)
