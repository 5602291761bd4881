"""Trials of an experiment: any process can run any of them, in any order."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from antennate.params.base import Params
from antennate.studies.pool import Workers, chunk_of, gather
from antennate.studies.work import Fail, Failure, no_failure
from antennate.telemetry.view import Restart

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
        _Lockstep(self.carry_out, self.row)(tasks, lambda i, result: emit(i, result[0]))

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
                    _Lockstep(self.carry_out, self.row),
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
        _Lockstep(partial(self.batch, device=device), self.row)(tasks, emit)


_Task = tuple[Any, str, int, Path | None]
"""Configuration, condition, number of the trial, folder for its log."""


class _Lockstep:
    """Runs tasks in a worker, those of one condition at once."""

    def __init__(self, carry_out: Callable[..., None], row: type) -> None:
        self._carry_out = carry_out
        self.__module__ = row.__module__  # by which `gather` knows whom to trust

    def __call__(self, tasks: Sequence[_Task], emit: Callable[[int, Any], None]) -> None:
        config, _, _, logs = tasks[0]
        how = {"logs": logs} if logs else {}
        places = {(name, number): i for i, (_, name, number, _) in enumerate(tasks)}
        for name in dict.fromkeys(name for name, _ in places):
            numbers = [number for condition, number in places if condition == name]

            def take(item: tuple[Any, Any], name: str = name) -> None:
                emit(places[name, item[0].trial], item)

            self._carry_out(config, name, numbers, take, **how)


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
