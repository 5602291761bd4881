"""The row of a user's own function as a study keeps it: plain values, of columns that are free."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import asdict, is_dataclass
from enum import Enum
from typing import Any

import numpy as np

from antennate.errors import BadInputError
from antennate.files import in_units
from antennate.messages import shortened
from antennate.studies.formats import dumped

OF_STUDY = ("point", "trial", "seed", "status", "reason")
"""Columns that a study fills itself."""
LARGEST_ROW = 1_000_000
"""Most bytes of a row as JSON: a million rows of a hundred numbers have 2 kB each (assumed)."""


def own_row(found: Any, taken: Collection[str] = ()) -> dict[str, Any]:
    """What a function returned as a row of plain values.

    Args:
        found: A dictionary or a dataclass. Scalars of NumPy become numbers, arrays lists.
        taken: Names of what varies; they are columns of the study as well.

    Raises:
        BadInputError: It is something else, too large, or has a column or a value that cannot be
            kept.
    """
    if is_dataclass(found) and not isinstance(found, type):
        found = asdict(found)
    if not isinstance(found, Mapping):
        kind = type(found).__name__
        raise BadInputError(f"expected a row as a dictionary or a dataclass, found {kind}")
    row: dict[str, Any] = {}
    for name, value in found.items():
        if not isinstance(name, str):
            kind = type(name).__name__
            raise BadInputError(f"expected names of columns as text, found {kind}")
        if name in OF_STUDY or name in taken:
            raise BadInputError(
                f"column {shortened(name)}: expected another name, as the study has this column"
            )
        row[_text(name, "the name of a column")] = _plain(value, f"column {shortened(name)}")
    if (size := len(dumped(row))) > LARGEST_ROW:
        raise BadInputError(
            f"expected a row of at most {in_units(LARGEST_ROW)} as JSON, found {in_units(size)}"
        )
    return row


def _plain(value: Any, where: str) -> Any:
    """A value as JSON has it."""
    match value:
        case Enum():
            return _plain(value.value, where)
        case None | bool():
            return value
        case np.bool_():
            return bool(value)
        case int() | np.integer():
            return _whole(int(value), where)
        case float() | np.floating():
            return float(value)
        case str():
            return _text(value, where)
        case np.ndarray():
            return _plain(value.tolist(), where)
        case list() | tuple():
            return [_plain(item, where) for item in value]
        case Mapping():
            return {_key(key, where): _plain(item, where) for key, item in value.items()}
    kind = type(value).__name__  # its own text may be long, or raise
    raise BadInputError(f"{where}: expected numbers or text, found an object of type {kind}")


def _key(value: Any, where: str) -> str:
    if not isinstance(value, str):
        raise BadInputError(f"{where}: expected keys as text, found {type(value).__name__}")
    return _text(value, where)


def _whole(value: int, where: str) -> int:
    try:
        float(value)
    except OverflowError:
        raise BadInputError(
            f"{where}: expected a number below 1.8e308, found a whole number of "
            f"{value.bit_length()} bits"
        ) from None
    return value


def _text(value: str, where: str) -> str:
    try:
        value.encode()
    except UnicodeEncodeError:
        raise BadInputError(f"{where}: expected Unicode text, found {value[:40]!a}") from None
    return str(value)
