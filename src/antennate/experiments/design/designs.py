"""Designs, what they are worth, which are the best trade-offs, and what came out of a search."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Literal

import numpy as np

from antennate.experiments.design.config import DesignConfig, Objective
from antennate.experiments.design.evaluate import Row
from antennate.experiments.study import measures
from antennate.experiments.study.effects import SUCCESS
from antennate.experiments.study.run import STATUS
from antennate.experiments.study.subject import OUTCOME
from antennate.studies import statistics
from antennate.studies.plan import Point
from antennate.types import Bools, Floats

Value = Mapping[str, Any]
"""`value` of an objective, its interval `value95` (None of few trials), its number of `trials`. The
value is None if it is that of successes and there are none."""
State = Literal["ok", "failed", "refused", "unfinished"]


@dataclass(kw_only=True)
class Design:
    """One design, as result.json tells it.

    Attributes:
        design: Its number in the order of the run.
        name: That of a reference, else the number.
        state: Whether it was judged (ok), had too few trials that are ok (failed), could not be
            configured (refused), or the run was interrupted (unfinished).
        reason: Why it was refused.
        front: Whether no other design is better.
        objectives: Value of each objective by name, None if it was not judged.
        fresh: The same on fresh seeds, None if it was not validated.
        fresh_front: Whether of those that were validated none is better on fresh seeds.
    """

    design: int
    name: str
    reference: bool
    state: State = "unfinished"
    reason: str = ""
    values: Point
    front: bool = False
    objectives: dict[str, Value] | None = None
    fresh: dict[str, Value] | None = None
    fresh_front: bool = False


@dataclass(frozen=True)
class DesignOutcome:
    """All designs and all rows, in order.

    Attributes:
        designs: The references, then the proposals.
        rows: One for each trial, all with the same keys.
        proposed: How many designs were proposed, those among them that came again.
        repeated: How many came again.
        optuna: Version of what proposed.
        interrupted: Whether trials are missing.
    """

    config: DesignConfig
    designs: Sequence[Design]
    rows: list[Row]
    proposed: int
    repeated: int
    optuna: str
    interrupted: bool = False

    def result(self) -> dict[str, Any]:
        """The content of result.json."""
        statuses = [row[STATUS] for row in self.rows]
        return {
            "schema": 1,
            "command": "design",
            "interrupted": self.interrupted,
            "optuna": self.optuna,
            "objectives": [self._about(objective) for objective in self.config.objectives()],
            "axes": list(self.config.search),
            "proposed": self.proposed,
            "repeated": self.repeated,
            "trials": len(self.rows),
            "statuses": {name: statuses.count(name) for name in sorted(set(statuses))},
            "designs": [asdict(design) for design in self.designs],
        }

    def _about(self, objective: Objective) -> dict[str, Any]:
        """What an objective is called, and its unit."""
        experiment = self.config.evaluate[objective.label].experiment or objective.label
        measure = measures.measure_of(experiment, objective.column)
        if objective.of_successes:
            label = f"{measure.label} (successes only)"
            measure = dataclasses.replace(measure, label=label)
        several = len(self.config.evaluate) > 1
        return {
            "name": objective.name,
            "goal": objective.goal,
            "title": f"{objective.label}: {measure.title}" if several else measure.title,
            "scale": measure.scale,
        }


def worth_of(
    rows: Sequence[Mapping[str, Any]],
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
        column = OUTCOME if objective.measure == SUCCESS else objective.column
        trials = [row for row in rows if row["evaluation"] == objective.label]
        needed = OUTCOME if objective.of_successes else column
        known = [r for r in trials if r[STATUS] == "ok" and r.get(needed) is not None]
        if not known or len(known) < least_ok * len(trials) - 1e-9:
            return None
        if objective.of_successes:
            known = [r for r in known if r[OUTCOME] == "success" and r.get(column) is not None]
        values = [row[column] for row in known]
        between = (bounds or {}).get(objective.name, (-math.inf, math.inf, False))
        if not values:
            value, interval = None, None
        elif column == OUTCOME:
            won = sum(outcome == "success" for outcome in values)
            value, interval = won / len(values), statistics.wilson95(won, len(values))
        else:
            value, interval = statistics.mean95(np.array(values, float), *between)
        values_by_name[objective.name] = {
            "value": value,
            "value95": interval,
            "trials": len(values),
        }
    return values_by_name


def small(worth: Mapping[str, Value], objectives: Sequence[Objective]) -> list[float]:
    """Objectives as numbers that shall be small; infinity where there is no value."""
    values = [(worth[objective.name]["value"], objective.sign) for objective in objectives]
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
