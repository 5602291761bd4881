"""What an experiment is: a configuration, a function that runs it, and how to tell what came out.

An experiment is one object. `antennate NAME` parses its configuration and runs it. A run leaves a
folder (`studies/run_directory.py`): the configuration, a row for each trial, the result, figures
and a report. Then its tables and its closing sentence are printed.

A *trial* has a condition, such as a controller or a profile, and a number; its row is an object of
a class whose fields are the columns of trials.csv. The result is an object, too: result.json and
the printed tables have its fields. So a column is a field of one of these classes, or of the class
that both inherit (`studies/columns.py`). A trial whose worker process dies is run again twice, then
its row is that of an invalid trial (`studies/trials.py`, `studies/work.py`).

Ours are folders of `experiments/` with an object EXPERIMENT in their module `experiment`; one of
your own is named by an entry point (docs/experiments.md).
"""

from __future__ import annotations

import functools
import importlib
import importlib.util
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, Literal, Protocol, TypeVar

from antennate.errors import ConfigError
from antennate.studies.columns import Frame, content, typed
from antennate.studies.formats import strict
from antennate.studies.pool import Workers
from antennate.studies.pooling import frame
from antennate.studies.report import View
from antennate.studies.tables import Table
from antennate.studies.trials import Config, OnRow, OnStep, Trial, Trials, no_row, no_step

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from antennate.telemetry.film import Film


class Outcome(Protocol):
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


Out = TypeVar("Out", bound=Outcome)


Result = TypeVar("Result")
Drawn = TypeVar("Drawn")


@dataclass(frozen=True)
class Found(Generic[Config, Result, Drawn]):
    """What the trials of a run came to.

    Attributes:
        config: The configuration.
        rows: Finished trials in the order of conditions and numbers.
        drawn: What figures draw of a trial, by its condition and its number.
        interrupted: Whether trials are missing.
        row: Class of the rows.
        summarise: summarise(config, frame) -> result, an object. It has a field `interrupted` if
            the trials are `interruptible`: a person may then end the run before the last one.
    """

    config: Config
    rows: list[Any]
    drawn: dict[Trial, Drawn]
    interrupted: bool
    row: type
    summarise: Callable[[Config, Frame], Result]

    @functools.cached_property
    def frame(self) -> Frame:
        """The rows as a pandas DataFrame."""
        return frame(self.rows, self.row)

    @functools.cached_property
    def _result(self) -> Any:
        found: Any = self.summarise(self.config, self.frame)
        return replace(found, interrupted=True) if self.interrupted else found

    def result(self) -> Result:
        """What they come to; `interrupted` is true in it if trials are missing."""
        return self._result


