"""What is told of the trials at each point, with labels and units of response and parameters."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from antennate import experiments
from antennate.experiments.study.config import StudyConfig
from antennate.experiments.study.effects import SUCCESS, effects, value
from antennate.params.base import Params
from antennate.sim.scenes.registry import TUNNEL, shared_limit
from antennate.studies import statistics
from antennate.studies.measures import Measure, shown
from antennate.studies.plan import Axes, Point

_SHARE = Measure(SUCCESS, "share of successes", "%", form=".0f", scale=100.0)
_UNITS = {
    "s": "s",
    "ms": "ms",
    "m": "m",
    "mm": "mm",
    "m_s": "m/s",
    "deg": "deg",
    "n": "N",
    "n_mm": "N·mm",
    "n_mm_per_deg": "N·mm/deg",
    "n_m_per_rad": "N·m/rad",
    "pa": "Pa",
}
"""Ends of the names of columns, and the unit that each says."""
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
    valid = [row for row in rows if row["status"] == "ok"]
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
        responses = np.array([value(row, response) for row in rows])
        of = measure_of(config.experiment, response)
        limits = bounds(of, config.experiment, {**config.settings, **values})
        mean, interval = statistics.mean95(responses[np.isfinite(responses)], *limits)
    return {
        "point": number,
        "values": dict(values),
        "condition": condition,
        **counts,
        "response": mean,
        "response95": interval,
    }


def measure(result: Mapping[str, Any]) -> Measure:
    """The response of a study."""
    return measure_of(result["experiment"], result["response"] or "response")


def measure_of(experiment: str, column: str) -> Measure:
    """The measure of an experiment that is kept in a column, or the column in words."""
    if column == SUCCESS:
        return _SHARE
    known = _experiment(experiment)
    for known_measure in known.measures if known else ():
        if known_measure.name.replace(".", "_") == column and known_measure.label:
            return known_measure
    end = next((e for e in sorted(_UNITS, key=len)[::-1] if column.endswith(f"_{e}")), "")
    words = column.removesuffix(f"_{end}").replace("_", " ")
    return Measure(column, words, _UNITS.get(end, ""), form=".3g")


def bounds(of: Measure, experiment: str, values: Mapping[str, Any]) -> tuple[float, float, bool]:
    """What no value of a measure lies below, what none exceeds, and whether that is a failure.

    A measure that ends at a parameter, as a time at its limit, is that limit where a trial fails.

    Args:
        of: The measure.
        experiment: Name of its experiment.
        values: Parameters that are not at their defaults, by name.
    """
    if not isinstance(of.most, str):
        return of.least, of.most, False
    known = _experiment(experiment)
    default = known.config.model_fields[of.most].default if known else math.inf
    most = values.get(of.most, default)
    if most is None:  # that of the scene
        most = shared_limit(str(values.get("scene", TUNNEL)))
    return of.least, float(most), True


def cell(of: Measure, number: Any, interval: Any = None) -> str:
    """A value of a measure as shown, with its interval if it has one."""
    text = shown(number, of.form, of.scale)
    return text if interval is None else f"{text} ({shown(interval, of.form, of.scale)})"


def sample(result: Mapping[str, Any]) -> str:
    """What the noise of the effects is of: trials a point, or points."""
    if result["plan"] != "morris":
        known = {cell["point"] for cell in result["points"] if cell["response"] is not None}
        return f"{len(known)} points"
    most = max(cell["trials"] for cell in result["points"])
    return f"{most} trial{'s' if most != 1 else ''} a point"


def axis(result: Mapping[str, Any], path: str) -> str:
    """A parameter: the last part of its dotted name in words, with its unit."""
    name, unit = path.rpartition(".")[2], ""
    known = _experiment(result["experiment"])
    model: Any = known.config if known else None
    for part in path.split("."):
        is_group = isinstance(model, type) and issubclass(model, Params)
        field = model.model_fields.get(part) if is_group else None
        extra = field.json_schema_extra if field else None
        unit = str(extra.get("unit", "1")) if isinstance(extra, dict) else ""
        model = field.annotation if field else None
    if unit in ("", "1"):
        return name.replace("_", " ")
    said = "_" + unit.lower().replace("·", "_").replace("/", "_per_")
    return f"{name.removesuffix(said).replace('_', ' ')} [{unit}]"


def text(value: Any, digits: int = 4) -> str:
    """A value of a point as shown; a list as its entries."""
    if isinstance(value, list | tuple):
        return " ".join(text(entry, digits) for entry in value)
    return f"{value:.{digits}g}" if isinstance(value, float) else str(value)


def silent(statuses: Mapping[str, int]) -> str:
    """What is said of trials that say nothing, empty if all are ok."""
    counts = ", ".join(f"{n} {name}" for name, n in statuses.items() if name != "ok")
    return f". Trials that say nothing: {counts}; trials.csv has why" if counts else ""


def _experiment(name: str) -> Any:
    """The experiment of this name, None of a function."""
    return experiments.load(name) if name in experiments.names() else None
