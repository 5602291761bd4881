"""What tables and figures of a study call the response and the parameters, with their units."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from antennate import experiments
from antennate.experiments.study.effects import SUCCESS
from antennate.params.base import Params
from antennate.studies.measures import Measure, shown

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


def measure(result: Mapping[str, Any]) -> Measure:
    """The response of a study."""
    return measure_of(result["experiment"], result["response"] or "response")


def measure_of(experiment: str, column: str) -> Measure:
    """The measure of an experiment that is kept in a column, or the column in words."""
    if column == SUCCESS:
        return _SHARE
    known = _experiment(experiment)
    for found in known.measures if known else ():
        if found.name.replace(".", "_") == column and found.label:
            return found
    end = next((e for e in sorted(_UNITS, key=len)[::-1] if column.endswith(f"_{e}")), "")
    words = column.removesuffix(f"_{end}").replace("_", " ")
    return Measure(column, words, _UNITS.get(end, ""), form=".3g")


def bounds(of: Measure, experiment: str, values: Mapping[str, Any]) -> tuple[float, float]:
    """What no value of a measure lies below, and what none exceeds.

    Args:
        of: The measure.
        experiment: Name of its experiment.
        values: Parameters that are not at their defaults, by name.
    """
    if not isinstance(of.most, str):
        return of.least, of.most
    known = _experiment(experiment)
    default = known.config.model_fields[of.most].default if known else math.inf
    most = values.get(of.most, default)
    return of.least, math.inf if most is None else float(most)


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
        field = model.model_fields.get(part) if _is_group(model) else None
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
        return " ".join(text(each, digits) for each in value)
    return f"{value:.{digits}g}" if isinstance(value, float) else str(value)


def silent(statuses: Mapping[str, int]) -> str:
    """What is said of trials that say nothing, empty if all are ok."""
    told = ", ".join(f"{n} {name}" for name, n in statuses.items() if name != "ok")
    return f". Trials that say nothing: {told}; trials.csv has why" if told else ""


def _is_group(model: Any) -> bool:
    return isinstance(model, type) and issubclass(model, Params)


def _experiment(name: str) -> Any:
    return experiments.load(name) if name in experiments.names() else None
