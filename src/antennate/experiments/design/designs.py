"""Designs, what they are worth, which are the best trade-offs, and what came out of a search."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from antennate.experiments.design.config import DesignConfig, Goal, Objective
from antennate.experiments.design.evaluate import Row
from antennate.experiments.study import measures
from antennate.experiments.study.effects import SUCCESS
from antennate.experiments.study.run import STATUS
from antennate.experiments.study.subject import OUTCOME
from antennate.studies import statistics
from antennate.studies.columns import Ends, column, tabular
from antennate.studies.plan import Point
from antennate.types import Bools, Floats

State = Literal["ok", "failed", "refused", "unfinished"]


@tabular
class Value:
    """What a design is worth in an objective."""

    value: float | None = column(interval="value95")
    """Mean over the trials, or share of successes; `null` for a mean over successes without any.
    Its interval is `null` for a mean over fewer than five trials."""
    value95: Ends | None
    trials: int
    """Trials behind it."""


@dataclass(kw_only=True)
class Design:
    """A design: a reference, or one that was proposed."""

    design: int
    """Number in the order of the run."""
    name: str
    """Name of a reference, else the number."""
    reference: bool
    """Whether it is a reference."""
    state: State
    """`ok` if it was judged, `failed` with too few trials that are ok, `refused` if it could not be
    configured, `unfinished` if the run was interrupted."""
    reason: str
    """Why it was refused."""
    values: Point
    """Value of each parameter that is searched, by dotted name; of a reference those it states."""
    front: bool
    """Whether no other design is better, by the trials of the search."""
    objectives: dict[str, Value] | None
    """Each objective in the search, by name; `null` if the design was not judged."""
    fresh: dict[str, Value] | None
    """Each objective on fresh seeds; `null` if the design was not validated."""
    fresh_front: bool
    """Whether none of those that were validated is better on fresh seeds."""


@tabular
class Aim:
    """An objective, with its unit."""

    name: str
    """Label of the evaluation and measure, as `wall.success_share`."""
    goal: Goal
    """`maximize` or `minimize`."""
    title: str
    """What is measured, with the unit shown."""
    scale: float
    """Factor from the values of the designs to that unit."""


@tabular
class DesignResult:
    """What a search comes to."""

    schema: int = 1
    command: str = "design"
    interrupted: bool
    optuna: str
    """Version of Optuna, which proposed the designs."""
    objectives: list[Aim]
    """What designs are judged by."""
    axes: list[str]
    """Parameters that are searched, by dotted name."""
    proposed: int
    """Designs that were proposed, those that came again among them."""
    repeated: int
    """Designs among these that came again and were not run again."""
    trials: int
    """Trials that have ended."""
    statuses: dict[str, int]
    designs: list[Design]
    """The references, then the proposals."""


def summarise(
    config: DesignConfig,
    designs: Sequence[Design],
    rows: Sequence[Row],
    proposed: int,
    repeated: int,
    optuna: str,
    interrupted: bool,
) -> DesignResult:
    """What the designs and the rows of a search come to."""
    statuses = [row[STATUS] for row in rows]
    return DesignResult(
        interrupted=interrupted,
        optuna=optuna,
        objectives=[_aim(config, objective) for objective in config.objectives()],
        axes=list(config.search),
        proposed=proposed,
        repeated=repeated,
        trials=len(rows),
        statuses={name: statuses.count(name) for name in sorted(set(statuses))},
        designs=[*designs],
    )


def _aim(config: DesignConfig, objective: Objective) -> Aim:
    """An objective with what it is called, and its unit."""
    experiment = config.evaluate[objective.label].experiment or objective.label
    measure = measures.measure_of(experiment, objective.column)
    if objective.of_successes:
        measure = replace(measure, label=f"{measure.label} (successes only)")
    several = len(config.evaluate) > 1
    return Aim(
        name=objective.name,
        goal=objective.goal,
        title=f"{objective.label}: {measure.title}" if several else measure.title,
        scale=measure.scale,
    )


def worth_of(
    rows: Sequence[Row],
    objectives: Sequence[Objective],
    least_ok: float,
    bounds: Mapping[str, tuple[float, float, bool]] | None = None,
) -> dict[str, Value] | None:
    """The value of each objective, by name; None if too few trials are ok.

    Args:
        rows: Rows of all trials of a design, each with its `evaluation`.
        objectives: What the design is judged by.
        least_ok: Least share of the trials of each evaluation that must be ok.
        bounds: Between which values those of an objective lie, and whether the upper one stands
            for a failure, by its name; any if not given.
    """
    values_by_name: dict[str, Value] = {}
    for objective in objectives:
        name = OUTCOME if objective.measure == SUCCESS else objective.column
        trials = [row for row in rows if row["evaluation"] == objective.label]
        needed = OUTCOME if objective.of_successes else name
        known = [r for r in trials if r[STATUS] == "ok" and r.get(needed) is not None]
        if not known or len(known) < least_ok * len(trials) - 1e-9:
            return None
        if objective.of_successes:
            known = [r for r in known if r[OUTCOME] == "success" and r.get(name) is not None]
        values = [row[name] for row in known]
        between = (bounds or {}).get(objective.name, (-math.inf, math.inf, False))
        if not values:
            value, interval = None, None
        elif name == OUTCOME:
            won = sum(outcome == "success" for outcome in values)
            value, interval = won / len(values), statistics.wilson95(won, len(values))
        else:
            value, interval = statistics.mean95(np.array(values, float), *between)
        values_by_name[objective.name] = Value(value=value, value95=interval, trials=len(values))
    return values_by_name


def small(worth: Mapping[str, Value], objectives: Sequence[Objective]) -> list[float]:
    """Objectives as numbers that shall be small; infinity where there is no value."""
    values = [(worth[objective.name].value, objective.sign) for objective in objectives]
    return [math.inf if value is None else sign * value for value, sign in values]


def front_of(worths: Sequence[Mapping[str, Value]], objectives: Sequence[Objective]) -> list[bool]:
    """Which of some designs are Pareto-optimal, from the values of their objectives."""
    values = np.array([small(worth, objectives) for worth in worths])
    return front(values.reshape(len(worths), len(objectives))).tolist()


def front(values: Floats) -> Bools:
    """Which of some designs are Pareto-optimal.

    A design is dominated if another one is as good in every objective and better in one. Of equal
    designs none dominates the other.

    Args:
        values: Each objective of each design, small is good, shape (n, m).

    Returns:
        Whether no other dominates it, shape (n,).
    """
    not_worse = np.all(values[:, None] <= values[None], axis=2)
    better = np.any(values[:, None] < values[None], axis=2)
    return np.logical_not(np.any(not_worse & better, axis=0))


def spread(places: Sequence[int], count: int) -> list[int]:
    """At most so many of a row of designs, evenly along it, both ends among them."""
    if len(places) <= count:
        return list(places)
    if count == 1:
        return [places[len(places) // 2]]
    steps = np.arange(count) * (len(places) - 1) / (count - 1)
    return [places[math.floor(step + 0.5)] for step in steps]
