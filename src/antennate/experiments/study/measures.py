"""What is told of the trials at each point, and of what the response depends on."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from antennate.experiments.study import labels
from antennate.experiments.study.config import StudyConfig
from antennate.experiments.study.effects import SUCCESS, effects, value
from antennate.studies import statistics
from antennate.studies.plan import Axes, Point

_NO_MEASURE = ("point", "trial", "seed", "schema")
NO_RESULT = frozenset({"failed", "crashed", "hung"})
"""Statuses of trials that gave no row."""
Row = Mapping[str, Any]


def summary(
    config: StudyConfig,
    points: Sequence[Point],
    axes: Axes,
    condition: str,
    rows: Sequence[Row],
) -> dict[str, Any]:
    """The part of result.json that follows from the rows."""
    response = config.response or _default_response(rows, axes)
    names = list(dict.fromkeys(str(row[condition]) for row in rows)) if condition else [""]
    by_cell: dict[tuple[int, str], list[Row]] = {}
    for row in rows:
        by_cell.setdefault((row["point"], str(row[condition]) if condition else ""), []).append(row)
    cells = [
        _cell(number, values, name, by_cell.get((number, name), []), response, config)
        for number, values in enumerate(points)
        for name in names
    ]
    statuses = [row["status"] for row in rows]
    return {
        "statuses": {name: statuses.count(name) for name in sorted(set(statuses))},
        "response": response,
        "conditions": {
            name: _whole([r for n in by_cell if n[1] == name for r in by_cell[n]]) for name in names
        },
        "points": cells,
        "effects": effects(config, axes, by_cell, points, names, response),
    }


def _default_response(rows: Sequence[Row], axes: Iterable[str]) -> str | None:
    """Share of successes, or else the first number of the rows."""
    if not rows or "outcome" in rows[0]:
        return SUCCESS if rows else None
    known = [*_NO_MEASURE, *axes]
    cells = (cell for row in rows for cell in row.items())  # the first one may have failed
    numbers = (n for n, v in cells if isinstance(v, float | int) and n not in known)
    return next(numbers, None)


def _whole(rows: Sequence[Row]) -> dict[str, Any]:
    """Counts of one condition, over all that it holds."""
    valid = [row for row in rows if row["status"] in ("ok",)]
    if not any("outcome" in row for row in rows):
        return {"trials": len(rows), "invalid": len(rows) - len(valid)}
    won = sum(row["outcome"] == "success" for row in valid)
    return {
        "trials": len(rows),
        "invalid": len(rows) - len(valid),
        "successes": won,
        SUCCESS: won / len(valid) if valid else None,
        "wilson95": statistics.wilson95(won, len(valid)) if valid else None,
    }


def _cell(
    number: int,
    values: Point,
    condition: str,
    rows: Sequence[Row],
    response: str | None,
    config: StudyConfig,
) -> dict[str, Any]:
    """One point under one condition."""
    counts = _whole(rows)
    mean, interval = counts.get(SUCCESS), counts.get("wilson95")
    if response is not None and response != SUCCESS:
        found = np.array([value(row, response) for row in rows])
        known = found[np.isfinite(found)]
        of = labels.measure_of(config.experiment, response)
        bounds = labels.bounds(of, config.experiment, {**config.settings, **values})
        mean, interval = statistics.mean95(known, *bounds)
    return {
        "point": number,
        "values": dict(values),
        "condition": condition,
        **counts,
        "response": mean,
        "response95": interval,
    }
