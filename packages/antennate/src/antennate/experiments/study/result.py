"""What a study comes to: each condition, each point, and the effects of what varies."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from antennate.control.readings import short_names
from antennate.experiments.study.config import StudyConfig
from antennate.experiments.study.designs import Search
from antennate.experiments.study.effects import SUCCESS, Elementary, Slope, effects, value
from antennate.experiments.study.measures import NO_RESULT, bounds, measure_of, of_controllers
from antennate.studies import statistics
from antennate.studies.columns import Column, Ends, column, tabular
from antennate.studies.plan import Axes, Kind, Point

_NO_MEASURE = ("point", "trial", "seed", "schema")
Row = Mapping[str, Any]


@tabular
class Counts:
    """How many trials there are."""

    trials: int
    """Trials that have ended."""
    invalid: int
    """Trials whose status is not `ok`; they are left out of all else."""


@tabular
class Successes(Counts):
    """Trials, and how many succeeded; where rows have no `outcome` the first two keys alone."""

    successes: int
    success_share: float | None = column(interval="wilson95")
    """Successes over valid trials, and Wilson's interval; `null` without any."""
    wilson95: Ends | None


@tabular
class Place:
    """A point under a condition."""

    point: int
    """Number of the point, from 0."""
    values: Point
    """Value of each parameter that varies, by dotted name."""
    condition: str
    """Name of the condition, as a controller or a profile; empty where there is none."""


@tabular
class Cell(Counts, Place):
    """Trials of a point under a condition."""

    response: float | None = column(interval="response95")
    """Mean of the response over valid trials; its interval by Student's t from five on, Wilson's of
    a share of successes; `null` without any."""
    response95: Ends | None


@tabular
class CellOfSuccesses(Successes, Cell):
    """Trials of a point under a condition, with their successes."""


@tabular
class StudyResult:
    """What a study comes to."""

    schema: int = 1
    command: str = "study"
    experiment: str
    """Experiment that was run, or the function as `MODULE:NAME`."""
    plan: Kind
    """How points were chosen: `grid`, `list`, `random`, `sobol`, `morris` or `optuna`."""
    axes: list[str]
    """Parameters that vary, by dotted name."""
    trials: int
    """Trials of the whole plan."""
    ended: int
    """Trials of it that have ended."""
    interrupted: bool
    """Whether some are missing."""
    statuses: dict[str, int]
    response: str | None
    """Column that is compared between points; `null` where no row has a number."""
    conditions: dict[str, Successes | Counts]
    """Each condition, over all points; the name is empty where there is none."""
    points: list[CellOfSuccesses | Cell]
    """Each point under each condition."""
    effects: list[Elementary | Slope]
    """Effects of each parameter on each condition, and on the difference of each two; empty for a
    grid, a list and optuna."""
    search: Search | None = None
    """Designs that optuna proposed; `null` in other plans."""

    @property
    def failed(self) -> bool:
        """Whether no trial gave a row."""
        return NO_RESULT.issuperset(self.statuses)

    @property
    def measure(self) -> Column:
        """The response, with its label and its unit."""
        return measure_of(self.experiment, self.response or "response")

    def label(self, name: str) -> str:
        """Short name of a condition, or of the difference of two."""
        short = short_names(self.conditions) if of_controllers(self.experiment) else {}
        return " minus ".join(short.get(each, each) for each in name.split(" minus "))

    @property
    def sample(self) -> str:
        """What the noise of the effects is of: trials a point, or points."""
        if self.plan != "morris":
            known = {cell.point for cell in self.points if cell.response is not None}
            return f"{len(known)} points"
        most = max(cell.trials for cell in self.points)
        return f"{most} trial{'s' if most != 1 else ''} a point"

    @property
    def tells_effects(self) -> bool:
        """Whether the size of any effect is known."""
        return any(effect.size[0] is not None for effect in self.effects)

    def known_effects(self, target: str) -> list[Elementary | Slope]:
        """Effects on a condition or a difference whose size is known, the largest first."""
        known = [e for e in self.effects if e.of == target and e.size[0] is not None]
        return sorted(known, key=lambda effect: -abs(effect.size[0] or 0.0))


def summarise(
    config: StudyConfig,
    points: Sequence[Point],
    axes: Axes,
    condition: str,
    rows: Sequence[Row],
    total: int,
    ended: int,
    interrupted: bool = False,
) -> StudyResult:
    """What the rows of a study come to.

    Args:
        config: What was asked.
        points: The points of the plan.
        axes: What varies.
        condition: Column that tells the condition of a row; empty without.
        rows: All rows, with the same keys.
        total: Trials of the whole plan.
        ended: Those of them that have ended.
        interrupted: Whether some are missing.
    """
    response = config.response or _default_response(rows, axes)
    names = list(dict.fromkeys(str(row[condition]) for row in rows)) if condition else [""]
    by_cell: dict[tuple[int, str], list[Row]] = {}
    for row in rows:
        by_cell.setdefault((row["point"], str(row[condition]) if condition else ""), []).append(row)
    statuses = [row["status"] for row in rows]
    return StudyResult(
        experiment=config.experiment,
        plan=config.plan,
        axes=list(axes),
        trials=total,
        ended=ended,
        interrupted=interrupted,
        statuses={name: statuses.count(name) for name in sorted(set(statuses))},
        response=response,
        conditions={
            name: _counted([r for n in by_cell if n[1] == name for r in by_cell[n]])
            for name in names
        },
        points=[
            _cell(number, values, name, by_cell.get((number, name), []), response, config)
            for number, values in enumerate(points)
            for name in names
        ],
        effects=[*effects(config, axes, by_cell, points, names, response)],
    )


def _default_response(rows: Sequence[Row], axes: Iterable[str]) -> str | None:
    """Share of successes, or else the first column that has a number."""
    if not rows or "outcome" in rows[0]:
        return SUCCESS if rows else None
    names = (name for name in rows[0] if name not in (*_NO_MEASURE, *axes))
    return next((n for n in names if any(isinstance(r[n], float | int) for r in rows)), None)


def _counted(rows: Sequence[Row]) -> Successes | Counts:
    """Counts of one condition, over all that it holds."""
    valid = [row for row in rows if row["status"] == "ok"]
    counts = {"trials": len(rows), "invalid": len(rows) - len(valid)}
    if not any("outcome" in row for row in rows):
        return Counts(**counts)
    won = sum(row["outcome"] == "success" for row in valid)
    return Successes(
        **counts,
        successes=won,
        success_share=won / len(valid) if valid else None,
        wilson95=statistics.wilson95(won, len(valid)) if valid else None,
    )


def _cell(
    number: int,
    values: Point,
    condition: str,
    rows: Sequence[Row],
    response: str | None,
    config: StudyConfig,
) -> Cell:
    """One point under one condition."""
    counts, mean, interval = _counted(rows), None, None
    if response is not None and response != SUCCESS:
        responses = np.array([value(row, response) for row in rows])
        of = measure_of(config.experiment, response)
        limits = bounds(of, config.experiment, {**config.settings, **values})
        mean, interval = statistics.mean95(responses[np.isfinite(responses)], *limits)
    elif isinstance(counts, Successes):
        mean, interval = counts.success_share, counts.wilson95
    kind = CellOfSuccesses if isinstance(counts, Successes) else Cell
    return kind(
        point=number,
        values=dict(values),
        condition=condition,
        response=mean,
        response95=interval,
        **vars(counts),
    )
