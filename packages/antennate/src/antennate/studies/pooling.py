"""Rows of a run in a pandas DataFrame, and how many of them become one number."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import fields
from typing import Any, cast

import numpy as np

from antennate.errors import ConfigError, in_one_line
from antennate.studies.columns import Frame, Kind, Pool, declared

INVALID = "invalid"
"""Outcome of a trial that says nothing; nothing but its number is pooled."""


def frame(rows: Iterable[Any], kind: type | None = None) -> Frame:
    """The rows of a run as a pandas DataFrame: a row for each, a column for each field.

    Args:
        rows: Dataclasses or mappings of one kind.
        kind: Their class, which names the columns where there are no rows.
    """
    import pandas  # slow to import

    some = list(rows)
    if kind is None and some and isinstance(some[0], Mapping):
        return pandas.DataFrame({name: _series([row[name] for row in some]) for name in some[0]})
    kind = kind or (type(some[0]) if some else None)
    names = [each.name for each in fields(kind)] if kind else []
    return pandas.DataFrame({name: _series([getattr(row, name) for row in some]) for name in names})


def _series(values: list[Any]) -> Any:
    """Values of a column; whole numbers of which some are not known stay whole."""
    from pandas import Series

    known = [value for value in values if value is not None]
    whole = len(known) < len(values) and known and all(type(value) is int for value in known)
    return Series(values, dtype=object) if whole else values


def by(rows: Frame, name: str, values: Iterable[Any] = ()) -> dict[Any, Frame]:
    """Rows by their value in a column: these values first, even without rows, then all others."""
    groups = dict(iter(rows.groupby(name, sort=False, dropna=False))) if len(rows) else {}
    return {value: groups.get(value, rows.iloc[:0]) for value in dict.fromkeys([*values, *groups])}


def valid(rows: Frame) -> Frame:
    """Rows without those that are invalid."""
    return rows[rows["outcome"] != INVALID]


def pooled(kind: type[Kind], rows: Frame, **given: Any) -> Kind:
    """Rows as one summary of a class: each column over the valid ones, as the column says.

    Fields `trials`, `invalid` and `first_reason` are counted over all rows.

    Args:
        kind: Class of the summary.
        rows: Rows with an `outcome`, or rows that are all valid.
        given: Fields that are computed elsewhere.

    Raises:
        ConfigError: A field cannot be made of these rows, and is not given.
    """
    sound = valid(rows) if "outcome" in rows else rows
    lost = rows.drop(sound.index)
    reasons = lost["reason"].tolist() if "reason" in lost else []
    counted = {
        "trials": len(rows),
        "invalid": len(lost),
        "first_reason": reasons[0] if reasons else None,
    }
    known = {each.name for each in fields(cast("Any", kind))}
    return _fill(kind, sound, {k: v for k, v in counted.items() if k in known} | given, "")


def _fill(kind: type[Kind], rows: Frame, given: Mapping[str, Any], path: str) -> Kind:
    values = dict(given)
    for name, said, part in declared(kind):
        if name in given or said is None:
            continue
        if part is not None:
            values[name] = _fill(part, rows, {}, f"{path}{name}_")
        elif said.pool is not None:
            try:
                values[name] = said.pool(rows, f"{path}{name}")
            except (KeyError, TypeError, ValueError) as error:
                raise ConfigError(
                    f"{kind.__name__}.{name}: expected rows with numbers in a column "
                    f"{path}{name}, found {in_one_line(error)}"
                ) from error
    try:
        return kind(**values)
    except TypeError as error:
        raise ConfigError(f"{kind.__name__}: expected a pool or a value, found {error}") from None


def _known(values: Any) -> Any:
    """What is known of a column, as an array."""
    return values.dropna().to_numpy()


def mean(rows: Frame, name: str) -> float | None:
    """Mean of a column over the rows that have it; None without any."""
    values = _known(rows[name])
    return float(np.mean(values.astype(float))) if len(values) else None


def median(rows: Frame, name: str) -> float | None:
    """Median of a column; None without rows."""
    values = _known(rows[name])
    return float(np.median(values.astype(float))) if len(values) else None


def largest(rows: Frame, name: str) -> float | None:
    """Largest value of a column; None without rows."""
    return max(_known(rows[name]).tolist(), default=None)


def smallest(rows: Frame, name: str) -> float | None:
    """Smallest value of a column; None without rows."""
    return min(_known(rows[name]).tolist(), default=None)


def total(rows: Frame, name: str) -> int:
    """Sum of a column."""
    return sum(_known(rows[name]).tolist())


def count(name: str, value: Any) -> Pool:
    """How many rows hold a value in a column."""
    return lambda rows, _: int((rows[name] == value).sum())


def share(name: str, value: Any) -> Pool:
    """The share of rows that hold a value in a column; None without rows."""
    return lambda rows, _: int((rows[name] == value).sum()) / len(rows) if len(rows) else None
