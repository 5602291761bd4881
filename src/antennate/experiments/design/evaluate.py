"""What evaluates a design: experiments with their configurations, trials and rows."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple

from antennate import experiments
from antennate.errors import BadInputError, ConfigError
from antennate.experiments.design.config import OF_SUCCESSES, Axis, DesignConfig, Evaluation
from antennate.experiments.study import measures
from antennate.experiments.study.effects import SUCCESS
from antennate.experiments.study.run import holds, with_status
from antennate.experiments.study.subject import (
    OF_TRIALS,
    OUTCOME,
    Columns,
    find,
    nested,
    numbers,
    table_of,
)
from antennate.messages import nearest, shortened
from antennate.params.base import Params, put_over
from antennate.params.faults import group_of
from antennate.studies.columns import content
from antennate.studies.plan import Point
from antennate.studies.pool import Workers
from antennate.studies.trials import Trial, no_row, no_step

FRESH = 1_000_000
"""Added to a seed, it gives one that no trial of a search has."""
OF_DESIGN = ("design", "name", "phase", "evaluation")
"""Columns that a search fills itself, beside those of a study."""
Row = dict[str, Any]


class Task(NamedTuple):
    """One trial.

    Attributes:
        place: Its place among those of its batch.
        judged: Columns that must be finite numbers.
        trial: Its condition and its number.
    """

    place: int
    design: int
    label: str
    experiment: str
    judged: tuple[str, ...]
    config: Any
    trial: Trial


class Evaluator:
    """One experiment that evaluates designs.

    Args:
        label: Label of the evaluation.
        asked: What the file says of it.
        names: Names of all parameters of a design.

    Attributes:
        judged: Columns that objectives are made of.
        leaves: All parameters of this experiment, dotted.
        reads: Names of a design that are among them.

    Raises:
        BadInputError: There is no such experiment, a name could mean several parameters, or a
            parameter is set twice.
    """

    def __init__(self, label: str, asked: Evaluation, names: Sequence[str]) -> None:
        if not label.replace("-", "_").isidentifier():
            raise ConfigError(
                f"evaluate.{shortened(label)}: expected a label of letters, digits and hyphens"
            )
        self.label, self.name, self._asked = label, asked.experiment or label, asked
        try:
            self._subject = find(self.name)
        except BadInputError as error:
            raise ConfigError(f"evaluate.{label}.{error}") from None
        judged: list[str] = []
        for objective in asked.objectives(label):
            judged.append(OUTCOME if objective.measure == SUCCESS else objective.column)
            judged += [OUTCOME] if objective.of_successes else []
        self.judged = tuple(dict.fromkeys(judged))
        model = self._subject.model
        self.leaves = [] if model is None else list(_leaves(model))
        paths = None if model is None else [p for p in self.leaves if p not in model.unread]
        known_as = {name: name if paths is None else self._path(name, paths) for name in names}
        self._paths = {name: path for name, path in known_as.items() if path is not None}
        self._require_once()

    @property
    def reads(self) -> Sequence[str]:
        """Names of a design that are parameters of this experiment."""
        return list(self._paths)

    @property
    def most(self) -> int:
        """Trials that may be run at once."""
        return self._subject.most

    def _require_once(self) -> None:
        """Refuse a parameter that is searched twice, or searched and set."""
        names: dict[str, str] = {}
        for name, path in self._paths.items():
            if path in names:
                raise ConfigError(
                    f"search.{name}: expected each parameter of {self.name} once, found {path} as "
                    f"search.{names[path]} too"
                )
            names[path] = name
            if holds(self._asked.settings, path):
                raise ConfigError(
                    f"evaluate.{self.label}.settings.{path}: expected none, as search.{name} sets "
                    "it, found one"
                )
        if self._asked.trials is not None and "trials" in self._asked.settings:
            raise ConfigError(
                f"evaluate.{self.label}.settings.trials: expected none beside "
                f"evaluate.{self.label}.trials, found one"
            )

    def _path(self, name: str, paths: Sequence[str]) -> str | None:
        """The parameter of a name: the whole path, or the end of one alone."""
        if name in paths:
            return name
        ends = [path for path in paths if path.endswith(f".{name}")]
        if len(ends) > 1:
            raise ConfigError(
                f"search.{name}: expected one parameter of {self.name}, found {', '.join(ends)}"
            )
        return ends[0] if ends else None

    def configured(self, point: Point, where: str = "") -> Any:
        """The configuration of a design.

        Args:
            point: The design.
            where: The table of a file that holds it, for errors.

        Raises:
            ConfigError: A value is out of bounds, or does not fit another one.
        """
        values = {self._paths[n]: v for n, v in point.items() if n in self._paths}
        settings = put_over(self._asked.settings, nested(values))
        if self._asked.trials is not None and not self._subject.whole:
            settings = put_over(settings, {"trials": self._asked.trials})
        try:
            return self._subject.configured(settings)
        except ConfigError as error:
            if table_of(str(error), self._asked.settings, self._subject) == "settings":
                where = f"evaluate.{self.label}.settings: "
            elif self.label != self.name:
                where += f"evaluate.{self.label}: "
            raise ConfigError(f"{where}{error}") from None

    def bounds(self, point: Point) -> dict[str, tuple[float, float, bool]]:
        """Between which values those of each objective lie, and whether the upper is a failure."""
        values = dict(self.configured(point))
        limits: dict[str, tuple[float, float, bool]] = {}
        for objective in self._asked.objectives(self.label):
            of = measures.measure_of(self.name, objective.column)
            least, most, failure = measures.bounds(of, self.name, values)
            limits[objective.name] = (least, most, failure and not objective.of_successes)
        return limits

    def check(self, point: Point) -> None:
        """Find what cannot be run.

        Raises:
            BadInputError: As for `configured`; or there are several conditions.
        """
        config = self.configured(point)
        self._subject.check(config)
        conditions = dict.fromkeys(name for name, _ in self._subject.trials(config))
        if len(conditions) > 1:
            raise ConfigError(
                f"evaluate.{self.label}.settings: expected one {self._subject.condition}, found "
                f"{shortened(', '.join(conditions))}"
            )
        if self._subject.whole and "seed" not in type(config).model_fields and self._asked.trials:
            raise ConfigError(
                f"evaluate.{self.label}.trials: expected none, as {self.name} has no seed, found "
                f"{self._asked.trials}"
            )
        if self._subject.columns is not None and not self._subject.whole:
            self.require(self._subject.columns)

    def require(self, columns: Columns) -> None:
        """Check that there is a column for each objective, with numbers.

        Raises:
            ConfigError: There is none.
        """
        successes = [n + OF_SUCCESSES for n in columns.numbers if OUTCOME in columns.names]
        for objective in self._asked.objectives(self.label):
            columns.require(objective.measure, f"evaluate.{self.label}", self.name, successes)

    def trials(self, point: Point, times: int = 1, fresh: bool = False) -> list[tuple[Any, Trial]]:
        """Configuration and trial of everything that is run of a design.

        Args:
            point: The design.
            times: How many times the usual number of trials.
            fresh: Whether their seeds are those of no search.
        """
        config, first = self.configured(point), FRESH if fresh else 0
        if not isinstance(config, Params):
            count = times * config.get("trials", 1)
            return [(config, ("", first + i)) for i in range(count)]
        start = getattr(config, "seed", None)
        if self._subject.whole:
            if start is None:
                return [(config, ("", 0))]
            count = times * (self._asked.trials or 1)
            seeds = range(start + first, start + first + count)
            return [(config.model_copy(update={"seed": s}), ("", i)) for i, s in enumerate(seeds)]
        changes = {"trials": times * getattr(config, "trials", 1)}
        changes |= {} if start is None else {"seed": start + first}
        config = config.model_copy(update=changes)
        return [(config, trial) for trial in self._subject.trials(config)]


def evaluators(config: DesignConfig) -> list[Evaluator]:
    """What evaluates each design.

    Raises:
        BadInputError: One cannot be used, or a name is a parameter of none.
    """
    names = list(
        dict.fromkeys([*config.search, *(n for r in config.reference.values() for n in r)])
    )
    judges = [Evaluator(label, asked, names) for label, asked in config.evaluate.items()]
    for name in names:
        where = "search" if name in config.search else "reference"
        if name.rpartition(".")[2] in OF_TRIALS and "." not in name:
            raise ConfigError(f"{where}.{name}: expected a parameter of a design, found {name}")
        if not any(name in evaluator.reads for evaluator in judges):
            paths = [path for evaluator in judges for path in evaluator.leaves]
            raise ConfigError(
                f"{where}: expected a parameter of {', '.join(e.name for e in judges)}"
                f"{nearest(name, paths)}, found {shortened(name)}"
            )
    return judges


def ends_of(config: DesignConfig) -> Iterator[tuple[str, Any]]:
    """Each parameter that is searched with each of its choices, or the ends of its range."""
    for name, axis in config.search.items():
        if not isinstance(axis, Axis):
            yield from ((name, value) for value in axis)
            continue
        whole = (int(axis.low), int(axis.high))
        for end in whole if axis.whole else (axis.low, axis.high):
            counts = axis.entries or ()
            yield from ((name, [end] * count) for count in counts)
            if not counts:
                yield name, end


def run_tasks(tasks: Sequence[Task], emit: Callable[[int, tuple[int, Row]], None]) -> None:
    """Run some trials, those of one design and evaluation at once; emit index, place and row."""
    groups: dict[tuple[int, str], list[int]] = {}
    for index, task in enumerate(tasks):
        groups.setdefault((task.design, task.label), []).append(index)
    for indices in groups.values():
        first = tasks[indices[0]]
        columns = () if isinstance(first.config, Params) else (*OF_DESIGN, *first.config)
        subject = find(first.experiment, columns)
        if subject.whole:
            for index in indices:
                emit(index, (tasks[index].place, _run_whole(tasks[index])))
            continue

        def take(i: int, rows: list[Row], indices: list[int] = indices) -> None:
            task = tasks[indices[i]]
            emit(indices[i], (task.place, with_status(rows[0], task.judged)))

        trials = [tasks[index].trial for index in indices]
        subject.run(first.config, trials, take)


def _run_whole(task: Task) -> Row:
    """An experiment without trials of its own, as one row: what is judged, or all if that lacks."""
    outcome = experiments.load(task.experiment).run(task.config, Workers(1), no_step, no_row)
    known = numbers(content(outcome.result()))
    judged = {name: known[name] for name in task.judged if name in known}
    row = judged if len(judged) == len(set(task.judged)) else known
    start = {"seed": task.config.seed} if hasattr(task.config, "seed") else {}
    return with_status({"trial": task.trial[1], **start, **row}, task.judged)


def _leaves(model: Any, path: str = "") -> Iterator[str]:
    """Every parameter of a configuration by its dotted path."""
    for name, field in model.model_fields.items():
        group = group_of(field.annotation)
        if group is None:
            yield path + name
        else:
            yield from _leaves(group, f"{path}{name}.")
