"""Data frames of pandas, which is optional: it is imported when the first one is asked for."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import asdict
from typing import Any

from antennate.errors import MissingPackageError


def from_columns(columns: Mapping[str, Any]) -> Any:
    """A pandas DataFrame of equally long columns.

    Raises:
        MissingPackageError: pandas is not installed.
    """
    try:
        import pandas
    except ImportError:
        raise MissingPackageError(
            "to_dataframe: expected pandas, found none; install it with `pip install pandas`, or "
            "in a clone `uv sync --extra pandas`"
        ) from None
    return pandas.DataFrame(dict(columns))


def from_rows(rows: Iterable[Any]) -> Any:
    """A pandas DataFrame of dataclasses or mappings of one kind: a column for each field.

    Raises:
        MissingPackageError: pandas is not installed.
    """
    held = [row if isinstance(row, Mapping) else asdict(row) for row in rows]
    names = held[0] if held else ()
    return from_columns({name: [row[name] for row in held] for name in names})
