"""Errors in one line: `where: expected ..., found ...`."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from difflib import get_close_matches
from typing import Any

from pydantic import BaseModel, ValidationError

_CONTROL = re.compile(r"[\x00-\x1f\x7f-\x9f]+")
_LONGEST = 80
"""Most characters of a found value that are shown."""

_EXPECTED = {
    "greater_than": "a number above {gt:g}",
    "greater_than_equal": "a number of at least {ge:g}",
    "less_than": "a number below {lt:g}",
    "less_than_equal": "a number of at most {le:g}",
    "finite_number": "a finite number",
    "literal_error": "one of {expected}",
    "too_short": "at least {min_length} value(s)",
    "too_long": "at most {max_length} value(s)",
    "missing": "a value",
}
"""What pydantic's error types ask for."""

_KINDS = {"int": "a whole number", "float": "a number", "tuple": "a list", "model": "a table"}
"""What pydantic's families of error types ask for, by the first word of the type."""


def one_line(text: str) -> str:
    """The text without line breaks and control characters."""
    return " ".join(_CONTROL.sub(" ", text).split())


def nearest(word: str, known: Iterable[str]) -> str:
    """A hint at the nearest of the known words, or nothing."""
    close = get_close_matches(word, list(known), n=1, cutoff=0.6)
    return f" (did you mean {close[0]}?)" if close else ""


def shown(value: Any) -> str:
    """A value as found, in one short line."""
    text = one_line(repr(value))
    return text if len(text) <= _LONGEST else text[: _LONGEST - 3] + "..."


def dotted(path: tuple[int | str, ...]) -> str:
    """`("tunnel", "segments", 0)` as `tunnel.segments[0]`."""
    text = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in path)
    return one_line(text.lstrip("."))


def flag(path: tuple[int | str, ...]) -> str:
    """`("tunnel", "segments", 0)` as `--tunnel.segments`."""
    return "--" + ".".join(part for part in path if isinstance(part, str)).replace("_", "-")


def describe(
    error: ValidationError, model: type[BaseModel], where: Callable[[tuple[int | str, ...]], str]
) -> str:
    """The first fault pydantic found, placed by `where`, and how many more there are."""
    faults = error.errors(include_url=False)
    first = faults[0]
    kind, path, context = first["type"], first["loc"], first.get("ctx", {})
    more = f" (and {len(faults) - 1} more)" if len(faults) > 1 else ""
    if kind == "value_error":
        place = f"{dotted(path)}: " if path else ""
        return f"{place}{context['error']}{more}"
    if kind == "extra_forbidden":
        key, group = str(path[-1]), dotted(path[:-1])
        known = _keys(model, path[:-1])
        what = f"a known key{f' of {group}' if group else ''}{nearest(key, known)}"
        return f"{where(path)}: expected {what}, found {shown(key)}{more}"
    found = "none" if kind == "missing" else shown(first["input"])
    return (
        f"{where(path)}: expected {_expected(kind, context) or first['msg']}, found {found}{more}"
    )


def _expected(kind: str, context: Mapping[str, Any]) -> str | None:
    if kind in _EXPECTED:
        return _EXPECTED[kind].format(**context).replace("'", "")
    return _KINDS.get(kind.split("_")[0])


def _keys(model: type[BaseModel], path: tuple[int | str, ...]) -> list[str]:
    """Keys of the group at `path`."""
    group: Any = model
    for part in path:
        group = group.model_fields[str(part)].annotation
    return list(group.model_fields)
