"""Columns: each number is said once, where the class of a row or of a result names it.

A field declared with `column` carries its label, its unit, how it is written, and how rows are
pooled into it. Tables, result.json, axes and docs/results.md follow from that.

    @tabular
    class Measured:
        force_max_n: float | None = column("contact force, largest", "N", largest, default=None)

    @tabular
    class Row(Measured): ...      # one trial

    @tabular
    class Summary(Measured): ...  # many: `pooled(Summary, frame(rows))`
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import MISSING, asdict, dataclass, field, fields, is_dataclass, replace
from inspect import get_annotations
from types import NoneType, UnionType
from typing import (
    Any,
    TypeVar,
    Union,
    cast,
    dataclass_transform,
    get_args,
    get_origin,
    get_type_hints,
)

import numpy as np

from antennate.errors import ConfigError

NONE = "-"
"""Shown where there is no number."""
Ends = tuple[float, float]
"""An interval: its lower and its upper end."""
Frame = Any
"""A pandas DataFrame, imported where one is made; its own types tell a checker too little."""
Pool = Callable[[Frame, str], Any]
"""pool(rows, name): the value of a column over rows."""
_KEY = "column"
CONDITION = {"condition": True}
"""Metadata of the field of a row that tells the condition of its trial."""
_UNITS = {
    "s": "s",
    "ms": "ms",
    "hz": "Hz",
    "rad": "rad",
    "percent": "%",
    "n_m": "N·m",
    "per_m": "1/m",
    "m_s2": "m/s²",
    "rad_s": "rad/s",
    "kg": "kg",
    "w": "W",
    "a": "A",
    "v": "V",
    "m": "m",
    "mm": "mm",
    "m_s": "m/s",
    "deg": "deg",
    "deg_per_cycle": "deg",
    "n": "N",
    "n_mm": "N·mm",
    "n_mm_per_deg": "N·mm/deg",
    "n_m_per_rad": "N·m/rad",
    "pa": "Pa",
    "ohm": "Ohm",
    "counts": "counts",
}
"""Ends of the names of columns, and the unit that each says."""
Kind = TypeVar("Kind")


@dataclass(frozen=True, slots=True)
class Column:
    """How one number, or the ends of an interval, is called, pooled and written.

    Attributes:
        name: Key in result.json; a dot leads into a part (`share.forward`). It ends with the unit.
        label: What tables and figures call it; a column without one is not shown.
        unit: Its unit as shown.
        pool: How rows make it; None if it is computed elsewhere.
        form: Its format.
        scale: Factor to the unit shown.
        join: Between two numbers, as the ends of an interval.
        least: What it cannot lie below.
        most: What it cannot exceed; text names the parameter that says so.
        interval: Key of its 95 % interval, beside its own; a line of the table below it.
    """

    name: str = ""
    label: str = ""
    unit: str = ""
    pool: Pool | None = None
    form: str = ".2f"
    scale: float = 1.0
    join: str = " to "
    least: float = -math.inf
    most: float | str = math.inf
    interval: str = ""

    @property
    def ends(self) -> Column:
        """Column of the interval."""
        path = self.name.rpartition(".")[0]
        name = f"{path}.{self.interval}" if path else self.interval
        return replace(self, name=name, label="  95 %", pool=None, interval="")

    @property
    def title(self) -> str:
        """Label and unit."""
        return f"{self.label} [{self.unit}]" if self.unit else self.label

    def value(self, of: Any) -> Any:
        """Value of the column in a row or a summary, an object or a mapping; None if absent."""
        for part in self.name.split("."):
            of = of.get(part) if isinstance(of, Mapping) else getattr(of, part, None)
        return of

    def cell(self, of: Any) -> str:
        """Value of the column as a table shows it."""
        return shown(self.value(of), self.form, self.scale, self.join)


def column(
    label: str = "",
    unit: str = "",
    pool: Pool | None = None,
    *,
    form: str = ".2f",
    scale: float = 1.0,
    join: str = " to ",
    least: float = -math.inf,
    most: float | str = math.inf,
    interval: str = "",
    default: Any = MISSING,
) -> Any:
    """A field with what `Column` says of it. One that holds further columns lends its label."""
    said = Column("", label, unit, pool, form, scale, join, least, most, interval)
    return field(default=default, metadata={_KEY: said})


def percent(
    label: str, unit: str = "%", pool: Pool | None = None, *, form: str = ".0f", **more: Any
) -> Any:
    """Such a field that is a share, written in percent; the unit says of what."""
    return column(label, unit, pool, form=form, scale=100.0, **more)


@dataclass_transform(
    kw_only_default=True, frozen_default=True, field_specifiers=(column, percent, field)
)
def tabular(kind: type[Kind]) -> type[Kind]:
    """A frozen dataclass, given by names, whose fields may be columns: of rows and of results."""
    return dataclass(frozen=True, kw_only=True)(kind)


@dataclass_transform(
    kw_only_default=True, frozen_default=True, field_specifiers=(column, percent, field)
)
def tabular_row(kind: type[Kind]) -> type[Kind]:
    """Such a class for a row of trials.csv: its own fields stand before those that it shares."""
    made: Any = tabular(kind)
    known = dict(made.__dataclass_fields__)
    own = {name: known.pop(name) for name in get_annotations(kind) if name in known}
    made.__dataclass_fields__ = {**own, **known}
    return made


def condition_of(row: type) -> str:
    """Name of the field of a row that tells the condition of its trial; empty without."""
    names = [each.name for each in fields(row) if "condition" in each.metadata]
    return names[0] if names else ""


def column_of(kind: type, name: str) -> Column:
    """The column of this name."""
    found = {each.name: each for each in columns(kind)}
    if name not in found:
        raise ConfigError(
            f"{kind.__name__}: expected a column, one of {', '.join(found)}, found {name}"
        )
    return found[name]


@functools.cache
def columns(kind: type) -> tuple[Column, ...]:
    """The columns of a class in their order, those of its parts among them."""
    found: list[Column] = []
    for name, said, part in declared(kind):
        if said is not None and part is None:
            found.append(replace(said, name=name))
        elif said is not None and part is not None:
            inner = columns(part)
            found += (replace(c, name=f"{name}.{c.name}", label=_of(c, said)) for c in inner)
    return tuple(found)


def _of(inner: Column, outer: Column) -> str:
    """The label of a column in a part: that of the part stands behind it."""
    behind = inner.label and not inner.label.startswith(" ") and outer.label
    return f"{inner.label} {outer.label}" if behind else inner.label


@functools.cache
def declared(kind: type) -> tuple[tuple[str, Column | None, type | None], ...]:
    """Name and column of each field, and the class of its parts where it has some."""
    try:
        hints = get_type_hints(kind)
    except NameError as error:
        raise ConfigError(
            f"{kind.__name__}: expected types that are known when the program runs, found "
            f"{error}; import them outside of TYPE_CHECKING, and define classes in a module"
        ) from None
    found: list[tuple[str, Column | None, type | None]] = []
    for each in fields(cast("Any", kind)):
        hint: Any = hints[each.name]
        if get_origin(hint) in (Union, UnionType):  # a part that may be missing
            (hint, *others) = [of for of in get_args(hint) if of is not NoneType]
            hint = None if others else hint
        part: Any = hint if is_dataclass(hint) else None
        found.append((each.name, each.metadata.get(_KEY), part))
    return tuple(found)


def named(name: str) -> Column:
    """A column that is known by its name alone: its words, and the unit that it ends with."""
    end = next((e for e in sorted(_UNITS, key=len)[::-1] if name.endswith(f"_{e}")), "")
    words = name.removesuffix(f"_{end}").replace("_", " ")
    return Column(name, words, _UNITS.get(end, ""), form=".3g")


def content(result: Any) -> dict[str, Any]:
    """A result as result.json holds it: dataclasses as dictionaries."""
    return result if isinstance(result, dict) else asdict(result)


def typed(kind: type[Kind], data: Any) -> Kind:
    """A result from the content of result.json."""
    from pydantic import ValidationError

    try:
        return _adapter(kind).validate_python(data)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        where = ".".join(map(str, first["loc"])) or "all of it"
        raise ValueError(f"{where}: {first['msg'].lower()}") from None


@functools.cache
def _adapter(kind: type) -> Any:
    from pydantic import TypeAdapter

    return TypeAdapter(kind)


def shown(value: Any, form: str = ".2f", scale: float = 1.0, join: str = " to ") -> str:
    """A number, an interval as `low to high`, a text, or a dash for what is not known."""
    if isinstance(value, str):
        return value
    if isinstance(value, Sequence | np.ndarray):
        if not np.isfinite(np.array(value, float)).all():  # None in result.json
            return NONE
        return join.join(_written(scale * end, form) for end in value)
    if value is None or value != value:
        return NONE
    return _written(scale * value if scale != 1.0 else value, form)


def _written(value: Any, form: str) -> str:
    """A number in digits; what rounds to zero has no sign."""
    text = format(round(value) if form.endswith("d") else value, form)
    return text if text.strip("-0.") else text.lstrip("-")
