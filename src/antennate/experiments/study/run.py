"""Trials of an experiment at every point of a plan."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from typing import Any, NamedTuple, cast

from antennate.errors import ConfigError, SceneError, SimulationError
from antennate.experiments.study.config import StudyConfig
from antennate.experiments.study.result import summarise
from antennate.experiments.study.subject import (
    OF_STUDY,
    EmitRows,
    Rows,
    Subject,
    columns_in,
    configurations,
    find,
)
from antennate.messages import shortened
from antennate.studies.experiment import Done
from antennate.studies.plan import Point
from antennate.studies.pool import Workers, chunk_of, gather
from antennate.studies.trials import OnRow, OnStep, Trial, no_row, no_step
from antennate.studies.work import Fail, Failure

STATUS, REASON = "status", "reason"
_Key = tuple[int, str, int]
"""What a task is, whatever the number of trials: its point, condition and trial."""
_Emit = Callable[[int, tuple[_Key, Rows]], None]


class _Task(NamedTuple):
    """A trial of what is studied, which varies in some axes: at a point, with its configuration."""

    experiment: str
    axes: Sequence[str]
    point: int
    config: Any
    trial: Trial

    @property
    def key(self) -> _Key:
        return self.point, *self.trial


def check(config: StudyConfig) -> None:
    """Find what cannot be run before anything is.

    Raises:
        BadInputError: There is no such experiment, a parameter or the response is unknown, the plan
            is empty, or a point of it is out of bounds.
    """
    subject = find(config.experiment)
    _require_names(config, subject)
    _require_use(config, subject)
    (_, first), *_ = configurations(config, subject)
    try:
        subject.check(first)
    except ConfigError as error:
        raise ConfigError(f"{config.experiment}: {error}") from None
    if subject.columns is not None and config.response is not None:
        subject.columns.require(config.response, "response", config.experiment)


def _require_names(config: StudyConfig, subject: Subject) -> None:
    """Check that what varies has names of its own; those of an experiment are its parameters."""
    for name in config.vary if subject.model is None else ():
        if name in OF_STUDY or not (name and name.isprintable()):
            why = "as the study has this column" if name in OF_STUDY else "of letters that show"
            raise ConfigError(f"vary.{shortened(name)}: expected another name, {why}")


def _require_use(config: StudyConfig, subject: Subject) -> None:
    """Check that nothing is given that another value overrides or that the plan does not read."""
    drawn = StudyConfig.model_fields
    for name in ("points", "seed") if config.plan in ("grid", "list") else ():
        if getattr(config, name) != drawn[name].default:
            raise ConfigError(
                f"{name}: expected plan random, sobol or morris beside it, found {config.plan}"
            )
    if config.assumed is None and config.leave_out:
        raise ConfigError("leave_out: expected assumed beside it, found none")
    if config.assumed is not None and subject.model is None:
        raise ConfigError(
            f"assumed: expected an experiment, found {config.experiment}, whose parameters have no "
            "sources"
        )
    for table, names in (("settings", config.settings), ("vary", config.vary)):
        if config.trials is not None and "trials" in names:
            raise ConfigError(f"{table}.trials: expected none beside trials = {config.trials}")
    axes = config.axes(subject.model)
    for name in axes:
        if within := [other for other in axes if other.startswith(f"{name}.")]:
            raise ConfigError(
                f"vary.{within[0]}: expected a parameter of no group that varies as a whole, "
                f"found {name} too"
            )
        if holds(config.settings, name):
            also = "vary" if name in config.vary else "assumed; leave_out keeps its value"
            raise ConfigError(
                f"settings.{name}: expected a parameter that does not vary, found it in {also}"
            )


def holds(settings: Mapping[str, Any], name: str) -> bool:
    """Whether nested tables have a value at a dotted name."""
    inner: Any = settings
    for part in name.split("."):
        if not isinstance(inner, Mapping) or part not in inner:
            return False
        inner = cast("Mapping[str, Any]", inner)[part]
    return True


def planned(config: StudyConfig) -> list[tuple[Any, ...]]:
    """What each task is: all trials, point by point."""
    subject = find(config.experiment)
    return [
        (number, *task)
        for number, (_, configured) in enumerate(configurations(config, subject))
        for task in subject.tasks(configured)
    ]


def _tasks(
    config: StudyConfig, subject: Subject, points: Sequence[tuple[Point, Any]]
) -> list[_Task]:
    axes = list(config.axes(subject.model))
    return [
        _Task(config.experiment, axes, number, configured, trial)
        for number, (_, configured) in enumerate(points)
        for trial in subject.trials(configured)
    ]


def run(
    config: StudyConfig,
    workers: int | Workers = 1,
    on_step: OnStep = no_step,
    on_row: OnRow = no_row,
) -> Done:
    """Run all trials of all points; the rows come point by point, all with the same keys.

    Raises:
        BadInputError: As for `check`.
        WorkerError: The workers cannot run anything.
    """
    subject = find(config.experiment)
    points = configurations(config, subject)
    axes = config.axes(subject.model)
    tasks = _tasks(config, subject, points)
    ended: dict[_Key, Rows] = {}
    checked = config.response is None

    def lost(place: int, failure: Failure) -> tuple[_Key, Rows]:
        condition, trial = tasks[place].trial
        row = {"trial": trial, STATUS: failure.status, REASON: failure.reason}
        return tasks[place].key, [
            ({subject.condition: condition} if subject.condition else {}) | row
        ]

    def take(item: tuple[_Key, Rows]) -> None:
        nonlocal checked
        key, rows = item
        ended[key] = rows
        for row in rows:
            if not checked and row[STATUS] in ("ok", "nan"):
                columns_in(row).require(str(config.response), "response", config.experiment)
                checked = True
            on_row({"point": key[0], **row})

    chunk = chunk_of(len(tasks), workers, subject.most)
    interrupted = False
    try:
        gather(
            _run,
            tasks,
            workers,
            on_step,
            take,
            chunk=chunk,
            together=True,
            lost=lost,
            batched=_run_batched,
        )
    except KeyboardInterrupt:
        interrupted = True
    rows = aligned(
        [  # in the order of the plan
            {"point": task.point, **cells(points[task.point][0]), **row}
            for task in tasks
            for row in ended.get(task.key, ())
        ]
    )
    found = summarise(
        config,
        points=[point for point, _ in points],
        axes=axes,
        condition=subject.condition,
        rows=rows,
        total=len(tasks),
        ended=len(ended),
        interrupted=interrupted,
    )
    return Done(rows, found)


def _run(tasks: Sequence[_Task], emit: _Emit) -> None:
    """Run some trials, those of one point at once."""
    subject = find(tasks[0].experiment, tasks[0].axes)
    for _, config, trials, take in _by_point(tasks, emit):
        subject.run(config, trials, take)


def _run_batched(tasks: Sequence[_Task], emit: _Emit, fail: Fail, device: str | None) -> None:
    """The same on a GPU, a batch for each point; a point that cannot be run fails alone."""
    subject, ended = find(tasks[0].experiment, tasks[0].axes), set[int]()

    def note(index: int, result: tuple[_Key, Rows]) -> None:
        ended.add(index)
        emit(index, result)

    for indices, config, trials, take in _by_point(tasks, note):
        try:
            subject.run_on_device(config, trials, take, device)
        except (SceneError, SimulationError) as error:
            for index in [i for i in indices if i not in ended]:
                fail(index, Failure("failed", str(error), error))


def _by_point(
    tasks: Sequence[_Task], emit: _Emit
) -> Iterator[tuple[list[int], Any, list[Trial], EmitRows]]:
    """For each point indices of its tasks, configuration, trials, and what takes their rows."""
    points: dict[int, list[int]] = {}
    for index, task in enumerate(tasks):
        points.setdefault(task.point, []).append(index)
    for indices in points.values():

        def take(i: int, rows: Rows, indices: list[int] = indices) -> None:
            emit(indices[i], (tasks[indices[i]].key, [with_status(row) for row in rows]))

        yield indices, tasks[indices[0]].config, [tasks[index].trial for index in indices], take


def with_status(row: Mapping[str, Any], judged: Collection[str] = ()) -> dict[str, Any]:
    """A row that says whether its numbers may be used: ok, invalid or nan.

    Args:
        row: The row.
        judged: Columns that are looked at, all if there are none.
    """
    looked = {name: v for name, v in row.items() if not judged or name in judged}
    bad = [name for name, v in looked.items() if isinstance(v, float) and not math.isfinite(v)]
    status = "invalid" if row.get("outcome") == "invalid" else "nan" if bad else "ok"
    reason = row.get(REASON) or (f"not finite: {', '.join(bad)}" if status == "nan" else "")
    return {**row, STATUS: status, REASON: reason}


def aligned(rows: Rows) -> Rows:
    """The same rows, each with the columns of all, status and reason last."""
    columns = dict.fromkeys(name for row in rows for name in row if name not in (STATUS, REASON))
    return [{n: row.get(n) for n in (*columns, STATUS, REASON)} for row in rows]


def cells(point: Point) -> dict[str, Any]:
    """The values of a point as cells of a table: lists as text."""
    return {
        name: " ".join(map(str, value)) if isinstance(value, list | tuple) else value
        for name, value in point.items()
    }
