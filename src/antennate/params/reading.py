"""A configuration from a TOML file, and what is wrong with one, in one line."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path
from types import UnionType
from typing import Any, TypeVar, Union, cast, get_args, get_origin

from pydantic import BaseModel, ValidationError

from antennate.errors import ConfigError
from antennate.files import decoded, read_limited
from antennate.messages import nearest, one_line, shown
from antennate.params.base import Params

LARGEST_FILE = 1_000_000
"""Most bytes of a configuration file."""
_MOST_DOTS = 100
"""Most dots on a line of it; keys of thousands of parts would keep the reader busy for minutes."""
_TOO_LONG = "expected numbers of at most 4300 digits, found more"
"""Python's own limit for whole numbers."""

Config = TypeVar("Config", bound=Params)
Place = tuple[int | str, ...]

_EXPECTED = {
    "greater_than": "a number above {gt:g}",
    "greater_than_equal": "a number of at least {ge:g}",
    "less_than": "a number below {lt:g}",
    "less_than_equal": "a number of at most {le:g}",
    "finite_number": "a finite number",
    "literal_error": "one of {expected}",
    "too_short": "at least {min_length} values",
    "too_long": "at most {max_length} values",
    "missing": "a value",
}
"""What pydantic's error types ask for."""

_KINDS = {
    "int": "a whole number",
    "float": "a number",
    "bool": "true or false",
    "string": "text",
    "tuple": "a list",
    "dict": "a table",
    "model": "a table",
}
"""What pydantic's families of error types ask for, by the first word of the type."""


def read_file(path: Path, model: type[Config]) -> Config:
    """A configuration from a TOML file with the model's keys.

    Where the model has a group of which some are known by name, such as a robot, the file may hold
    that name or the path of a file, or a table whose `base` is one; a path starts at the folder of
    the file that holds it.

    Args:
        path: The file.
        model: What it holds.

    Raises:
        ConfigError: The file cannot be read, is no TOML, or holds what the model refuses.
    """
    table = with_bases(_table_of(path), model, path.parent)
    try:
        text = json.dumps(table, default=str)
    except ValueError:  # of TOML's whole numbers in other bases
        raise ConfigError(f"{path}: {_TOO_LONG}") from None
    try:
        return model.model_validate_json(text, strict=True)
    except ValidationError as error:
        raise ConfigError(f"{path}: {describe(error, model)}") from None


def _table_of(path: Path) -> dict[str, Any]:
    text = decoded(path, read_limited(path, LARGEST_FILE, ConfigError), ConfigError)
    for number, line in enumerate(text.splitlines(), 1):
        if line.count(".") > _MOST_DOTS:
            raise ConfigError(
                f"{path}: line {number}: expected at most {_MOST_DOTS} dots, found more"
            )
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ConfigError(f"{path}: expected TOML, found: {error}") from None
    except ValueError:
        raise ConfigError(f"{path}: {_TOO_LONG}") from None
    except RecursionError:
        raise ConfigError(f"{path}: expected plain tables, found them nested too deeply") from None


def with_bases(table: Mapping[str, Any], model: type[BaseModel], folder: Path) -> dict[str, Any]:
    """The table with names and bases of known groups replaced by what they stand for."""
    result = dict(table)
    for name, field in model.model_fields.items():
        group, value = group_of(field.annotation), table.get(name)
        named = getattr(group, "named", None)
        if group is None:
            continue
        if named is not None and isinstance(value, str):
            value = {"base": value}
        if isinstance(value, dict):
            value = with_bases(cast("dict[str, Any]", value), group, folder)
            if named is not None and isinstance(base := value.get("base"), str):
                known = named(base, folder).model_dump(mode="json")
                value = put_over(known, {k: v for k, v in value.items() if k != "base"})
            result[name] = value
    return result


def put_over(base: Mapping[str, Any], table: Mapping[str, Any]) -> dict[str, Any]:
    """Nested tables: the values of `table` over those of `base`."""
    result = dict(base)
    for key, value in table.items():
        old = result.get(key)
        if isinstance(old, dict) and isinstance(value, dict):
            old, value = cast("dict[str, Any]", old), cast("dict[str, Any]", value)
            result[key] = put_over(old, value)
        else:
            result[key] = value
    return result


def from_values(model: type[Config], values: Mapping[str, Any]) -> Config:
    """A configuration from values given in Python.

    Raises:
        ConfigError: A value is unknown, of the wrong type or out of bounds.
    """
    try:
        return model.model_validate(dict(values))
    except ValidationError as error:
        raise ConfigError(describe(error, model)) from None


def dotted(path: Place) -> str:
    """`("tunnel", "segments", 0)` as `tunnel.segments[0]`."""
    text = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in path)
    return one_line(text.lstrip("."))


def describe(
    error: ValidationError,
    model: type[Any],
    where: Callable[[Place], str] = dotted,
    found: Callable[[Any], str] = shown,
) -> str:
    """The first fault pydantic found, and how many more there are.

    Args:
        error: What it raised.
        model: The model or dataclass that was to be filled.
        where: How a place in it is written.
        found: How a value is written.
    """
    every = error.errors(include_url=False)
    inner = {fault["loc"][:n] for fault in every for n in range(len(fault["loc"]))}
    faults = [fault for fault in every if fault["loc"] not in inner]  # not what follows from one
    first = faults[0]
    kind, path, context = first["type"], first["loc"], first.get("ctx", {})
    more = f" (and {len(faults) - 1} more)" if len(faults) > 1 else ""
    if kind == "value_error":
        spell = dotted if _keys(model, path) else where  # a group is no flag
        place = f"{spell(path)}: " if path else ""
        return f"{place}{context['error']}{more}"
    if kind == "extra_forbidden":
        key, group = str(path[-1]), dotted(path[:-1])
        known = _keys(model, path[:-1])
        what = f"a known key{f' of {group}' if group else ''}{nearest(key, known)}"
        return f"{where(path)}: expected {what}, found {shown(key)}{more}"
    value = "none" if kind == "missing" else found(first["input"])
    return (
        f"{where(path)}: expected {_expected(kind, context) or first['msg']}, found {value}{more}"
    )


def _expected(kind: str, context: Mapping[str, Any]) -> str | None:
    if kind in _EXPECTED:
        text = _EXPECTED[kind].format(**context).replace("'", "")
        return text.removesuffix("s") if text.endswith(" 1 values") else text
    return _KINDS.get(kind.split("_")[0])


def group_of(annotation: Any) -> type[BaseModel] | None:
    """The model that an annotation names, alone or beside None; None if it names no model."""
    union = get_origin(annotation) in (Union, UnionType)
    for kind in get_args(annotation) if union else (annotation,):
        if isinstance(kind, type) and issubclass(kind, BaseModel):
            return kind
    return None


def _keys(model: type[BaseModel], path: Place) -> list[str]:
    """Keys of the group at `path`, none if it is not known."""
    for part in path:
        field = model.model_fields.get(str(part))
        group = None if field is None else group_of(field.annotation)
        if group is None:
            return []
        model = group
    return list(model.model_fields)
