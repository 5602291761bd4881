"""What a design is worth, and which designs are the best trade-offs."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from antennate.experiments.design.config import Objective
from antennate.experiments.design.evaluate import OUTCOME
from antennate.experiments.study import labels
from antennate.experiments.study.measures import SUCCESS
from antennate.experiments.study.run import STATUS
from antennate.studies import statistics
from antennate.studies.measures import Measure
from antennate.types import Bools, Floats

Value = Mapping[str, Any]
"""`value` of an objective, its interval `value95` (None of few trials), its number of `trials`. The
value is None if it is that of successes and there are none."""


def measure_of(objective: Objective, experiment: str) -> Measure:
    """What an objective is called, and its unit."""
    found = labels.measure_of(experiment, objective.column)
    label = found.label + (" (successes only)" if objective.of_successes else "")
    return dataclasses.replace(found, label=label)


def worth(
    rows: Sequence[Mapping[str, Any]],
    objectives: Sequence[Objective],
    least_ok: float,
    bounds: Mapping[str, tuple[float, float, bool]] | None = None,
) -> dict[str, Value] | None:
    """The value of each objective, by name; None if too few trials are ok.

    Args:
        rows: Rows of all trials of a design, each with its `evaluation`.
        objectives: What is told.
        least_ok: Least share of the trials of each evaluation that must be ok.
        bounds: Between which values those of an objective lie, and whether the upper one stands
            for a failure, by its name; any if not given.
    """
    found: dict[str, Value] = {}
    for objective in objectives:
        column = OUTCOME if objective.measure == SUCCESS else objective.column
        mine = [row for row in rows if row["evaluation"] == objective.label]
        told = OUTCOME if objective.of_successes else column
        known = [r for r in mine if r[STATUS] == "ok" and r.get(told) is not None]
        if not known or len(known) < least_ok * len(mine) - 1e-9:
            return None
        if objective.of_successes:
            known = [r for r in known if r[OUTCOME] == "success" and r.get(column) is not None]
        values = [row[column] for row in known]
        between = (bounds or {}).get(objective.name, (-math.inf, math.inf, False))
        found[objective.name] = _share(values) if column == OUTCOME else _mean(values, between)
    return found


def _share(outcomes: Sequence[str]) -> Value:
    won = sum(outcome == "success" for outcome in outcomes)
    interval = statistics.wilson95(won, len(outcomes))
    return {"value": won / len(outcomes), "value95": interval, "trials": len(outcomes)}


def _mean(values: Sequence[float], bounds: tuple[float, float, bool]) -> Value:
    if not values:
        return {"value": None, "value95": None, "trials": 0}
    mean, interval = statistics.mean95(np.array(values, float), *bounds)
    return {"value": mean, "value95": interval, "trials": len(values)}


def small(worth: Mapping[str, Value], objectives: Sequence[Objective]) -> list[float]:
    """Objectives as numbers that shall be small; infinity where there is no value."""
    values = [(worth[objective.name]["value"], objective.sign) for objective in objectives]
    return [math.inf if value is None else sign * value for value, sign in values]


def front_of(every: Sequence[Mapping[str, Value]], objectives: Sequence[Objective]) -> list[bool]:
    """Which of some designs are Pareto-optimal, from the values of their objectives."""
    values = np.array([small(each, objectives) for each in every])
    return front(values.reshape(len(every), len(objectives))).tolist()


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
