"""A configuration from a TOML file, or from values given in Python."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar, cast

from pydantic import BaseModel, ValidationError

from antennate.errors import ConfigError
from antennate.files import TOO_LONG, read_toml
from antennate.params.base import Params
from antennate.params.faults import describe, group_of

LARGEST_FILE = 1_000_000
"""Most bytes of a configuration file."""

Config = TypeVar("Config", bound=Params)


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
    table = with_bases(read_toml(path, LARGEST_FILE), model, path.parent)
    try:
        text = json.dumps(table, default=str)
    except ValueError:  # of TOML's whole numbers in other bases
        raise ConfigError(f"{path}: {TOO_LONG}") from None
    try:
        return model.model_validate_json(text, strict=True)
    except ValidationError as error:
        raise ConfigError(f"{path}: {describe(error, model)}") from None


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
