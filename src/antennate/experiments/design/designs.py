"""Designs and what came out of a search."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any, Literal

from antennate.experiments.design.config import DesignConfig, Objective
from antennate.experiments.design.evaluate import Row
from antennate.experiments.design.measures import Value, measure_of
from antennate.experiments.study.run import STATUS
from antennate.studies.plan import Point

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
            "objectives": [self._told(each) for each in self.config.objectives()],
            "axes": list(self.config.search),
            "proposed": self.proposed,
            "repeated": self.repeated,
            "trials": len(self.rows),
            "statuses": {name: statuses.count(name) for name in sorted(set(statuses))},
            "designs": [asdict(each) for each in self.designs],
        }

    def _told(self, objective: Objective) -> dict[str, Any]:
        experiment = self.config.evaluate[objective.label].experiment or objective.label
        measure = measure_of(objective, experiment)
        several = len(self.config.evaluate) > 1
        return {
            "name": objective.name,
            "goal": objective.goal,
            "title": f"{objective.label}: {measure.title}" if several else measure.title,
            "scale": measure.scale,
        }
