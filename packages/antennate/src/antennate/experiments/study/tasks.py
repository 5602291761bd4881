"""Trials of a study at its points: what one is, running some of them, and their rows."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from antennate.errors import SceneError, SimulationError
from antennate.experiments.study.subject import EmitRows, Rows, find
from antennate.studies.plan import Point
from antennate.studies.trials import Trial
from antennate.studies.work import Fail, Failure

STATUS, REASON = "status", "reason"
Key = tuple[int, str, int]
"""What a task is, whatever the number of trials: its point, condition and trial."""
Emit = Callable[[int, tuple[Key, Rows]], None]


class Task(NamedTuple):
    """A trial of what is studied, which varies in some axes: at a point, with its configuration."""

    experiment: str
    axes: Sequence[str]
    point: int
    config: Any
    trial: Trial

    @property
    def key(self) -> Key:
        """Point, condition and trial."""
        return self.point, *self.trial

    def lost(self, condition: str, failure: Failure) -> dict[str, Any]:
        """The row of a trial that gave none; `condition` is the column of its condition, if any."""
        name, trial = self.trial
        row = {"trial": trial, STATUS: failure.status, REASON: failure.reason}
        return ({condition: name} if condition else {}) | row


def run_tasks(tasks: Sequence[Task], emit: Emit) -> None:
    """Run some trials, those of one point at once."""
    subject = find(tasks[0].experiment, tasks[0].axes)
    for _, config, trials, take in _by_point(tasks, emit):
        subject.run(config, trials, take)


def run_batched(tasks: Sequence[Task], emit: Emit, fail: Fail, device: str | None) -> None:
    """Run some trials on a GPU, a batch for each point; a point that cannot be run fails alone."""
    subject, ended = find(tasks[0].experiment, tasks[0].axes), set[int]()

    def note(index: int, result: tuple[Key, Rows]) -> None:
        ended.add(index)
        emit(index, result)

    for indices, config, trials, take in _by_point(tasks, note):
        try:
            subject.run_on_device(config, trials, take, device)
        except (SceneError, SimulationError) as error:
            for index in [i for i in indices if i not in ended]:
                fail(index, Failure("failed", str(error), error))


def _by_point(
    tasks: Sequence[Task], emit: Emit
) -> Iterator[tuple[list[int], Any, list[Trial], EmitRows]]:
    """For each point indices of its tasks, configuration, trials, and what takes their rows."""
    points: dict[int, list[int]] = {}
    for index, task in enumerate(tasks):
        points.setdefault(task.point, []).append(index)
    for indices in points.values():

        def take(i: int, rows: Rows, indices: list[int] = indices) -> None:
            emit(indices[i], (tasks[indices[i]].key, [with_status(row) for row in rows]))

        yield indices, tasks[indices[0]].config, [tasks[index].trial for index in indices], take


def with_status(row: Mapping[str, Any]) -> dict[str, Any]:
    """A row that says whether its numbers may be used: ok, invalid or nan."""
    bad = [name for name, v in row.items() if isinstance(v, float) and not math.isfinite(v)]
    status = "invalid" if row.get("outcome") == "invalid" else "nan" if bad else "ok"
    reason = row.get(REASON) or (f"not finite: {', '.join(bad)}" if status == "nan" else "")
    return {**row, STATUS: status, REASON: reason}


def aligned(rows: Rows) -> Rows:
    """The rows, each with the columns of all, status and reason last."""
    columns = dict.fromkeys(name for row in rows for name in row if name not in (STATUS, REASON))
    return [{n: row.get(n) for n in (*columns, STATUS, REASON)} for row in rows]


def cells(point: Point) -> dict[str, Any]:
    """The values of a point as cells of a table: lists as text."""
    return {
        name: " ".join(map(str, value)) if isinstance(value, list | tuple) else value
        for name, value in point.items()
    }
