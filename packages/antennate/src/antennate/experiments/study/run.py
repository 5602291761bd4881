"""Trials of an experiment at every point of a plan."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, cast

from antennate.errors import ConfigError
from antennate.experiments.study import search
from antennate.experiments.study.config import OF_SEARCH, StudyConfig
from antennate.experiments.study.result import summarise
from antennate.experiments.study.subject import (
    OF_STUDY,
    Rows,
    Subject,
    columns_in,
    configurations,
    find,
)
from antennate.experiments.study.tasks import (
    STATUS,
    Key,
    Task,
    aligned,
    cells,
    run_batched,
    run_tasks,
)
from antennate.messages import shortened
from antennate.studies.experiment import Done
from antennate.studies.plan import Point
from antennate.studies.pool import Workers, gather
from antennate.studies.trials import OnRow, OnStep, no_row, no_step
from antennate.studies.work import Failure, Together


def check(config: StudyConfig) -> None:
    """Find what cannot be run before anything is."""
    subject = find(config.experiment)
    _require_names(config, subject)
    _require_read(config)
    _require_use(config, subject)
    if config.plan == "optuna":
        search.check(config, subject)
        return
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


def _require_read(config: StudyConfig) -> None:
    """Check that nothing is given that the plan does not read."""
    drawn = StudyConfig.model_fields
    unused = {
        "random, sobol, morris or optuna": ("points", "seed") * (config.plan in ("grid", "list")),
        "optuna": OF_SEARCH * (config.plan != "optuna"),
        "other than optuna": ("response",) * (config.plan == "optuna"),
    }
    for plan, names in unused.items():
        for name in names:
            if getattr(config, name) != drawn[name].default:
                raise ConfigError(f"{name}: expected plan {plan} beside it, found {config.plan}")


def _require_use(config: StudyConfig, subject: Subject) -> None:
    """Check that nothing is given that another value overrides."""
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
    """What each task is: all trials, point by point; none of a search, whose points follow."""
    if config.plan == "optuna":
        return []
    subject = find(config.experiment)
    return [
        (number, *task)
        for number, (_, configured) in enumerate(configurations(config, subject))
        for task in subject.tasks(configured)
    ]


def _tasks(
    config: StudyConfig, subject: Subject, points: Sequence[tuple[Point, Any]]
) -> list[Task]:
    axes = list(config.axes(subject.model))
    return [
        Task(config.experiment, axes, number, configured, trial)
        for number, (_, configured) in enumerate(points)
        for trial in subject.trials(configured)
    ]


def run(
    config: StudyConfig,
    workers: int | Workers = 1,
    on_step: OnStep = no_step,
    on_row: OnRow = no_row,
) -> Done:
    """Run all trials of all points; the rows come point by point, all with the same keys."""
    if config.plan == "optuna":
        return _searched(config, workers, on_step, on_row)
    subject = find(config.experiment)
    points = configurations(config, subject)
    axes = config.axes(subject.model)
    tasks = _tasks(config, subject, points)
    ended: dict[Key, Rows] = {}
    checked = config.response is None

    def lost(place: int, failure: Failure) -> tuple[Key, Rows]:
        return tasks[place].key, [tasks[place].lost(subject.condition, failure)]

    def take(item: tuple[Key, Rows]) -> None:
        nonlocal checked
        key, rows = item
        ended[key] = rows
        for row in rows:
            if not checked and row[STATUS] in ("ok", "nan"):
                columns_in(row).require(str(config.response), "response", config.experiment)
                checked = True
            on_row({"point": key[0], **row})

    function = Together(run_tasks, subject.most, batched=run_batched)
    interrupted = False
    try:
        gather(function, tasks, workers, on_step, take, lost)
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


def _searched(config: StudyConfig, workers: int | Workers, on_step: OnStep, on_row: OnRow) -> Done:
    """A search in place of the points of a plan."""
    ended = search.search(config, workers, on_step, on_row)
    found = summarise(
        config,
        points=[],
        axes=config.vary,
        condition=ended.subject.condition,
        rows=(rows := ended.table()),
        total=len(rows),
        ended=len(rows),
        interrupted=ended.interrupted,
    )
    return Done(rows, replace(found, search=ended.found()))
