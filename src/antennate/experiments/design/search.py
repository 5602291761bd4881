"""A search: what is asked is checked, then designs are proposed, run and judged, batch by batch."""

from __future__ import annotations

import functools
import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

from antennate.errors import BadInputError, ConfigError
from antennate.experiments.design.config import Axis, DesignConfig, Goal
from antennate.experiments.design.designs import (
    Design,
    front_of,
    small,
    spread,
    summarise,
    worth_of,
)
from antennate.experiments.design.evaluate import (
    OF_DESIGN,
    Row,
    Task,
    ends_of,
    evaluators,
    run_tasks,
)
from antennate.experiments.design.propose import Drawn, Proposal, package, point_of, propose
from antennate.experiments.study.run import REASON, STATUS, aligned, cells
from antennate.experiments.study.subject import columns_in
from antennate.studies.experiment import Done
from antennate.studies.plan import Point
from antennate.studies.pool import Workers, chunk_of, gather, workers_from
from antennate.studies.trials import OnRow, OnStep, no_row, no_step
from antennate.studies.work import Failure

SEARCH, VALIDATION = "search", "validation"
_LABELS = (*OF_DESIGN, "trial", "seed")
"""Columns that measure nothing."""


def check(config: DesignConfig) -> None:
    """Find what cannot be run before anything is.

    Raises:
        BadInputError: Nothing is searched or judged, a name is unknown, a value out of bounds, an
            objective stands twice, or its experiment has not got it.
        MissingPackageError: Optuna is not installed.
    """
    _check_objectives(config)
    if not config.search:
        raise ConfigError("search: expected parameters, found none: the space is empty")
    for name, axis in config.search.items():
        if not isinstance(axis, Axis) and not axis:
            raise ConfigError(f"search.{name}: expected values, found none: the space is empty")
    ends = list(ends_of(config))
    points = [(f"search.{name}: ", {name: value}) for name, value in ends]
    points += [(f"reference.{name}: ", point) for name, point in config.reference.items()]
    judges = evaluators(config)
    for where, point in points:
        for evaluator in judges:
            evaluator.configured(point, where)
    first = next(iter(config.reference.values()), dict(ends[:1]))
    for evaluator in judges:
        evaluator.check(first)
    package()


def _check_objectives(config: DesignConfig) -> None:
    """Refuse evaluations without objectives, and objectives that stand twice."""
    if not config.evaluate:
        raise ConfigError("evaluate: expected experiments that evaluate a design, found none")
    names = [objective.name for objective in config.objectives()]
    for label, asked in config.evaluate.items():
        if not (asked.maximize or asked.minimize):
            raise ConfigError(
                f"evaluate.{label}: expected measures to maximize or minimize, found none"
            )
    for name in names:
        if names.count(name) > 1:
            raise ConfigError(f"evaluate.{name}: expected an objective once, found it twice")


def run(
    config: DesignConfig,
    workers: int | Workers = 1,
    on_step: OnStep = no_step,
    on_row: OnRow = no_row,
) -> Done:
    """Evaluate the references, search, and validate.

    Raises:
        BadInputError: As for `check`; or the store was begun with another version of Optuna.
        WorkerError: The workers cannot run anything.
    """
    search = Search(config, workers_from(workers), on_step, on_row)
    interrupted = False
    try:
        with search.workers.stay() as search.workers:
            search.begin()
            while len(search.asked) < config.proposals:
                search.proceed()
            search.validate()
    except KeyboardInterrupt:
        interrupted = True
    return search.outcome(interrupted)


