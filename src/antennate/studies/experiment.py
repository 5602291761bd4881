"""What an experiment is: a configuration, a function that runs it, and how to tell what came out.

An experiment is one object. `antennate NAME` parses its configuration, runs it, keeps its rows and
its result in a run directory, prints its tables and its closing sentence, and draws its figures.
"""

from __future__ import annotations

import functools
import importlib
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, Protocol, TypeVar

from antennate.params.base import Params
from antennate.studies.columns import Frame, frame, typed
from antennate.studies.pool import Workers, chunk_of, gather
from antennate.studies.report import View
from antennate.studies.tables import Table
from antennate.studies.work import Fail, Failure, no_failure
from antennate.telemetry.view import Restart

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
    """What a run returns: the rows of trials.csv, and the result that result.json holds."""

    @property
    def rows(self) -> Sequence[Any]:
        """Finished trials, dataclasses, in a fixed order; by default there are none."""
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


Config = TypeVar("Config", bound=Params)
Trial = tuple[str, int]
"""A condition, such as a controller or a profile, and the number of a trial."""
OnTrial = Callable[[Any], None]
"""Takes what a trial came to: its row and what figures draw of it, None for nothing."""
Out = TypeVar("Out", bound=Outcome)


@dataclass(frozen=True)
class Trials(Generic[Config]):
    """Trials of an experiment, written once for workers, lockstep, GPU, logs, view and studies.

    Any process can run any of them, in any order. What a trial comes to is a pair: its row, which
    depends on the configuration and the trial alone, and what figures draw of it.

    Attributes:
        condition: Column of a row that tells its condition.
        every: every(config): all of them, in the order of the table.
        carry_out: carry_out(config, condition, numbers, emit, **how): runs some of one condition,
            and emits each as it ends; at the top of a module, or `OneByOne`. `how` may hold `logs`,
            a folder, and what `watched` gives.
        row: Class of the rows, a dataclass with the fields `condition` and `trial`.
        invalid: invalid(config, condition, number, reason): row of a trial whose worker died.
        most: How many may be run in lockstep.
        batch: The same as `carry_out` in batches on a GPU, with the name of a `device` of Warp or
            None in place of `how`; None if nothing does.
        check_batch: Raises if a configuration, given with the folder for logs, has no such batches.
        watched: watched(view): what `carry_out` is given to show its trials on a page.
        interruptible: Whether an interrupted run ends with the trials that it has.
    """

    condition: str
    every: Callable[[Config], Sequence[Trial]]
    carry_out: Callable[..., None]
    row: type
    invalid: Callable[[Config, str, int, str], Any]
    most: int = 1
    batch: Callable[..., None] | None = None
    check_batch: Callable[[Config, Path | None], None] = lambda config, logs: None
    watched: Callable[[SimulationView], Mapping[str, Any]] = lambda view: {}
    interruptible: bool = False

    def run(
        self, config: Config, trials: Sequence[Trial], emit: Callable[[int, Any], None]
    ) -> None:
        """Run some trials in this process; emit the index and the row of each as it ends."""
        tasks = [(config, *trial, None) for trial in trials]
        _Lockstep(self)(tasks, lambda i, result: emit(i, result[0]))

    def run_on_device(
        self,
        config: Config,
        trials: Sequence[Trial],
        emit: Callable[[int, Any], None],
        device: str | None,
    ) -> None:
        """The same in batches on a GPU or another device of Warp.

        Raises:
            ConfigError: This configuration has no such batches.
        """
        tasks = [(config, *trial, None) for trial in trials]
        self._batched(tasks, lambda i, result: emit(i, result[0]), no_failure, device)

    def gather(
        self,
        config: Config,
        workers: int | Workers,
        on_step: OnStep,
        on_row: OnRow,
        logs: Path | None = None,
        view: SimulationView | None = None,
    ) -> tuple[list[tuple[Any, Any]], bool]:
        """All trials by condition and number, and whether some are missing.

        With a view they run in this process, one after the other, and give the same.

        Raises:
            LogError: A log cannot be written.
            WorkerError: A worker process failed.
        """
        trials, ended = self.every(config), list[tuple[Any, Any]]()

        def take(item: tuple[Any, Any]) -> None:
            ended.append(item)
            on_row(item[0])

        def lost(place: int, failure: Failure) -> tuple[Any, None]:
            if failure.status == "failed":
                raise failure.raised()
            return self.invalid(config, *trials[place], failure.reason), None

        interrupted = False
        try:
            if view is None:
                gather(
                    _Lockstep(self),
                    [(config, *trial, logs) for trial in trials],
                    *(workers, on_step, take),
                    chunk=chunk_of(len(trials), workers, self.most),
                    together=True,
                    batched=self._batched if self.batch else None,
                    lost=lost,
                    group=lambda config, condition, *rest: condition,
                )
            else:
                for done, trial in enumerate(trials, start=1):
                    self._show(config, *trial, take, logs, view)
                    on_step(done, len(trials))
        except KeyboardInterrupt:
            if not self.interruptible:
                raise
            interrupted = True
        order = {name: i for i, name in enumerate(dict.fromkeys(name for name, _ in trials))}
        ended.sort(key=lambda item: (order[getattr(item[0], self.condition)], item[0].trial))
        return ended, interrupted

    def _show(
        self,
        config: Config,
        condition: str,
        number: int,
        emit: OnTrial,
        logs: Path | None,
        view: SimulationView,
    ) -> None:
        """One trial on a page; begun anew with another seed whenever a person wants that."""
        how = {**({"logs": logs} if logs else {}), **self.watched(view)}
        while True:
            view.begin(f"{condition}, trial {number}", getattr(config, "seed", 0))
            try:
                return self.carry_out(config, condition, [number], emit, **how)
            except Restart as wish:
                config = config.model_copy(update={"seed": wish.seed})

    def _batched(
        self,
        tasks: Sequence[_Task],
        emit: Callable[[int, Any], None],
        fail: Fail,
        device: str | None,
    ) -> None:
        """Tasks on a GPU; what fails is an invalid row, and nothing is told to `fail`."""
        self.check_batch(tasks[0][0], tasks[0][3])
        assert self.batch is not None  # noqa: S101  whoever calls this has looked
        _in_lockstep(partial(self.batch, device=device), tasks, emit)


