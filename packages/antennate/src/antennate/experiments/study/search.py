"""A search by Optuna: designs are proposed, run and judged, batch by batch, the best once more."""

from __future__ import annotations

import functools
import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

from antennate.errors import BadInputError, ConfigError
from antennate.experiments.study import measures
from antennate.experiments.study.config import StudyConfig
from antennate.experiments.study.designs import (
    OF_SUCCESSES,
    Aim,
    Design,
    Objective,
    Search,
    front_of,
    objectives_of,
    small,
    spread,
    worth_of,
)
from antennate.experiments.study.propose import Drawn, Goal, Proposal, package, point_of, propose
from antennate.experiments.study.subject import (
    OUTCOME,
    Columns,
    Rows,
    Subject,
    columns_in,
    find,
    nested,
)
from antennate.experiments.study.tasks import REASON, STATUS, Key, Task, aligned, cells, run_tasks
from antennate.messages import shortened
from antennate.params.base import Params, put_over
from antennate.studies.plan import Point, Range, require_values
from antennate.studies.pool import Workers, gather, workers_from
from antennate.studies.trials import OnRow, OnStep, Trial
from antennate.studies.work import Failure, Together

FRESH = 1_000_000
"""Added to a seed, it gives one that no trial of a search has."""
SEARCH, VALIDATION = "search", "validation"


def check(config: StudyConfig, subject: Subject) -> None:
    """Find what cannot be run before anything is."""
    names = [objective.name for objective in objectives_of(config)]
    if not names:
        raise ConfigError("maximize: expected measures here or in minimize, found none")
    for name in names:
        if names.count(name) > 1:
            raise ConfigError(f"{name}: expected an objective once, found it twice")
    require_values(config.plan, config.vary)
    points = [(f"vary.{name}: ", {name: value}) for name, value in _ends(config)]
    points += [(f"reference.{name}: ", point) for name, point in config.reference.items()]
    for where, point in points:
        configured(config, subject, point, where)
    first = configured(config, subject, next(iter(config.reference.values()), points[0][1]))
    conditions = dict.fromkeys(name for name, _ in subject.trials(first))
    if len(conditions) > 1:
        raise ConfigError(
            f"settings: expected one {subject.condition}, found {shortened(', '.join(conditions))}"
        )
    if subject.columns is not None:
        require(config, subject.columns)
    package()


def _ends(config: StudyConfig) -> Iterator[tuple[str, Any]]:
    """Each parameter that varies with each of its choices, or the ends of its range."""
    for name, axis in config.vary.items():
        if not isinstance(axis, Range):
            yield from ((name, value) for value in axis)
            continue
        whole = (int(axis.low), int(axis.high))
        for end in whole if axis.whole else (axis.low, axis.high):
            yield from ((name, [end] * count) for count in axis.entries or ())
            if not axis.entries:
                yield name, end


def configured(config: StudyConfig, subject: Subject, point: Point, where: str = "") -> Any:
    """The configuration of a design."""
    trials = {} if config.trials is None else {"trials": config.trials}
    settings = put_over(config.settings, trials)
    try:
        return subject.configured(put_over(settings, nested(point)))
    except ConfigError as error:
        try:
            subject.configured(settings)
        except ConfigError:
            where = "settings: "
        raise ConfigError(f"{where}{error}") from None


def require(config: StudyConfig, columns: Columns) -> None:
    """Check that there is a column of numbers for each objective."""
    successes = [n + OF_SUCCESSES for n in columns.numbers if OUTCOME in columns.names]
    for objective in objectives_of(config):
        columns.require(objective.name, objective.goal, config.experiment, successes)


def trials_of(config: Any, subject: Subject, times: int, fresh: bool) -> tuple[Any, list[Trial]]:
    """The configuration of what is run of a design, and its trials.

    Args:
        config: The configuration of the design.
        subject: What is run.
        times: How many times the usual number of trials; an experiment without any is run once.
        fresh: Whether their seeds are those of no search.
    """
    first = FRESH if fresh else 0
    if not isinstance(config, Params):
        return config, [("", first + i) for i in range(times * config.get("trials", 1))]
    fields = type(config).model_fields
    changes = {"seed": getattr(config, "seed", 0) + first} if "seed" in fields else {}
    if not subject.whole and "trials" in fields:
        changes["trials"] = times * getattr(config, "trials", 1)
    config = config.model_copy(update=changes)
    return config, list(subject.trials(config))