@dataclass
class Search:
    """A search that goes on."""

    config: DesignConfig
    workers: Workers
    on_step: OnStep
    on_row: OnRow
    designs: list[Design] = field(default_factory=list)
    asked: list[tuple[Drawn, Design]] = field(default_factory=list)
    """What was drawn, and the design that it is."""
    rows: list[Row] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.objectives = self.config.objectives()
        self.evaluators = evaluators(self.config)
        self.known: dict[str, Design] = {}
        self.unchecked = list(self.evaluators)
        self.before = 0
        self.trials_each = 0

    def begin(self) -> None:
        """Evaluate the references."""
        references = self.config.reference.items()
        self._evaluate([self._design(point, name, True) for name, point in references], SEARCH)

    def proceed(self) -> None:
        """Propose a batch of designs, and evaluate those that are new."""
        count = min(self.config.batch, self.config.proposals - len(self.asked))
        space = self.config.search
        goals: list[Goal] = [objective.goal for objective in self.objectives]
        past: list[Proposal] = []
        for drawn, design in self.asked:
            worth = design.objectives
            values = None if worth is None else [each.value for each in worth.values()]
            past.append(Proposal(drawn, values))
        proposals = self._decided(
            f"proposals.{len(self.asked)}",
            lambda: propose(space, past, goals, count, self.config.seed),
        )
        new: list[Design] = []
        for drawn in proposals:
            point = point_of(space, drawn)
            design = self.known.get(_key(point))
            if design is None:
                design = self._design(point, str(len(self.designs)), False)
                new.append(design)
            self.asked.append((drawn, design))
        self._evaluate(new, SEARCH)

    def validate(self) -> None:
        """Run some of the front again, and the references, on fresh seeds."""
        self._find_front()
        if not self.config.validated:
            return

        def choose() -> list[int]:
            places = [d.design for d in self.designs if d.front and not d.reference]
            first = self.objectives[:1]
            places.sort(key=lambda n: (*small(self.designs[n].objectives or {}, first), n))
            references = [d.design for d in self.designs if d.reference and d.objectives]
            return [*references, *spread(places, self.config.validated)]

        chosen = [self.designs[number] for number in self._decided("validated", choose)]
        self._evaluate(chosen, VALIDATION)

    def outcome(self, interrupted: bool) -> Done:
        """All rows so far, with the same keys, and what they come to."""
        self._find_front()
        found = summarise(
            self.config,
            self.designs,
            self.rows,
            proposed=len(self.asked),
            repeated=len(self.asked) - sum(not design.reference for design in self.designs),
            optuna=package().__version__,
            interrupted=interrupted,
        )
        return Done(aligned(self.rows), found)

    def _design(self, point: Point, name: str, reference: bool) -> Design:
        design = Design(
            design=len(self.designs),
            name=name,
            reference=reference,
            state="unfinished",
            reason="",
            values=dict(point),
            front=False,
            objectives=None,
            fresh=None,
            fresh_front=False,
        )
        self.designs.append(design)
        self.known.setdefault(_key(point), design)
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
        numbered = [task._replace(place=place) for place, task in enumerate(tasks)]
        rows: dict[int, Row] = {}

        def lost(place: int, failure: Failure) -> tuple[int, Row]:
            row = {"trial": tasks[place].trial[1], STATUS: failure.status, REASON: failure.reason}
            return place, row

        def take(item: tuple[int, Row]) -> None:
            place, row = item
            rows[place] = self._labelled(tasks[place], phase, row)
            self.on_row(rows[place])

        self.trials_each = self.trials_each or len(tasks) // max(1, len(designs))
        total = self.before + len(tasks) + self._to_come(phase)
        most = max(evaluator.most for evaluator in self.evaluators)
        chunk = chunk_of(len(tasks), self.workers, most)
        try:
            if tasks:
                how: dict[str, Any] = {"chunk": chunk, "together": True, "lost": lost}
                step = functools.partial(self._step, self.before, total)
                gather(run_tasks, numbered, self.workers, step, take, **how)
        finally:
            self.rows += [rows[place] for place in sorted(rows)]
        self.before += len(tasks)
        self._check_columns()
        for design in designs:
            self._judge(design, phase)

    def _tasks(self, design: Design, phase: str) -> list[Task]:
        fresh = phase == VALIDATION
        times = self.config.validation_factor if fresh else 1
        try:
            pairs = [(e, e.trials(design.values, times, fresh)) for e in self.evaluators]
        except ConfigError as error:
            design.state, design.reason = "refused", str(error)
            return []
        return [
            Task(0, design.design, e.label, e.name, e.judged, config, trial)
            for e, trials in pairs
            for config, trial in trials
        ]

    def _labelled(self, task: Task, phase: str, row: Row) -> Row:
        design = self.designs[task.design]
        values = cells({name: design.values.get(name) for name in self.config.search})
        label = dict(zip(OF_DESIGN, (design.design, design.name, phase, task.label), strict=True))
        return {**label, **values, **row}

    def _judge(self, design: Design, phase: str) -> None:
        if design.state == "refused":
            return
        rows = [r for r in self.rows if r["design"] == design.design and r["phase"] == phase]
        bounds = {
            name: ends
            for evaluator in self.evaluators
            for name, ends in evaluator.bounds(design.values).items()
        }
        worth = worth_of(rows, self.objectives, self.config.least_ok, bounds)
        if phase == VALIDATION:
            design.fresh = worth
        else:
            design.objectives, design.state = worth, "failed" if worth is None else "ok"

    def _check_columns(self) -> None:
        """Find an objective that nothing measures, as soon as there is a row."""
        for evaluator in self.unchecked[:]:
            rows = (r for r in self.rows if r["evaluation"] == evaluator.label)
            row = next((r for r in rows if r[STATUS] in ("ok", "nan")), None)
            if row is not None:
                others = {*self.config.search, *_LABELS}
                evaluator.require(columns_in({n: v for n, v in row.items() if n not in others}))
                self.unchecked.remove(evaluator)

    def _step(self, before: int, total: int, done: int, _: int) -> None:
        self.on_step(before + done, max(total, before + done))

    def _to_come(self, phase: str) -> int:
        """How many trials follow those of a batch, as far as is known."""
        if phase == VALIDATION:
            return 0
        chosen = len(self.config.reference) + self.config.validated
        again = self.config.validation_factor * chosen if self.config.validated else 0
        return self.trials_each * (self.config.proposals - len(self.asked) + again)


def _key(point: Point) -> str:
    return json.dumps(point, sort_keys=True)