@dataclass(frozen=True)
class Experiment(Generic[Config, Out]):
    """An experiment.

    Attributes:
        name: Name of the command.
        description: What `--help` says; its first sentence is the summary in the list of commands.
        config: Class of its configuration.
        run: run(config, workers, on_step, on_row) -> outcome, which does not depend on the number
            of worker processes. If the experiment has `logs`, run may also get a folder, `logs`; if
            it can be `shown`, a page, `view`: then all runs in this process.
        tables: Tables of a result.
        sentence: One plain sentence: what came out, and how sure it is.
        result: Class of its results, a dataclass; without one they are dictionaries.
        row: Class of its rows, a dataclass; those of `trials` have `trial` and the condition.
        figures: Figures of an outcome by name.
        files: Further files of an outcome by name.
        names: names(config) -> the names of those files. A folder that holds one of them, not
            listed in its files.txt, is refused before the run.
        settled: settled(config, folder) -> the configuration with its seed drawn, if it asks for a
            drawn one; `folder` holds the run that goes on and has drawn it, None for a new run.
        check: Raises if a configuration cannot be run; called before anything is written.
        failed: Whether a result says nothing, as all trials are invalid; exit code 2.
        parts: What `on_step` counts.
        logs: Names of the logs of a configuration; None if there are no controllers to log.
        shown: Whether its trials can be shown on a page.
        films: films(config, trial) -> by condition a function that runs this trial once more and
            records it; None where nothing can be filmed.
        body: body(result, images) -> HTML that stands in its report in place of tables and figures.
        trials: Its trials one by one, for studies (`antennate study`, which varies parameters);
            without them a study runs it as a whole.
        continued: Whether a run goes on with what its folder holds, without --resume.
        explained: Page that says what the rows of its tables mean; empty for none.
        captions: What each figure shows, by its name, in one sentence.
        workers: Where its trials may run: none (it has no trials on workers), here (processes of
            this machine) or anywhere (on other machines, too).
        foretold: foretold(config, workers) -> one line on how long it will take, said before the
            first trial; empty for nothing.
        tasks: tasks(config) -> an identity for each task of `run`. Tasks that stay the same with
            more trials have the same, so a finished run can take more. None: that of `trials`.
        of_file: of_file(path) -> the configuration of a FILE that is given without a flag; None
            where only --config takes one.
        undivided: undivided(config) -> why several machines cannot each run a share of its trials,
            a shard; empty if they can. None where they never can, as trials follow from others.
    """

    name: str
    description: str
    config: type[Config]
    run: Callable[..., Out]
    tables: Callable[[Any], Sequence[Table]]
    sentence: Callable[[Any], str]
    result: type | None = None
    row: type | None = None
    figures: Callable[[Out], Mapping[str, Figure]] = lambda outcome: {}
    files: Callable[[Out], Mapping[str, str | bytes]] = lambda outcome: {}
    names: Callable[[Config], Sequence[str]] = lambda config: ()
    settled: Callable[[Config, Path | None], Config] = lambda config, folder: config
    check: Callable[[Config], None] = lambda config: None
    failed: Callable[[Any], bool] = lambda result: False
    parts: str = "trials"
    logs: Callable[[Config], Sequence[str]] | None = None
    shown: bool = False
    films: Callable[[Config, int], Mapping[str, Callable[[], Film]]] | None = None
    body: Callable[[Any, Mapping[str, str]], str] | None = None
    trials: Trials[Config] | None = None
    continued: bool = False
    explained: str = ""
    captions: Mapping[str, str] = field(default_factory=dict)
    workers: Literal["none", "here", "anywhere"] = "anywhere"
    undivided: Callable[[Config], str] | None = lambda config: ""
    foretold: Callable[[Config, Workers], str] = lambda config, workers: ""
    tasks: Callable[[Config], Sequence[Any]] | None = None
    of_file: Callable[[Path], Config] | None = None

    @property
    def view(self) -> View:
        """How its result is shown."""
        body = self.body
        return View(
            *(self.name, self.description, self.config),
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
        run: Callable[..., Out],
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
        more.setdefault("explained", "docs/results.md")
        if "figures" not in more and importlib.util.find_spec(f"{folder}.figure"):
            more["figures"] = lambda outcome: importlib.import_module(f"{folder}.figure").figures(
                outcome
            )
        return cls(
            folder.rpartition(".")[2],
            importlib.import_module(folder).__doc__ or "",
            *(config, run, tables, sentence),
            **more,
        )

    @classmethod
    def of_trials(
        cls,
        module: str,
        config: type[Config],
        trials: Trials[Config],
        summarise: Callable[[Config, Frame], Any],
        tables: Callable[[Any], Sequence[Table]],
        sentence: Callable[[Any], str],
        **more: Any,
    ) -> Experiment[Config, Any]:
        """An experiment with a folder whose run is its trials, which `summarise` makes a result of.

        Arguments are those of `of_folder` and of `Found`. Its trials can be shown on a page unless
        `shown=False` is given.

        Raises:
            ConfigError: A run may end early, and the result cannot say so.
        """
        result = more.get("result")
        if trials.interruptible and not hasattr(result, "interrupted"):
            raise ConfigError(
                f"{module}: expected a class with a field `interrupted = False` as `result` beside "
                f"interruptible trials, found {getattr(result, '__name__', result)}"
            )

        def run(
            config: Config,
            workers: int | Workers = 1,
            on_step: OnStep = no_step,
            on_row: OnRow = no_row,
            **how: Any,
        ) -> Found[Config, Any, Any]:
            ended, interrupted = trials.gather(config, workers, on_step, on_row, **how)
            rows = [row for row, _ in ended]
            drawn = {
                (getattr(row, trials.condition), row.trial): seen
                for row, seen in ended
                if seen is not None
            }
            return Found(config, rows, drawn, interrupted, trials.row, summarise)

        more = {"trials": trials, "row": trials.row, "shown": True, **more}
        carry_out: Callable[..., Any] = run
        return cls.of_folder(module, config, carry_out, tables, sentence, **more)
