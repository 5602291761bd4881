"""Designs of a search, what they are worth, and which of them are the best trade-offs."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from antennate.experiments.study import measures
from antennate.experiments.study.config import StudyConfig
from antennate.experiments.study.effects import SUCCESS
from antennate.experiments.study.propose import Goal
from antennate.experiments.study.subject import OUTCOME, Rows
from antennate.studies import statistics
from antennate.studies.columns import Ends, column, tabular
from antennate.studies.plan import Point
from antennate.types import Bools, Floats

OF_SUCCESSES = "@success"
"""End of a measure of trials that succeeded."""
State = Literal["ok", "failed", "refused", "unfinished"]


@dataclass(frozen=True)
class Objective:
    """One number that a design is judged by.

    Attributes:
        name: What is measured, with `@success` over the trials that succeeded alone.
        goal: Whether it shall be large or small.
    """

    name: str
    goal: Goal

    @property
    def column(self) -> str:
        """The column that it is made of."""
        return OUTCOME if self.name == SUCCESS else self.name.removesuffix(OF_SUCCESSES)

    @property
    def of_successes(self) -> bool:
        """Whether only trials that succeeded count."""
        return self.name.endswith(OF_SUCCESSES)

    @property
    def sign(self) -> float:
        """What makes it a number that shall be small."""
        return 1.0 if self.goal == "minimize" else -1.0


def objectives_of(config: StudyConfig) -> list[Objective]:
    """The objectives of a study, those that shall be large first."""
    return [
        *(Objective(name, "maximize") for name in config.maximize),
        *(Objective(name, "minimize") for name in config.minimize),
    ]


@tabular
class Value:
    """What a design is worth in an objective."""

    value: float | None = column(interval="value95")
    """Mean over the trials, or share of successes; `null` for a mean over successes without any.
    Its interval is `null` for a mean over fewer than five trials."""
    value95: Ends | None
    trials: int
    """Trials behind it."""


Worth = Mapping[str, Value]
"""What a design is worth in each objective, by name."""


@dataclass(kw_only=True)
class Design:
    """A design: a reference, or one that was proposed."""

    point: int
    """Number in the order of the run."""
    name: str
    """Name of a reference, else the number."""
    reference: bool
    """Whether it is a reference."""
    state: State = "unfinished"
    """`ok` if it was judged, `failed` with too few trials that are ok, `refused` if it could not be
    configured, `unfinished` if the run was interrupted."""
    reason: str = ""
    """Why it was refused."""
    values: Point
    """Value of each parameter that varies, by dotted name; of a reference those it states."""
    front: bool = False
    """Whether no other design is better, by the trials of the search."""
    objectives: dict[str, Value] | None = None
    """Each objective in the search, by name; `null` if the design was not judged."""
    fresh: dict[str, Value] | None = None
    """Each objective on fresh seeds; `null` if the design was not run again."""
    fresh_front: bool = False
    """Whether none of those that were run again is better on fresh seeds."""


@tabular
class Aim:
    """An objective, with its unit."""

    name: str
    """What is measured, as `success_share`."""
    goal: Goal
    """`maximize` or `minimize`."""
    title: str
    """What is measured, with the unit shown."""
    scale: float
    """Factor from the values of the designs to that unit."""

    @classmethod
    def of(cls, objective: Objective, experiment: str) -> Aim:
        """An objective of an experiment, with the label and the unit of what is measured there."""
        name = objective.name.removesuffix(OF_SUCCESSES)
        measure = measures.measure_of(experiment, name)
        if objective.of_successes:
            measure = replace(measure, label=f"{measure.label} (successes only)")
        return cls(
            name=objective.name, goal=objective.goal, title=measure.title, scale=measure.scale
        )


@tabular
class Search:
    """What a search by Optuna comes to."""

    optuna: str
    """Version of Optuna, which proposed the designs."""
    objectives: list[Aim]
    """What designs are judged by."""
    proposed: int
    """Designs that were proposed, those that came again among them."""
    repeated: int
    """Designs among these that came again and were not run again."""
    designs: list[Design]
    """The references, then the proposals."""


def worth_of(
    rows: Rows,
    objectives: Sequence[Objective],
    least_ok: float,
    bounds: Mapping[str, tuple[float, float, bool]] | None = None,
) -> dict[str, Value] | None:
    """The value of each objective, by name; None if too few trials are ok.

    Args:
        rows: Rows of all trials of a design.
        objectives: What the design is judged by.
        least_ok: Least share of the trials that must be ok.
        bounds: Between which values those of an objective lie, and whether the upper one stands
            for a failure, by its name; any if not given.
    """
    values_by_name: dict[str, Value] = {}
    for objective in objectives:
        name = objective.column
        needed = OUTCOME if objective.of_successes else name
        known = [r for r in rows if r["status"] == "ok" and r.get(needed) is not None]
        if not known or len(known) < least_ok * len(rows) - 1e-9:
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


def small(worth: Worth, objectives: Sequence[Objective]) -> list[float]:
    """Objectives as numbers that shall be small; infinity where there is no value."""
    values = [(worth[objective.name].value, objective.sign) for objective in objectives]
    return [math.inf if value is None else sign * value for value, sign in values]


def front_of(worths: Sequence[Worth], objectives: Sequence[Objective]) -> list[bool]:
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
