"""Changes a few keys of a TOML file and leaves all else in it, comments too, as it stands."""

from __future__ import annotations

import tomllib
from codecs import BOM_UTF8
from collections.abc import Mapping, MutableMapping, Sequence
from pathlib import Path
from typing import Any

import tomlkit
from tomlkit.exceptions import TOMLKitError
from tomlkit.items import InlineTable

from antennate.errors import ConfigError
from antennate.files import decoded, read_limited, write_whole
from antennate.params.base import LARGEST_FILE

Value = str | int | float | bool | Sequence[str] | Sequence[int] | Sequence[float]
Key = tuple[str, ...]


def change(path: Path, values: Mapping[Key, Value]) -> None:
    """Set keys of a file, which is made if it is not there.

    Args:
        path: The file.
        values: By their tables and name, such as `("robot", "yaw", "zeros")`.
    """
    data, changed = _read_and_edited(path, values)
    if changed != data:
        write_whole(path, changed, overwrite=True)


def require_changeable(path: Path, values: Mapping[Key, Value]) -> None:
    """Check that keys of a file can be set, before somebody works for their values.

    Args:
        path: The file.
        values: As of `change`.
    """
    _read_and_edited(path, values)


def _read_and_edited(path: Path, values: Mapping[Key, Value]) -> tuple[bytes, bytes]:
    """The bytes of a file, none if it is not there, and those with keys set.

    A byte order mark stays, and new lines end as those of the file.
    """
    data = read_limited(path, LARGEST_FILE, ConfigError) if path.exists() else b""
    text = decoded(path, data, ConfigError)
    try:
        changed = edited(text, values)
    except (TOMLKitError, ValueError) as error:
        keys = ", ".join(
            f"{'.'.join(key)} = {tomlkit.item(value).as_string()}" for key, value in values.items()
        )
        raise ConfigError(
            f"{path}: expected tables that can be changed, found: {error}; write by hand: {keys}"
        ) from None
    if "\r\n" in text and text.count("\n") == text.count("\r\n"):
        changed = changed.replace("\r\n", "\n").replace("\n", "\r\n")
    return data, (BOM_UTF8 if data.startswith(BOM_UTF8) else b"") + changed.encode()


def edited(text: str, values: Mapping[Key, Value]) -> str:
    """The text with keys set."""
    document = tomlkit.parse(text)
    for (*tables, name), value in values.items():
        table: MutableMapping[str, Any] = document
        for place, part in enumerate(tables):
            if part not in table:
                table[part] = (
                    tomlkit.inline_table()
                    if isinstance(table, InlineTable)
                    else tomlkit.table(is_super_table=place + 1 < len(tables))
                )
            table = table[part]
            if not isinstance(table, MutableMapping):
                raise ValueError(f"{'.'.join(tables[: place + 1])} = {table!r}")
        if name not in table or table[name] != value:
            table[name] = list(value) if isinstance(value, tuple) else value
    changed = tomlkit.dumps(document)
    if tomllib.loads(changed) != document.unwrap():
        raise ValueError("tables in a form that would be spoilt")
    return changed
