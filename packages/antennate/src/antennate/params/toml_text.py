"""Keys of a TOML text that are set, while all else in it stays, comments too."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, MutableMapping, Sequence
from typing import Any

import tomlkit
from tomlkit.items import InlineTable

Value = str | int | float | bool | Sequence[str] | Sequence[int] | Sequence[float]
Key = tuple[str, ...]


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
