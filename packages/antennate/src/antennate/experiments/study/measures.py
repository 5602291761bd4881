"""Labels, units and bounds: of what an experiment measures, and of its parameters."""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator, Mapping
from dataclasses import is_dataclass, replace
from typing import Any, get_args, get_type_hints

from antennate import experiments
from antennate.experiments.study.effects import SUCCESS
from antennate.params.base import Params
from antennate.sim.scenes.registry import TUNNEL, shared_limit
from antennate.studies.columns import Column, columns, condition_of, named, shown
from antennate.studies.experiment import Experiment

_SHARE = Column(SUCCESS, "share of successes", "%", form=".0f", scale=100.0)
NO_RESULT = frozenset({"failed", "crashed", "hung"})
"""Statuses of trials that gave no row."""


def measure_of(experiment: str, name: str) -> Column:
    """The column of this name: as the experiment declares it, or else known by its name alone.

    Args:
        experiment: Name of the experiment, or of a function.
        name: A column of its rows, or a number of its result by its dotted path.
    """
    if name == SUCCESS:
        return _SHARE
    known, plain = _experiment(experiment), named(name)
    for each in _declared(known) if known else ():
        if name == each.name.replace(".", "_"):
            label = each.label
        elif name.endswith(f".{each.name}"):
            label = f"{each.label} ({name.removesuffix(f'.{each.name}')})"
        else:
            continue
        if label.startswith(" "):  # it says something only below the line before it
            label = plain.label
        return replace(each, label=label, form=each.form.replace("d", plain.form))  # of a mean
    return plain


def _declared(experiment: Experiment[Any, Any]) -> Iterator[Column]:
    """Columns that have a label: of the rows, then of the result and its parts."""
    for kind in (experiment.row, *_parts(experiment.result)):
        yield from (each for each in columns(kind) if each.label) if kind else ()


@functools.cache
def _parts(kind: type | None) -> tuple[type, ...]:
    """The dataclasses that a type is made of, those nearest to it first."""
    seen: list[Any] = [kind]
    for each in seen:
        inner = get_type_hints(each).values() if is_dataclass(each) else get_args(each)
        seen += [hint for hint in inner if hint not in seen]
    return tuple(each for each in seen if isinstance(each, type) and is_dataclass(each))


def bounds(of: Column, experiment: str, values: Mapping[str, Any]) -> tuple[float, float, bool]:
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


def cell(of: Column, number: Any, interval: Any = None) -> str:
    """A value of a measure as shown, with its interval if it has one."""
    text = shown(number, of.form, of.scale)
    return text if interval is None else f"{text} ({shown(interval, of.form, of.scale)})"


def axis(experiment: str, path: str) -> str:
    """A parameter: the last part of its dotted name in words, with its unit."""
    name, unit = path.rpartition(".")[2], ""
    known = _experiment(experiment)
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


def of_controllers(experiment: str) -> bool:
    """Whether the conditions of this experiment are controllers."""
    known = _experiment(experiment)
    return bool(known and known.row and condition_of(known.row) == "controller")


def _experiment(name: str) -> Experiment[Any, Any] | None:
    """The experiment of this name, None of a function."""
    return experiments.load(name) if name in experiments.names() else None
