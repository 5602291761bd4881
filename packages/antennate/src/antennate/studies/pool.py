"""Run tasks on workers: what was finished before is taken from their file, the rest is run.

One worker means this process, without any start-up cost. Nothing that was finished is lost when
somebody presses Ctrl-C, or when a worker or this process is killed.
"""

from __future__ import annotations

import contextlib
import itertools
import logging
import math
import os
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from antennate.errors import BadInputError, WorkerError
from antennate.studies.engines import LOCAL
from antennate.studies.formats import decoded
from antennate.studies.sending import IMPORTING
from antennate.studies.trial_file import TrialFile, key_of
from antennate.studies.work import Call, Engine, Failure, Here, Together, Work

_NOTE = logging.getLogger(__name__)
TIMEOUT = 3600.0
"""Time after which a trial that has not ended is given up, unless told otherwise [s]."""


class ShardEnd(Exception):
    """All tasks of a shard are finished; another command puts the shards together.

    Attributes:
        count: Finished tasks of the shard.
        total: Tasks of all shards together.
    """

    def __init__(self, count: int, total: int) -> None:
        super().__init__(count, total)
        self.count, self.total = count, total


def core_count() -> int:
    """Cores this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


@dataclass(frozen=True)
class Workers:
    """How many workers there are, where they are, and what they have finished before.

    Attributes:
        count: Number of workers.
        engine: Where the workers are; processes of this machine if not given.
        shard: (i, n): carry out the i-th of n parts of the tasks, from 1, and raise ShardEnd.
        timeout: Time after which a task that has not ended is given up [s], so that even one worker
            is a process of its own; None for an hour, where one worker waits on.
        retry: Whether tasks that failed before are run again.
        trials: Where a run keeps finished tasks, None to keep none.
        shared: The environment that workers must share with this process.
    """

    count: int
    engine: Engine | None = None
    shard: tuple[int, int] | None = None
    timeout: float | None = None
    retry: bool = False
    trials: TrialFile | None = None
    shared: Mapping[str, Any] | None = None

    @contextlib.contextmanager
    def stay(self) -> Iterator[Workers]:
        """Workers whose processes of this machine serve one call after the other."""
        if self.engine_for(self.count).name != LOCAL:
            yield self
            return
        from antennate.studies.processes import Processes  # only where there are some

        staying = Processes(stay=True)
        try:
            yield replace(self, engine=staying)
        finally:
            staying.end()

    def engine_for(self, parts: int) -> Engine:
        """The engine that carries out a number of parts."""
        if self.engine is not None:
            return self.engine
        if self.timeout is None and (self.count == 1 or parts <= 1):
            return Here()
        from antennate.studies.processes import Processes  # only where there are some

        return Processes()

    def mine(self, place: int) -> bool:
        """Whether a task belongs to this shard."""
        return self.shard is None or place % self.shard[1] == self.shard[0] - 1


def workers_from(given: int | Workers) -> Workers:
    """Workers from their number, or as they are given."""
    return given if isinstance(given, Workers) else Workers(given)


def places_of(records: Iterable[str]) -> set[int]:
    """Places of the tasks that a shard kept of its first call, from the keys of its records."""
    return {int(key.removeprefix("0.")) for key in records if key.startswith("0.")}


class _Kept:
    """What a call of `gather` has finished, by place, and how it is kept."""

    def __init__(
        self,
        workers: Workers,
        total: int,
        packages: Collection[str],
        take: Callable[[Any], None],
        on_step: Callable[[int, int], None],
        lost: Callable[[int, Failure], Any] | None,
    ) -> None:
        self._workers, self._total, self._packages = workers, total, packages
        self._number = 0 if workers.trials is None else next(workers.trials.calls)
        self._take, self._on_step, self._lost = take, on_step, lost
        self.results: dict[int, Any] = {}

    def emit(self, place: int, result: Any) -> None:
        """Keep a result."""
        self._finish(place, result)

    def fail(self, place: int, failure: Failure) -> None:
        """Keep a failure, if there is a result that stands for it."""
        if self._lost is None:
            raise failure.raised()
        why = [failure.status, failure.reason]
        self._finish(place, self._lost(place, failure), failure=why)

    def _finish(self, place: int, result: Any, **more: Any) -> None:
        trials, key = self._workers.trials, key_of(self._number, place)
        with contextlib.ExitStack() as stack:
            if trials is not None:
                try:
                    stack.enter_context(trials.trial(key, result, **more))
                except TypeError as error:
                    raise BadInputError(str(error)) from None
            self.results[place] = result
            self._take(result)
        self._on_step(len(self.results), self._total)

    def resume(self) -> None:
        """Take what was finished before."""
        trials = self._workers.trials
        if trials is None or not trials.records:
            return
        unread: list[str] = []
        for place in range(self._total):
            record = trials.records.pop(key_of(self._number, place), None)
            if record is None:
                continue
            if "failure" in record and (self._lost is None or self._workers.retry):
                continue
            try:
                result = decoded(record["result"], self._packages)
            except ValueError as error:
                unread.append(str(error))
                continue
            self.results[place] = result
            with trials.known():
                self._take(result)
        if unread:
            _NOTE.warning("finished trials that are run again: %d: %s", len(unread), unread[0])
        if self.results:
            self._on_step(len(self.results), self._total)


def _parts(work: Work, places: Sequence[int], count: int) -> list[Sequence[int]]:
    """Places in parts, of which a worker is given one at a time.

    A part is one task. For `Together` it holds at most a third of a worker's share of all tasks,
    and groups of tasks take turns.
    """
    if not isinstance(work.function, Together):
        return [[place] for place in places]
    most = min(work.function.most, math.ceil(len(work.tasks) / (3 * count)))
    group = work.function.group
    groups = itertools.groupby(places, lambda i: group(*work.tasks[i]) if group else None)
    divided = [_divided([*some], most) for _, some in groups]
    return [part for turn in itertools.zip_longest(*divided) for part in turn if part]


def _divided(places: Sequence[int], most: int) -> list[Sequence[int]]:
    """Parts of at most `most` places, as few and as alike in size as can be."""
    count = math.ceil(len(places) / most)
    ends = [len(places) * k // count for k in range(count + 1)]
    return [places[first:end] for first, end in itertools.pairwise(ends)]


def gather(
    function: Callable[..., Any] | Together,
    tasks: Sequence[tuple[Any, ...]],
    workers: int | Workers,
    on_step: Callable[[int, int], None],
    on_result: Callable[[Any], None] = lambda result: None,
    lost: Callable[[int, Failure], Any] | None = None,
) -> list[Any]:
    """What function(*task) returns for every task, in the order of the tasks.

    Args:
        function: function(*task) -> result, at the top of a module; or `Together`.
        tasks: Arguments of each call of the function, picklable.
        workers: Number of workers, or `Workers`.
        on_step: Called after each task with the number of finished tasks and that of all.
        on_result: Called with each result as it comes, in no particular order.
        lost: lost(place, failure) -> the result of a task that has none; it may raise. Without it
            the failure is raised.
    """
    workers = workers_from(workers)
    if IMPORTING:
        raise WorkerError(f'{IMPORTING[0]}: expected `if __name__ == "__main__":` around what runs')
    timeout = TIMEOUT if workers.timeout is None else workers.timeout
    work = Work(function, dict(enumerate(tasks)), timeout)
    kept = _Kept(workers, len(tasks), work.packages, on_result, on_step, lost)
    kept.resume()
    todo = [
        place for place in range(len(tasks)) if place not in kept.results and workers.mine(place)
    ]
    parts = _parts(work, todo, workers.count)
    if parts:
        call = Call(work, parts, kept.emit, kept.fail, workers.trials, workers.shared)
        workers.engine_for(len(parts)).run(call, workers.count)
    if workers.shard is not None:
        raise ShardEnd(sum(map(workers.mine, kept.results)), len(tasks))
    return [kept.results[place] for place in range(len(tasks))]
