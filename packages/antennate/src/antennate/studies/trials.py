"""Trials of an experiment: any process can run any of them, in any order."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from antennate.errors import ConfigError
from antennate.params.base import Params
from antennate.studies.columns import Frame, condition_of
from antennate.studies.pool import Workers, gather
from antennate.studies.pooling import frame
from antennate.studies.work import Fail, Failure, Together, no_failure, package_of
from antennate.telemetry import Restart

if TYPE_CHECKING:
    from antennate.telemetry.view.simulation import SimulationView

Config = TypeVar("Config", bound=Params)
Trial = tuple[str, int]
"""A condition, such as a controller or a profile, and the number of a trial."""
OnTrial = Callable[[Any], None]
"""Takes what a trial came to: its row and what figures draw of it, None for nothing."""
OnStep = Callable[[int, int], None]
"""Takes how many of how many parts are done."""
OnRow = Callable[[Any], None]
"""Takes a finished row, a dataclass; rows come in no particular order."""


def no_step(done: int, total: int) -> None:
    """Show nothing."""


def no_row(row: Any) -> None:
    """Keep nothing."""


def numbered(config: Any) -> list[Trial]:
    """Trials of a configuration with `trials` of them and no conditions."""
    return [("", number) for number in range(config.trials)]


def can_take(function: Callable[..., Any], name: str) -> bool:
    """Whether a function has an argument of this name."""
    return name in inspect.signature(function).parameters


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
        summarise: summarise(found) -> result, an object.
    """

    config: Config
    rows: list[Any]
    drawn: dict[Trial, Drawn]
    interrupted: bool
    row: type
    summarise: Callable[[Found[Any, Any, Any]], Result]

    @functools.cached_property
    def frame(self) -> Frame:
        """The rows as a pandas DataFrame."""
        return frame(self.rows, self.row)

    @functools.cached_property
    def _result(self) -> Any:
        found: Any = self.summarise(self)
        return replace(found, interrupted=True) if self.interrupted else found

    def result(self) -> Result:
        """What they come to; `interrupted` is true in it if trials are missing."""
        return self._result


_Task = tuple[Any, str, int, Path | None]
"""Configuration, condition, number of the trial, folder for its log."""


@dataclass(frozen=True)
class Batches:
    """Carries out some trials of one condition at once. Its functions are at the top of a module.

    Attributes:
        run: run(config, condition, numbers, emit) runs trials and emits each as it ends: its row
            and what figures draw of it. As a function of one trial it may take `logs` and `view`.
        most: Most trials at once.
        gpu: gpu(config, condition, numbers, emit, device, logs) does that on a GPU; `device` is
            a name of Warp or None, `logs` a folder or None. It raises ConfigError for what it
            cannot do. None if nothing does.
    """

    run: Callable[..., None]
    most: int
    gpu: Callable[..., None] | None = None

    def in_worker(self, tasks: Sequence[_Task], emit: Callable[[int, Any], None]) -> None:
        """Carry out tasks, those of one condition at once."""
        logs = tasks[0][3]
        _by_condition(functools.partial(self.run, **({"logs": logs} if logs else {})), tasks, emit)

    def on_device(
        self,
        tasks: Sequence[_Task],
        emit: Callable[[int, Any], None],
        fail: Fail,
        device: str | None,
    ) -> None:
        """Carry out tasks in batches; what fails is an invalid row, and nothing goes to `fail`.

        Raises:
            ConfigError: There are no batches, or none of this configuration.
        """
        if self.gpu is None:
            raise ConfigError("expected trials that have batches on a GPU, found others")
        _by_condition(functools.partial(self.gpu, device=device, logs=tasks[0][3]), tasks, emit)


def _by_condition(
    carry_out: Callable[..., None], tasks: Sequence[_Task], emit: Callable[[int, Any], None]
) -> None:
    config = tasks[0][0]
    places = {(name, number): i for i, (_, name, number, _) in enumerate(tasks)}
    for name in dict.fromkeys(name for name, _ in places):
        numbers = [number for condition, number in places if condition == name]

        def take(item: tuple[Any, Any], name: str = name) -> None:
            emit(places[name, item[0].trial], item)

        carry_out(config, name, numbers, take)


def _one_by_one(
    trial: Callable[..., Any],
    config: Any,
    condition: str,
    numbers: Sequence[int],
    emit: OnTrial,
    **how: Any,
) -> None:
    for number in numbers:
        found = trial(config, condition, number, **how)
        emit(found if isinstance(found, tuple) else (found, None))


