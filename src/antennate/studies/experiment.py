"""What an experiment is: a configuration, a function that runs it, and how to tell what came out.

An experiment is one object. `antennate NAME` parses its configuration, runs it, keeps its rows and
its result in a run directory, prints its tables and its closing sentence, and draws its figures.
"""

from __future__ import annotations

import importlib
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, Protocol, TypeVar

from antennate.params.base import Params
from antennate.studies.measures import Measure, Table
from antennate.studies.pool import Workers
from antennate.studies.report import Body, View

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from antennate.telemetry.film import Film
    from antennate.telemetry.view.simulation import SimulationView

OnStep = Callable[[int, int], None]
"""Takes how many of how many parts are done."""
OnRow = Callable[[Any], None]
"""Takes a finished row, a dataclass; rows come in no particular order."""


def no_step(done: int, total: int) -> None:
    """Show nothing."""


def no_row(row: Any) -> None:
    """Keep nothing."""


class Outcome(Protocol):
    """What a run returns: the rows of trials.csv, and the content of result.json."""

    @property
    def rows(self) -> Sequence[Any]:
        """Finished trials, dataclasses, in a fixed order; by default there are none."""
        return ()

    def result(self) -> dict[str, Any]:
        """The content of result.json; `interrupted` is true if trials are missing."""
        ...


Config = TypeVar("Config", bound=Params)
Trial = tuple[str, int]
"""A condition, such as a controller or a profile, and the number of a trial."""
Found = TypeVar("Found", bound=Outcome)


@dataclass(frozen=True)
class Trials(Generic[Config]):
    """Trials that can be run one by one, in any order, by any process.

    Attributes:
        condition: Column of a row that tells its condition.
        every: every(config): all of them, in the order of the table.
        run: run(config, trials, emit): runs some, and emits the index and the row of each as it
            ends. The row depends on the configuration and the trial alone.
        most: How many may be run at once.
        row: Class of the rows, a dataclass; None if it is not told.
        run_on_device: run_on_device(config, trials, emit, device) does as `run` does, in batches on
            a GPU or another device of Warp; None if nothing does.
    """

    condition: str
    every: Callable[[Config], Sequence[Trial]]
    run: Callable[[Config, Sequence[Trial], Callable[[int, Any], None]], None]
    most: int = 1
    row: type | None = None
    run_on_device: (
        Callable[[Config, Sequence[Trial], Callable[[int, Any], None], str | None], None] | None
    ) = None


@dataclass(frozen=True)
class Experiment(Generic[Config, Found]):
    """An experiment.

    Attributes:
        name: Name of the command.
        description: What `--help` says; its first sentence is the summary in the list of commands.
        config: Its configuration.
        run: run(config, workers, on_step, on_row) -> outcome, which does not depend on the number
            of worker processes.
        tables: Tables of a result.
        sentence: One plain sentence: what came out, and how sure it is.
        figures: Figures of an outcome by name.
        files: Further files of an outcome by name.
        check: Raises if a configuration cannot be run; called before anything is written.
        failed: Whether a result says nothing, so that the command ends with exit code 2.
        parts: What `on_step` counts.
        logged: Runs as `run` does and keeps the log of each trial in a folder, which is given as
            well; None if there are no controllers to log.
        logs: Names of the logs that `logged` and `viewed` write into that folder.
        viewed: viewed(config, on_step, on_row, view, logs) runs as `run` does, in this process, and
            shows each trial on a page; the folder for logs may be None. None where nothing can be
            shown.
        films: films(config, trial) -> for each condition, by name, what runs this trial of it once
            more and records it; None where nothing can be filmed.
        body: HTML that stands in its report in place of tables and figures.
        trials: Its trials one by one, for studies; without them a study runs it as a whole.
        continued: Whether its folder is continued without being asked, and keeps its trials.
        measures: What it tells of its trials; studies take labels and units from them.
        explained: Page that says what the rows of its tables mean; empty for none.
        captions: What each figure shows, by its name, in one sentence.
        on_workers: Whether it runs trials on workers; without them there is no engine to choose.
        tasks: tasks(config): what each task of `run` is, by its place, whatever the number of
            trials; None if it is the list of `trials`, or if a run does not go on with more.
        in_shards: Whether its trials are known from the start, so that shards can divide them.
    """

    name: str
    description: str
    config: type[Config]
    run: Callable[[Config, Workers, OnStep, OnRow], Found]
    tables: Callable[[Mapping[str, Any]], Sequence[Table]]
    sentence: Callable[[Mapping[str, Any]], str]
    figures: Callable[[Found], Mapping[str, Figure]] = lambda outcome: {}
    files: Callable[[Found], Mapping[str, str]] = lambda outcome: {}
    check: Callable[[Config], None] = lambda config: None
    failed: Callable[[Mapping[str, Any]], bool] = lambda result: False
    parts: str = "trials"
    logged: Callable[[Config, Workers, OnStep, OnRow, Path], Found] | None = None
    logs: Callable[[Config], Sequence[str]] = lambda config: ()
    viewed: Callable[[Config, OnStep, OnRow, SimulationView, Path | None], Found] | None = None
    films: Callable[[Config, int], Mapping[str, Callable[[], Film]]] | None = None
    body: Body | None = None
    trials: Trials[Config] | None = None
    continued: bool = False
    measures: Sequence[Measure] = ()
    explained: str = ""
    captions: Mapping[str, str] = field(default_factory=dict)
    on_workers: bool = True
    in_shards: bool = True
    tasks: Callable[[Config], Sequence[Any]] | None = None

    @property
    def view(self) -> View:
        """How its result is shown."""
        return View(
            *(self.name, self.description, self.config, self.tables, self.sentence),
            body=self.body,
            captions=self.captions,
        )

    @property
    def grows(self) -> Callable[[Mapping[str, Any]], Sequence[Any]] | None:
        """Tasks of a configuration as JSON has it; None if a run does not go on with more."""
        tasks = self.tasks or (self.trials.every if self.trials else None)
        if tasks is None:
            return None
        return lambda values: tasks(self.config.model_validate_json(json.dumps(values)))

    @classmethod
    def of_folder(
        cls,
        module: str,
        config: type[Config],
        run: Callable[[Config, Workers, OnStep, OnRow], Found],
        tables: Callable[[Mapping[str, Any]], Sequence[Table]],
        sentence: Callable[[Mapping[str, Any]], str],
        filmed: bool = False,
        **more: Any,
    ) -> Experiment[Config, Found]:
        """An experiment with a folder of its own: a package that has its name and describes it.

        `module` is the `__name__` of a module in the folder. Without `figures` they are those that
        `figures(outcome)` of the module `figure` beside it returns, and if it is `filmed`, films
        are those of `films(config, trial)` of the module `film`; both are imported when they are
        needed.
        """
        folder = module.rpartition(".")[0]
        if filmed:
            more["films"] = lambda c, trial: importlib.import_module(f"{folder}.film").films(
                c, trial
            )
        if "figures" not in more:
            more["figures"] = lambda outcome: importlib.import_module(f"{folder}.figure").figures(
                outcome
            )
        return cls(
            folder.rpartition(".")[2],
            importlib.import_module(folder).__doc__ or "",
            *(config, run, tables, sentence),
            **more,
        )
