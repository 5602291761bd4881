"""What an experiment is: a configuration, a function that runs it, and how to tell what came out.

An experiment is one object. `antennate NAME` parses its configuration and runs it. A run of the
command leaves a folder (`studies/run_directory.py`), one from Python only if it is given one: the
configuration, a row for each trial, the result, figures and a report. Then its tables and its
closing sentence are printed.

A *trial* has a condition, such as a controller or a profile, and a number; its row is an object of
a class whose fields are the columns of trials.csv. The result is an object, too: result.json and
the printed tables have its fields. So a column is a field of one of these classes, or of the class
that both inherit (`studies/columns.py`). A trial whose worker process dies is run again, up to
twice. Then `invalid` of its `Trials` gives its row; without that the run ends with an error
(`studies/trials.py`, `studies/work.py`).

Ours are folders of `experiments/` with an object EXPERIMENT in their module `experiment`; one of
your own is named by an entry point (docs/experiments.md).
"""

from __future__ import annotations

import importlib
import importlib.util
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, Literal, Protocol, TypeVar, cast

from antennate.errors import ConfigError
from antennate.params.base import Params
from antennate.studies.columns import content, typed
from antennate.studies.formats import strict
from antennate.studies.pool import Workers
from antennate.studies.report import View
from antennate.studies.tables import Table
from antennate.studies.trials import (
    Config,
    Found,
    OnRow,
    OnStep,
    Trials,
    can_take,
    no_row,
    no_step,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from antennate.telemetry.film import Film


class Planned(Params):
    """Configuration that is written in a file, as that of a study.

    A run of it goes on with what its folder holds, and may run code that the file names.
    """


class RunOutcome(Protocol):
    """What a run returns: the rows of trials.csv, and the result that result.json holds."""

    @property
    def rows(self) -> Sequence[Any]:
        """Finished trials, dataclasses, in a fixed order."""
        return ()

    def result(self) -> Any:
        """The result, a dataclass or a dictionary; `interrupted` is true if trials are missing."""
        ...


@dataclass(frozen=True)
class Done:
    """What a run returns that needs no more: its rows, and what they come to."""

    rows: Sequence[Any]
    found: Any

    def result(self) -> Any:
        """What they come to."""
        return self.found


Out = TypeVar("Out", bound=RunOutcome)
Files = Mapping[str, Callable[[Any], str | bytes | None]]
"""Names of files, and what makes the content of each of an outcome; None for no such file."""


def checked(check: Callable[[Config], None]) -> Callable[[Config, Path | None], Config]:
    """What `settled` of an experiment is if its configurations are checked and left as they are."""

    def settled(config: Config, folder: Path | None) -> Config:
        check(config)
        return config

    return settled


@dataclass(frozen=True)
class Experiment(Generic[Config, Out]):
    """An experiment.

    Attributes:
        name: Name of the command.
        description: What `--help` says; its first sentence is the summary in the list of commands.
        config: Class of its configuration. A run of a `Planned` one goes on with what its folder
            holds, without --resume.
        procedure: Its trials, `Trials`; or procedure(config, workers, on_step, on_row) -> outcome,
            which does not depend on the number of worker processes. If that can take `view`, a
            page that shows what is run, it has --view; then all runs in this process.
        tables: Tables of a result.
        sentence: One plain sentence: what came out, and how sure it is.
        result: Class of its results, a dataclass; without one they are dictionaries. A property
            `failed` of it is true if a result says nothing, as all trials are invalid: exit code
            2. With a field `interrupted = False`, Ctrl-C ends trials with those that have ended.
        row: Class of its rows, a dataclass; that of its `Trials` if it has them.
        figures: Figures of an outcome by name.
        captions: What each figure shows, by its name, in one sentence.
        files: files(config) -> further files: by name what makes the content of an outcome, None
            if it has no such file. A folder that holds one of these names, not listed in its
            files.txt, is refused before the run.
        settled: settled(config, folder) -> the configuration that is run, before anything is
            written. It raises if a configuration cannot be run, and draws a seed if one is asked
            for: `folder` holds the run that goes on and has drawn it, None for a new run.
        logs: Names of the logs of a configuration, whose folder the procedure takes as `logs`; None
            if there are no controllers to log.
        films: films(config, trial) -> by condition a function that runs this trial once more and
            records it; None where nothing can be filmed.
        placed: placed(result, folder) -> the result of a run in that folder, if it names its files.
        body: body(result, images) -> HTML that stands in its report in place of tables and figures.
        workers: Where its trials may run: none (it has no trials on workers), here (processes of
            this machine) or anywhere (on other machines, too).
        tasks: tasks(config) -> an identity for each task. Tasks that stay the same with more trials
            have the same, so a finished run can take more. None: that of its `Trials`.
        unshared: unshared(config) -> why a configuration cannot be run in shards: what is expected
            and found; empty if it can.
        of_file: of_file(path) -> the configuration of a FILE that is given without a flag; None
            where only --config takes one.
        counted: What its steps are, beside the bar; else the name of the command stands there.
    """

    name: str
    description: str
    config: type[Config]
    procedure: Callable[..., Out] | Trials[Config]
    tables: Callable[[Any], Sequence[Table]]
    sentence: Callable[[Any], str]
    result: type | None = None
    row: type | None = None
    figures: Callable[[Out], Mapping[str, Figure]] = lambda outcome: {}
    captions: Mapping[str, str] = field(default_factory=dict)
    files: Callable[[Config], Files] = lambda config: {}
    settled: Callable[[Config, Path | None], Config] = lambda config, folder: config
    logs: Callable[[Config], Sequence[str]] | None = None
    films: Callable[[Config, int], Mapping[str, Callable[[], Film]]] | None = None
    placed: Callable[[Any, Path], Any] = lambda found, folder: found
    body: Callable[[Any, Mapping[str, str]], str] | None = None
    workers: Literal["none", "here", "anywhere"] = "anywhere"
    tasks: Callable[[Config], Sequence[Any]] | None = None
    unshared: Callable[[Config], str] = lambda config: ""
    of_file: Callable[[Path], Config] | None = None
    counted: str = ""

    def __post_init__(self) -> None:
        if self.trials is not None:
            object.__setattr__(self, "row", self.trials.row)

    @property
    def trials(self) -> Trials[Config] | None:
        """Trials one by one, for studies; without them a study runs the experiment as a whole."""
        return self.procedure if isinstance(self.procedure, Trials) else None

    @property
    def shown(self) -> bool:
        """Whether what it runs can be shown on a page."""
        function = self.procedure if self.trials is None else self.trials.function
        return can_take(cast("Callable[..., Any]", function), "view")

    @property
    def continued(self) -> bool:
        """Whether a run goes on with what its folder holds, without --resume."""
        return issubclass(self.config, Planned)

    def run(
        self,
        config: Config,
        workers: int | Workers = 1,
        on_step: OnStep = no_step,
        on_row: OnRow = no_row,
        **how: Any,
    ) -> RunOutcome:
        """Run a configuration.

        Args:
            config: The configuration.
            workers: How many, or `Workers`.
            on_step: Called with how many of how many parts are done.
            on_row: Called with each row as it comes, in no particular order.
            how: `logs`, a folder for logs, and `view`, a page, if the experiment has them.

        Raises:
            AntennateError: The run failed.
            KeyboardInterrupt: Ctrl-C came, and the result cannot say that trials are missing.
        """
        if not isinstance(self.procedure, Trials):
            return self.procedure(config, workers, on_step, on_row, **how)
        trials = self.procedure
        ended, interrupted = trials.gather(config, workers, on_step, on_row, **how)
        if interrupted and not hasattr(self.result, "interrupted"):
            raise KeyboardInterrupt
        rows = [row for row, _ in ended]
        drawn = {
            (trials.condition_of(row), row.trial): seen for row, seen in ended if seen is not None
        }
        return Found(config, rows, drawn, interrupted, trials.row, trials.summarise)

    @property
    def view(self) -> View:
        """How its result is shown."""
        body = self.body
        return View(
            self.name,
            about=self.description,
            config=self.config,
            tables=lambda data: self.tables(self.read(data)),
            sentence=lambda data: self.sentence(self.read(data)),
            body=body and (lambda data, images: body(self.read(data), images)),
            captions=self.captions,
        )

    def read(self, data: Mapping[str, Any]) -> Any:
        """A result as its run returned it, from the content of result.json.

        Raises:
            ValueError: Another version wrote it.
        """
        return data if self.result is None else typed(self.result, data)

    def failed(self, found: Any) -> bool:
        """Whether a result says nothing, by its property `failed`; a column may have that name."""
        return isinstance(getattr(type(found), "failed", None), property) and found.failed

    def content(self, found: Any) -> dict[str, Any]:
        """What result.json holds of a result.

        Raises:
            ConfigError: The result is not what the experiment says, so that none could read it.
        """
        if self.result is None and not isinstance(found, dict):
            raise ConfigError(
                f"{self.name}: expected a dictionary as result, or its class as `result` of the "
                f"experiment, found {type(found).__name__} without it"
            )
        if self.result is None:
            return found
        if not isinstance(found, self.result):
            raise ConfigError(
                f"{self.name}: expected a result of the class {self.result.__name__}, found "
                f"{type(found).__name__}"
            )
        held = content(found)
        try:
            self.read(strict(held))
        except ValueError as error:
            raise ConfigError(
                f"{self.name}: expected values of the types that {self.result.__name__} says, "
                f"found {error}; what may be missing is `float | None`"
            ) from None
        return held

    @property
    def grows(self) -> Callable[[Mapping[str, Any]], Sequence[Any]] | None:
        """`tasks` of a configuration read from JSON; None if no run goes on with more trials."""
        tasks = self.tasks or (self.trials.every if self.trials else None)
        if tasks is None:
            return None
        return lambda values: tasks(self.config.model_validate_json(json.dumps(values)))

    @classmethod
    def of_folder(
        cls,
        module: str,
        config: type[Config],
        procedure: Callable[..., Out] | Trials[Config],
        tables: Callable[[Any], Sequence[Table]],
        sentence: Callable[[Any], str],
        **more: Any,
    ) -> Experiment[Config, Out]:
        """An experiment with a folder of its own: a package that has its name and describes it.

        `module` is the `__name__` of a module in the folder. If `figures` is not given, it is the
        function `figures(outcome)` of the module `figure` beside it, imported when it is needed;
        without that module there are none.
        """
        folder = module.rpartition(".")[0]
        if "figures" not in more and importlib.util.find_spec(f"{folder}.figure"):
            more["figures"] = lambda outcome: importlib.import_module(f"{folder}.figure").figures(
                outcome
            )
        return cls(
            folder.rpartition(".")[2],
            importlib.import_module(folder).__doc__ or "",
            config,
            procedure,
            tables=tables,
            sentence=sentence,
            **more,
        )
