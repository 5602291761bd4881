"""A configuration as TOML, each number with its unit and meaning."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

from antennate.params import Params


def to_toml(config: Params) -> str:
    """The complete configuration; reading it back gives an equal one."""
    return "\n".join(_lines(config, ())) + "\n"


def _lines(group: Params, path: tuple[str, ...]) -> Iterator[str]:
    if path:
        yield ""
        yield f"[{'.'.join(path)}]"
    groups = []
    for name, field in type(group).model_fields.items():
        value = getattr(group, name)
        if isinstance(value, Params):
            groups.append((name, value))
        elif value is None:
            yield f"# {name} is not set: {field.description}"
        else:
            yield f"{name} = {_value(value)}  # {field.description}"
    for name, value in groups:
        yield from _lines(value, (*path, name))


def _value(value: Any) -> str:
    if isinstance(value, tuple):
        return f"[{', '.join(_value(item) for item in value)}]"
    return json.dumps(value) if isinstance(value, str | bool) else repr(value)