@dataclass
class Searching:
    """A search that goes on."""

    config: StudyConfig
    workers: Workers
    on_step: OnStep
    on_row: OnRow
    designs: list[Design] = field(default_factory=list)
    asked: list[tuple[Drawn, Design]] = field(default_factory=list)
    """What was drawn, and the design that it is."""
    rows: Rows = field(default_factory=list)
    interrupted: bool = False

    def __post_init__(self) -> None:
        self.subject = find(self.config.experiment)
        self.objectives: list[Objective] = objectives_of(self.config)
        self.known: dict[str, Design] = {}
        self.checked = False
        self.before = 0
        self.trials_each = 0

    def run(self) -> None:
        """Evaluate the references, search, and run the best again; an interruption ends it."""
        try:
            with self.workers.stay() as self.workers:
                references = self.config.reference.items()
                self._evaluate([self._design(point, name) for name, point in references], SEARCH)
                while len(self.asked) < self.config.points:
                    self._proceed()
                self._find_front()
                self._validate()
        except KeyboardInterrupt:
            self.interrupted = True
        self._find_front()

    def found(self) -> Search:
        """What the designs come to."""
        proposed = sum(not design.reference for design in self.designs)
        return Search(
            optuna=package().__version__,
            objectives=[Aim.of(each, self.config.experiment) for each in self.objectives],
            proposed=len(self.asked),
            repeated=len(self.asked) - proposed,
            designs=self.designs,
        )

    def table(self) -> Rows:
        """All rows so far, with the same keys."""
        return aligned(self.rows)

    def _proceed(self) -> None:
        """Propose a batch of designs, and evaluate those that are new."""
        count = min(self.config.batch, self.config.points - len(self.asked))
        past: list[Proposal] = []
        for drawn, design in self.asked:
            worth = design.objectives
            values = None if worth is None else [each.value for each in worth.values()]
            past.append(Proposal(drawn, values))
        axes = self.config.vary
        goals: list[Goal] = [objective.goal for objective in self.objectives]
        proposals = self._decided(
            f"proposals.{len(self.asked)}",
            lambda: propose(axes, past, goals, count, self.config.seed),
        )
        new: list[Design] = []
        for drawn in proposals:
            point = point_of(axes, drawn)
            design = self.known.get(json.dumps(point, sort_keys=True))
            if design is None:
                design = self._design(point)
                new.append(design)
            self.asked.append((drawn, design))
        self._evaluate(new, SEARCH)

    def _validate(self) -> None:
        """Run some of the front again, and the references, on fresh seeds."""
        if not self.config.validated:
            return

        def choose() -> list[int]:
            places = [d.point for d in self.designs if d.front and not d.reference]
            first = self.objectives[:1]
            places.sort(key=lambda n: (*small(self.designs[n].objectives or {}, first), n))
            references = [d.point for d in self.designs if d.reference and d.objectives]
            return [*references, *spread(places, self.config.validated)]

        chosen = [self.designs[number] for number in self._decided("validated", choose)]
        self._evaluate(chosen, VALIDATION)

    def _design(self, point: Point, name: str | None = None) -> Design:
        number = len(self.designs)
        design = Design(
            point=number,
            name=str(number) if name is None else name,
            reference=name is not None,
            values=dict(point),
        )
        self.designs.append(design)
        self.known.setdefault(json.dumps(point, sort_keys=True), design)
        return design

    def _find_front(self) -> None:
        for part, mark in (("objectives", "front"), ("fresh", "fresh_front")):
            judged = [design for design in self.designs if getattr(design, part) is not None]
            best = front_of([getattr(d, part) for d in judged], self.objectives)
            for design, on_front in zip(judged, best, strict=True):
                setattr(design, mark, on_front)

    def _decided(self, key: str, make: Callable[[], Any]) -> Any:
        """What was decided before, or else is decided now: read back, it stays as it was."""
        trials = self.workers.trials
        version = package().__version__
        if trials is not None and (record := trials.records.get(key)) is not None:
            if record["optuna"] != version:
                raise BadInputError(
                    f"{trials.path.parent}: expected optuna {record['optuna']}, with which it was "
                    f"begun, found {version}; choose another folder or give --overwrite"
                )
            return record["decided"]
        decision = make()
        if trials is not None:
            trials.append(key, {"optuna": version, "decided": decision})
        return decision

    def _evaluate(self, designs: Sequence[Design], phase: str) -> None:
        """Run all trials of some designs and judge them."""
        tasks = [task for design in designs for task in self._tasks(design, phase)]
        rows: dict[Key, Rows] = {}

        def lost(place: int, failure: Failure) -> tuple[Key, Rows]:
            return tasks[place].key, [tasks[place].lost(self.subject.condition, failure)]

        def take(item: tuple[Key, Rows]) -> None:
            key, found = item
            rows[key] = [self._labelled(key[0], phase, row) for row in found]
            for row in rows[key]:
                self.on_row(row)

        self.trials_each = self.trials_each or len(tasks) // max(1, len(designs))
        total = self.before + len(tasks) + self._to_come(phase)
        try:
            if tasks:
                step = functools.partial(self._step, self.before, total)
                function = Together(run_tasks, self.subject.most)
                gather(function, tasks, self.workers, step, take, lost)
        finally:
            self.rows += [row for task in tasks for row in rows.get(task.key, ())]
        self.before += len(tasks)
        self._check_columns()
        for design in designs:
            self._judge(design, phase)

    def _tasks(self, design: Design, phase: str) -> list[Task]:
        fresh = phase == VALIDATION
        times = self.config.validation_factor if fresh else 1
        try:
            config = configured(self.config, self.subject, design.values)
        except ConfigError as error:
            design.state, design.reason = "refused", str(error)
            return []
        config, trials = trials_of(config, self.subject, times, fresh)
        axes = [*self.config.vary, "name", "phase"]
        return [Task(self.config.experiment, axes, design.point, config, each) for each in trials]

    def _labelled(self, point: int, phase: str, row: dict[str, Any]) -> dict[str, Any]:
        design = self.designs[point]
        values = cells({name: design.values.get(name) for name in self.config.vary})
        return {"point": point, "name": design.name, "phase": phase, **values, **row}

    def _judge(self, design: Design, phase: str) -> None:
        if design.state == "refused":
            return
        rows = [r for r in self.rows if r["point"] == design.point and r["phase"] == phase]
        values = dict(configured(self.config, self.subject, design.values))
        bounds: dict[str, tuple[float, float, bool]] = {}
        for each in self.objectives:
            of = measures.measure_of(self.config.experiment, each.column)
            least, most, failure = measures.bounds(of, self.config.experiment, values)
            bounds[each.name] = (least, most, failure and not each.of_successes)
        worth = worth_of(rows, self.objectives, self.config.least_ok, bounds)
        if phase == VALIDATION:
            design.fresh = worth
        else:
            design.objectives, design.state = worth, "failed" if worth is None else "ok"

    def _check_columns(self) -> None:
        """Find an objective that nothing measures, as soon as there is a row."""
        row = next((r for r in self.rows if r[STATUS] in ("ok", "nan")), None)
        if row is not None and not self.checked:
            others = {*self.config.vary, "point", "name", "phase", STATUS, REASON}
            require(self.config, columns_in({n: v for n, v in row.items() if n not in others}))
            self.checked = True

    def _step(self, before: int, total: int, done: int, _: int) -> None:
        self.on_step(before + done, max(total, before + done))

    def _to_come(self, phase: str) -> int:
        """How many trials follow those of a batch, as far as is known."""
        if phase == VALIDATION:
            return 0
        chosen = len(self.config.reference) + self.config.validated
        again = self.config.validation_factor * chosen if self.config.validated else 0
        return self.trials_each * (self.config.points - len(self.asked) + again)


def search(
    config: StudyConfig, workers: int | Workers, on_step: OnStep, on_row: OnRow
) -> Searching:
    """A search that has ended, or was interrupted."""
    searching = Searching(config, workers_from(workers), on_step, on_row)
    searching.run()
    return searching