_Task = tuple[Any, str, int, Path | None]
"""Configuration, condition, number of the trial, folder for its log."""


class _Lockstep:
    """Runs tasks in a worker, those of one condition in lockstep."""

    def __init__(self, trials: Trials[Any]) -> None:
        self._carry_out = trials.carry_out
        self.__module__ = trials.row.__module__  # by which `gather` knows whom to trust

    def __call__(self, tasks: Sequence[_Task], emit: Callable[[int, Any], None]) -> None:
        logs = tasks[0][3]
        _in_lockstep(partial(self._carry_out, **({"logs": logs} if logs else {})), tasks, emit)


def _in_lockstep(
    carry_out: Callable[..., None], tasks: Sequence[_Task], emit: Callable[[int, Any], None]
) -> None:
    places = {(name, number): i for i, (_, name, number, _) in enumerate(tasks)}
    for name in dict.fromkeys(name for name, _ in places):
        numbers = [number for condition, number in places if condition == name]

        def take(item: tuple[Any, Any], name: str = name) -> None:
            emit(places[name, item[0].trial], item)

        carry_out(tasks[0][0], name, numbers, take)


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
        summarise: summarise(config, rows) -> result.
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

    def result(self) -> Result:
        """What they come to, with `interrupted` where the result has it."""
        found: Any = self.summarise(self.config, self.frame)
        return replace(found, interrupted=True) if self.interrupted else found


@dataclass(frozen=True)
class OneByOne:
    """Runs trials one after the other: `Trials.carry_out` where nothing goes in lockstep.

    Attributes:
        trial: trial(config, condition, number, **how) -> what it comes to; at the top of a module.
    """

    trial: Callable[..., tuple[Any, Any]]

    def __call__(
        self, config: Any, condition: str, numbers: Sequence[int], emit: OnTrial, **how: Any
    ) -> None:
        """Run the trials of these numbers, and emit each."""
        for number in numbers:
            emit(self.trial(config, condition, number, **how))


@dataclass(frozen=True)
class Experiment(Generic[Config, Out]):
    """An experiment.

    Attributes:
        name: Name of the command.
        description: What `--help` says; its first sentence is the summary in the list of commands.
        config: Its configuration.
        run: run(config, workers, on_step, on_row) -> outcome, which does not depend on the number
            of worker processes. Where there are `logs` it also takes `logs`, a folder for them, and
            where it can be `shown` a `view`: then all runs in this process.
        tables: Tables of a result.
        sentence: One plain sentence: what came out, and how sure it is.
        result: Class of its results, a dataclass; without one they are dictionaries.
        row: Class of its rows, a dataclass.
        figures: Figures of an outcome by name.
        files: Further files of an outcome by name.
        names: names(config) -> the names of those files, so that one that is somebody else's is
            refused before the run.
        settled: settled(config, folder) -> the configuration with what chance decides before a run,
            as of the run that goes on in a folder; None where none does.
        check: Raises if a configuration cannot be run; called before anything is written.
        failed: Whether a result says nothing, so that the command ends with exit code 2.
        parts: What `on_step` counts.
        logs: Names of the logs of a configuration; None if there are no controllers to log.
        shown: Whether its trials can be shown on a page.
        films: films(config, trial) -> for each condition, by name, what runs this trial of it once
            more and records it; None where nothing can be filmed.
        body: body(result, images) -> HTML that stands in its report in place of tables and figures.
        trials: Its trials one by one, for studies; without them a study runs it as a whole.
        continued: Whether its folder is continued without being asked, and keeps its trials.
        explained: Page that says what the rows of its tables mean; empty for none.
        captions: What each figure shows, by its name, in one sentence.
        on_workers: Whether it runs trials on workers; without them there is no engine to choose.
        anywhere: Whether workers may be elsewhere than in processes of this machine.
        foretold: foretold(config, workers) -> one line on how long it will take, said before the
            first trial; empty for nothing.
        tasks: tasks(config): what each task of `run` is, by its place, whatever the number of
            trials; None if it is the list of `trials`, or if a run does not go on with more.
        in_shards: Whether its trials are known from the start, so that shards can divide them.
        undivided: Why they cannot divide those of a configuration; empty where they can.
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
    on_workers: bool = True
    anywhere: bool = True
    in_shards: bool = True
    undivided: Callable[[Config], str] = lambda config: ""
    foretold: Callable[[Config, Workers], str] = lambda config, workers: ""
    tasks: Callable[[Config], Sequence[Any]] | None = None

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
        run: Callable[..., Out],
        tables: Callable[[Any], Sequence[Table]],
        sentence: Callable[[Any], str],
        **more: Any,
    ) -> Experiment[Config, Out]:
        """An experiment with a folder of its own: a package that has its name and describes it.

        `module` is the `__name__` of a module in the folder. Without `figures` they are those that
        `figures(outcome)` of the module `figure` beside it returns, which is imported when they are
        drawn.
        """
        folder = module.rpartition(".")[0]
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
        """An experiment of a folder that is its trials: they are run, then summarised."""

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
