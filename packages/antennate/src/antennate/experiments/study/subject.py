"""What a study runs: an experiment trial by trial, an experiment as a whole, or a function."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import asdict, dataclass, fields, is_dataclass
from enum import Enum
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import BaseModel, ValidationError

from antennate import experiments
from antennate.errors import BadInputError, ConfigError
from antennate.experiments.study.config import StudyConfig
from antennate.experiments.study.effects import SUCCESS
from antennate.lookup import Registry
from antennate.messages import nearest, shortened, shown
from antennate.params.base import ALLOWED, Params, put_over, with_bases
from antennate.params.faults import describe
from antennate.studies.columns import condition_of, content
from antennate.studies.engines import NO_BATCHES
from antennate.studies.experiment import Experiment
from antennate.studies.plan import Point
from antennate.studies.pool import Workers
from antennate.studies.trials import Trial, no_row, no_step

Rows = list[dict[str, Any]]
OUTCOME = "outcome"
"""Column that tells whether a trial succeeded."""
OF_TRIALS = ("trials", "trial", "seed")
"""Parameters and columns that say which trials there are."""
MOST_TRIALS = 1_000_000
"""Most trials of a study: the driver has all of them in memory."""
_MOST_NAMED = 12
_LONGEST = 100
"""Most entries of a list in a result that have columns."""
FUNCTIONS: Registry[Callable[..., Any]] = Registry("trial function", "antennate.trials", {})
"""Functions trial(config, seed) -> row: config holds the parameters by name, seed is a number."""
OF_STUDY = ("point", "trial", "seed", "status", "reason")
"""Columns that a study fills itself."""
EmitRows = Callable[[int, Rows], None]


def find(name: str, axes: Collection[str] = ()) -> Subject:
    """What a study names.

    Args:
        name: An experiment or a function.
        axes: Names of what varies; a function may have no such column.
    """
    if name in experiments.names():
        return _ExperimentSubject(experiments.load(name))
    if ":" in name or name in FUNCTIONS.added:
        return _FunctionSubject(name, axes)
    raise BadInputError(f"experiment: {experiments.unknown(name)}")


def configurations(config: StudyConfig, subject: Subject) -> list[tuple[Point, Any]]:
    """Every point with its configuration."""
    settings = put_over(config.settings, {} if config.trials is None else {"trials": config.trials})
    for name in config.vary:
        _require_groups(settings, name)
    pairs: list[tuple[Point, Any]] = []
    assumed = config.axes(subject.model).keys() - config.vary.keys()
    points = config.points_of(subject.model)
    if (count := len(points) * (config.trials or 1)) > MOST_TRIALS:
        raise ConfigError(f"trials: expected at most {MOST_TRIALS} at all points, found {count}")
    for point in points:
        try:
            pairs.append((point, subject.configured(put_over(settings, nested(point)), assumed)))
        except ConfigError as error:
            raise ConfigError(f"{table_of(str(error), settings, subject)}: {error}") from None
    return pairs


def _require_groups(settings: Mapping[str, Any], name: str) -> None:
    """Check that settings hold no value where a name that varies has a group."""
    group, *parts = name.split(".")
    inner: Any = settings
    for part in parts:
        inner = inner.get(group, {}) if isinstance(inner, Mapping) else inner
        if not isinstance(inner, Mapping):
            raise ConfigError(
                f"settings.{group}: expected a table, as {name} varies, found {shown(inner)}"
            )
        group = part


def table_of(fault: str, settings: Mapping[str, Any], subject: Subject) -> str:
    """The table of a file that a fault of a point is in."""
    try:
        subject.configured(settings)
    except ConfigError as error:
        if fault.startswith(str(error).partition(" (and ")[0]):
            return "settings"
    return "vary"


@dataclass(frozen=True)
class Columns:
    """Names of the columns of rows.

    Attributes:
        names: All of them.
        numbers: Those of numbers that are measured.
    """

    names: Sequence[str]
    numbers: Sequence[str]

    def require(self, measure: str, where: str, of: str, more: Sequence[str] = ()) -> None:
        """Check that a measure is a column of numbers, or the share of successes.

        Args:
            measure: Its name.
            where: Where it is asked for.
            of: The experiment.
            more: Further names that are measures.
        """
        known = [SUCCESS, *self.numbers] if OUTCOME in self.names else self.numbers
        if measure not in (*known, *more):
            listed = f"{', '.join(known[:_MOST_NAMED])}{', ...' * (len(known) > _MOST_NAMED)}"
            raise ConfigError(
                f"{where}: expected a measure of {of}{nearest(measure, [*known, *more])}, one of "
                f"{listed}; found {shortened(measure)}"
            )


def columns_of(row: type) -> Columns:
    """The columns of rows of a class."""
    kinds: dict[str, str] = {}
    for field in fields(row):
        text = field.type if isinstance(field.type, str) else getattr(field.type, "__name__", "")
        kinds[field.name] = text.partition(" ")[0]
    numbers = [n for n, k in kinds.items() if k in ("float", "int") and n not in OF_TRIALS]
    return Columns(list(kinds), numbers)


def columns_in(row: Mapping[str, Any]) -> Columns:
    """The columns of a row."""
    numbers = [n for n, v in row.items() if isinstance(v, float | int | None)]
    return Columns(list(row), [n for n in numbers if n not in OF_TRIALS])


def nested(point: Point) -> dict[str, Any]:
    """Dotted names as nested tables."""
    tables: dict[str, Any] = {}
    for name, value in point.items():
        inner = value
        for part in reversed(name.split(".")):
            inner = {part: inner}
        tables = put_over(tables, inner)
    return tables


class _ExperimentSubject:
    """An experiment, trial by trial if it has trials, else as a whole.

    Attributes:
        condition: Column of its rows that tells the condition; empty without.
        most: Trials that may be run at once.
        whole: Whether it has no trials of its own.
        columns: Columns of its rows; None if they are not known before it is run.
    """

    def __init__(self, experiment: Experiment[Any, Any]) -> None:
        self._experiment, self._trials = experiment, experiment.trials
        self.model: type[Params] | None = experiment.config
        self.condition = condition_of(self._trials.row) if self._trials else ""
        self.most = self._trials.batches.most if self._trials else 1
        self.whole = self._trials is None
        self.columns = columns_of(experiment.row) if experiment.row else None

    def configured(self, values: Mapping[str, Any], allowed: Collection[str] = ()) -> Params:
        """The configuration from nested values; `allowed` may differ though nothing reads them."""
        model = self._experiment.config
        text = json.dumps(with_bases(values, model, Path()), default=_plain)
        try:
            config = model.model_validate_json(text, strict=True, context={ALLOWED: allowed})
        except ValidationError as error:
            raise ConfigError(f"{self._experiment.name}: {describe(error, model)}") from None
        return config

    def check(self, config: Any) -> None:
        self._experiment.settled(config, None)

    def trials(self, config: Any) -> Sequence[Trial]:
        """All of them, in the order of its table."""
        return self._trials.every(config) if self._trials else [("", 0)]

    def tasks(self, config: Any) -> Sequence[Any]:
        """What each trial is, whatever the number of trials."""
        tasks = self._experiment.tasks if self._trials else None
        return tasks(config) if tasks else self.trials(config)

    def run(self, config: Any, trials: Sequence[Trial], emit: EmitRows) -> None:
        """Run some trials; emit the index and the rows of each."""
        if self._trials is not None:
            self._trials.run(config, trials, lambda i, row: emit(i, [asdict(row)]))
            return
        outcome = self._experiment.run(config, Workers(1), no_step, no_row)
        emit(0, [asdict(row) for row in outcome.rows] or [numbers(content(outcome.result()))])

    def run_on_device(
        self, config: Any, trials: Sequence[Trial], emit: EmitRows, device: str | None
    ) -> None:
        """Run some trials on a GPU or another device of Warp; emit as `run` does."""
        if self._trials is None or self._trials.batches.gpu is None:
            raise ConfigError(f"{NO_BATCHES}; {self._experiment.name} has none")
        self._trials.run_on_device(config, trials, lambda i, row: emit(i, [asdict(row)]), device)


class _FunctionSubject:
    """A function trial(config, seed) -> row; it takes any parameters."""

    model: type[Params] | None = None
    condition = ""
    most = 1
    whole = False
    columns: Columns | None = None

    def __init__(self, name: str, axes: Collection[str]) -> None:
        self._function, self._axes = FUNCTIONS.find(name), axes

    def configured(
        self, values: Mapping[str, Any], allowed: Collection[str] = ()
    ) -> Mapping[str, Any]:
        return values

    def check(self, config: Any) -> None:
        pass

    def trials(self, config: Any) -> Sequence[Trial]:
        return [("", seed) for seed in range(config.get("trials", 1))]

    def tasks(self, config: Any) -> Sequence[Any]:
        return self.trials(config)

    def run(self, config: Any, trials: Sequence[Trial], emit: EmitRows) -> None:
        values = {name: value for name, value in config.items() if name != "trials"}
        for i, (_, seed) in enumerate(trials):
            emit(i, [{"trial": seed, **own_row(self._function(values, seed), self._axes)}])

    def run_on_device(
        self, config: Any, trials: Sequence[Trial], emit: EmitRows, device: str | None
    ) -> None:
        raise ConfigError(f"{NO_BATCHES}; a function of your own has none")


Subject = _ExperimentSubject | _FunctionSubject
"""What is run at each point."""


def _plain(value: Any) -> Any:
    return value.model_dump(mode="json") if isinstance(value, BaseModel) else str(value)


def plain(values: Any) -> Any:
    """Values given in Python as a file would hold them."""
    return json.loads(json.dumps(values, default=_plain))


def numbers(result: Mapping[str, Any], path: str = "") -> dict[str, Any]:
    """Numbers and texts of a result as one row, by dotted name; entries of lists count from 0."""
    row: dict[str, Any] = {}
    for key, value in result.items():
        if isinstance(value, list | tuple) and len(value) <= _LONGEST:
            row |= numbers({str(i): item for i, item in enumerate(value)}, f"{path}{key}.")
        elif isinstance(value, Mapping):
            row |= numbers(value, f"{path}{key}.")
        elif value is None or isinstance(value, str | int | float):
            row[path + key] = value
    return row


def own_row(result: Any, taken: Collection[str] = ()) -> dict[str, Any]:
    """What a function returned as a row of plain values.

    Args:
        result: A dictionary or a dataclass. Scalars of NumPy become numbers, arrays lists.
        taken: Names of what varies, which are columns of the study as well.
    """
    if is_dataclass(result) and not isinstance(result, type):
        result = asdict(result)
    if not isinstance(result, Mapping):
        kind = type(result).__name__
        raise BadInputError(f"expected a row as a dictionary or a dataclass, found {kind}")
    row: dict[str, Any] = {}
    for name, value in result.items():
        if not isinstance(name, str):
            kind = type(name).__name__
            raise BadInputError(f"expected names of columns as text, found {kind}")
        if name in OF_STUDY or name in taken:
            raise BadInputError(
                f"column {shortened(name)}: expected another name, as the study has this column"
            )
        try:
            text = json.dumps({name: value}, default=_as_json, ensure_ascii=False)
            row |= json.loads(text.encode(), parse_int=_whole)
        except ValueError as error:
            raise BadInputError(f"column {shortened(name)}: {error}") from None
    return row


def _as_json(value: Any) -> Any:
    """What JSON can hold of a value that it does not know."""
    match value:
        case Enum():
            return value.value
        case np.ndarray() | np.generic():
            return value.tolist()
        case Mapping():
            return dict(value)
    kind = type(value).__name__  # its own text may be long, or raise
    raise ValueError(f"expected numbers or text, found an object of type {kind}")


def _whole(digits: str) -> int | float:
    """A whole number; infinity where no float is so large."""
    return int(digits) if math.isfinite(float(digits)) else float(digits)
