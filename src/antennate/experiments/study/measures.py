"""What is told of the trials at each point, and of what the response hangs on."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import Any

import numpy as np

from antennate.experiments.study.config import StudyConfig
from antennate.studies import statistics
from antennate.studies.plan import Point, elementary_effects

SUCCESS = "success_share"
"""The response of rows that have an outcome."""
_NO_MEASURE = ("point", "trial", "seed")
Row = Mapping[str, Any]


def summary(
    config: StudyConfig,
    points: Sequence[Point],
    axes: Sequence[str],
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
        _cell(number, values, name, by_cell.get((number, name), []), response)
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
        "effects": _effects(config, axes, names, cells, len(points)),
    }


def _default_response(rows: Sequence[Row], axes: Sequence[str]) -> str | None:
    """Share of successes, or else the first number of the rows."""
    if not rows or "outcome" in rows[0]:
        return SUCCESS if rows else None
    known = [*_NO_MEASURE, *axes]
    numbers = (n for n, v in rows[0].items() if isinstance(v, float | int) and n not in known)
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
    number: int, values: Point, condition: str, rows: Sequence[Row], response: str | None
) -> dict[str, Any]:
    """One point under one condition."""
    counts = _whole(rows)
    mean, interval = counts.get(SUCCESS), counts.get("wilson95")
    if response not in (None, SUCCESS):
        known = np.array([v for r in rows if r["status"] == "ok" and _is(v := r.get(response))])
        mean, low, high = statistics.mean95(known)
        interval = (low, high) if len(known) > 1 else None
    return {
        "point": number,
        "values": dict(values),
        "condition": condition,
        **counts,
        "response": mean,
        "response95": interval,
    }


def _is(value: Any) -> bool:
    return isinstance(value, float | int) and math.isfinite(value)


def _effects(
    config: StudyConfig,
    axes: Sequence[str],
    names: Sequence[str],
    cells: Sequence[Mapping[str, Any]],
    points: int,
) -> list[dict[str, Any]]:
    """Of a Morris plan: the effects of each parameter, on conditions and on their differences."""
    if config.plan != "morris":
        return []
    found = np.array([math.nan if c["response"] is None else c["response"] for c in cells], float)
    by_name = dict(zip(names, found.reshape(points, len(names)).T, strict=True))
    targets = dict(by_name)
    for first, second in combinations(names, 2):
        targets[f"{second} minus {first}"] = by_name[second] - by_name[first]
    return [
        {"of": target, "parameter": name, **_spread(effects)}
        for target, response in targets.items()
        for name, effects in zip(
            axes,
            elementary_effects(len(axes), config.points, config.seed, response.tolist()),
            strict=True,
        )
    ]


def _spread(effects: Sequence[float]) -> dict[str, Any]:
    """Morris's measures: mean size of the effects, their mean and their standard deviation."""
    if not effects:
        return dict.fromkeys(("mu_star", "mu_star95", "mu", "sigma"))
    values = np.array(effects)
    size, low, high = statistics.mean95(np.abs(values))
    return {
        "mu_star": size,
        "mu_star95": (low, high) if len(values) > 1 else None,
        "mu": float(values.mean()),
        "sigma": float(values.std(ddof=1)) if len(values) > 1 else None,
    }