def _condition(config: Any, condition: str, number: int, logs: Path | None) -> str:
    return condition


@dataclass(frozen=True)
class Trials(Generic[Config]):
    """Trials of an experiment, written once for workers, lockstep, GPU, logs, view and studies.

    Attributes:
        trial: trial(config, condition, number) -> its row, or a pair of its row and what figures
            draw of it; at the top of a module. The row depends on these three alone. If it can take
            `logs`, a folder for its log, or `view`, a page that shows it, the experiment has that
            option. `Batches` in place of a function runs some at once.
        row: Class of the rows, a dataclass with a field `trial`, and one with the metadata
            `CONDITION` if there are conditions.
        summarise: summarise(found) -> the result, from what the trials came to, see `Found`.
        every: every(config) -> all trials, as pairs of condition and number, in the order of the
            table; `trials` of the configuration, without conditions, if not given.
        invalid: invalid(config, condition, number, reason) -> the row of a trial whose worker died;
            without it such a trial ends the run.
        drawn: Class of what figures draw of a trial. It need be given only if that is of another
            package than row and trial, so that a run can go on with what its file says.
    """

    trial: Callable[..., Any] | Batches
    row: type
    summarise: Callable[[Found[Config, Any, Any]], Any]
    every: Callable[[Config], Sequence[Trial]] = numbered
    invalid: Callable[[Config, str, int, str], Any] | None = None
    drawn: type | None = None

    @property
    def batches(self) -> Batches:
        """What carries them out, one at once if it is a function of one trial."""
        if isinstance(self.trial, Batches):
            return self.trial
        return Batches(functools.partial(_one_by_one, self.trial), 1)

    @property
    def function(self) -> Callable[..., Any]:
        """The function that carries them out."""
        return self.trial.run if isinstance(self.trial, Batches) else self.trial

    def run(
        self, config: Config, trials: Sequence[Trial], emit: Callable[[int, Any], None]
    ) -> None:
        """Run some trials in this process; emit the index and the row of each as it ends."""
        tasks = [(config, *trial, None) for trial in trials]
        self.batches.in_worker(tasks, lambda i, result: emit(i, result[0]))

    def run_on_device(
        self,
        config: Config,
        trials: Sequence[Trial],
        emit: Callable[[int, Any], None],
        device: str | None,
    ) -> None:
        """Run some trials in batches on a GPU or another device of Warp; emit as `run` does.

        Raises:
            ConfigError: This configuration has no such batches.
        """
        tasks = [(config, *trial, None) for trial in trials]
        self.batches.on_device(tasks, lambda i, result: emit(i, result[0]), no_failure, device)

    def gather(
        self,
        config: Config,
        workers: int | Workers,
        on_step: OnStep,
        on_row: OnRow,
        logs: Path | None = None,
        view: SimulationView | None = None,
    ) -> tuple[list[tuple[Any, Any]], bool]:
        """All trials by condition and number, and whether Ctrl-C left some out.

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
            if failure.status == "failed" or self.invalid is None:
                raise failure.raised()
            return self.invalid(config, *trials[place], failure.reason), None

        interrupted = False
        try:
            if view is None:
                tasks = [(config, *trial, logs) for trial in trials]
                gather(self._together(), tasks, workers, on_step, take, lost)
            else:
                for done, trial in enumerate(trials, start=1):
                    self._show(config, *trial, take, logs, view)
                    on_step(done, len(trials))
        except KeyboardInterrupt:
            interrupted = True
        order = {name: i for i, name in enumerate(dict.fromkeys(name for name, _ in trials))}
        ended.sort(key=lambda item: (order[self.condition_of(item[0])], item[0].trial))
        return ended, interrupted

    def condition_of(self, row: Any) -> str:
        """The condition of a row, empty without conditions."""
        name = condition_of(self.row)
        return getattr(row, name) if name else ""

    def _together(self) -> Together:
        known = filter(None, (self.function, self.row, self.drawn))
        return Together(
            self.batches.in_worker,
            self.batches.most,
            group=_condition,
            batched=self.batches.on_device if self.batches.gpu else None,
            packages=tuple(dict.fromkeys(map(package_of, known))),
        )

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
        how = {"logs": logs} if logs else {}
        name = f"{condition}, trial {number}" if condition else f"trial {number}"
        while True:
            view.begin(name, getattr(config, "seed", 0))
            try:
                return self.batches.run(config, condition, [number], emit, view=view, **how)
            except Restart as wish:
                config = config.model_copy(update={"seed": wish.seed})
