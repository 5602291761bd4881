"""Changes a few keys of a TOML file and leaves all else in it, comments too, as it stands.

The result is parsed again and compared with what it has to be, so that a file of a form that is not
understood here (an inline table, a dotted key) is refused and never spoilt.
"""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from antennate.errors import ConfigError
from antennate.files import decoded, read_limited, write_whole
from antennate.params.reading import LARGEST_FILE, put_over

Value = str | int | float | bool | Sequence[str] | Sequence[int]
Key = tuple[str, ...]
_TABLE = re.compile(r"\s*\[([A-Za-z0-9_.\- ]+)\]\s*(?:#.*)?")


def change(path: Path, values: Mapping[Key, Value]) -> None:
    """Set keys of a file, which is made if it is not there.

    Args:
        path: The file.
        values: By their tables and name, such as `("robot", "yaw", "zeros")`.

    Raises:
        ConfigError: The file cannot be read or has a form that cannot be changed; it is as before.
        OutputError: It cannot be written.
    """
    text = ""
    if path.exists():
        text = decoded(path, read_limited(path, LARGEST_FILE, ConfigError), ConfigError)
    try:
        changed = edited(text, values)
    except (tomllib.TOMLDecodeError, ValueError) as error:
        keys = ", ".join(f"{'.'.join(key)} = {_toml(value)}" for key, value in values.items())
        raise ConfigError(
            f"{path}: expected plain tables that can be changed, found: {error}; write by hand: "
            f"{keys}"
        ) from None
    if changed != text:
        write_whole(path, changed.encode(), overwrite=True)


def edited(text: str, values: Mapping[Key, Value]) -> str:
    """The text with keys set.

    Raises:
        ValueError: It is no TOML, or not of a form that can be changed.
    """
    wanted: Mapping[str, Any] = tomllib.loads(text)
    for key, value in values.items():
        wanted = put_over(wanted, _nested(key, value))
        text = _set(text, key, _toml(value))
    if tomllib.loads(text) != wanted:
        raise ValueError("a table written in another form")
    return text


def _set(text: str, key: Key, value: str) -> str:
    *tables, name = key
    lines = text.splitlines()
    begin, end = _table(lines, ".".join(tables))
    line = f"{name} = {value}"
    if begin is None:
        return "\n".join([*_ended(lines), f"[{'.'.join(tables)}]", line, ""])
    for at in range(begin, end):
        if re.match(rf"\s*{re.escape(name)}\s*=", lines[at]):
            last = _end_of_value(lines, at, end)
            comment = _comment(lines[at]) if last == at + 1 else ""
            return "\n".join([*lines[:at], line + comment, *lines[last:], ""])
    while end > begin and not lines[end - 1].strip():
        end -= 1
    return "\n".join([*lines[:end], line, *lines[end:], ""])


def _table(lines: Sequence[str], name: str) -> tuple[int | None, int]:
    """First line of a table's content and the line after it; None if there is no such table."""
    begin = None if name else 0
    for at, line in enumerate(lines):
        if (found := _TABLE.fullmatch(line)) or line.lstrip().startswith("[["):
            if begin is not None:
                return begin, at
            if found and "".join(found[1].split()) == name:
                begin = at + 1
    return begin, len(lines)


def _end_of_value(lines: Sequence[str], at: int, end: int) -> int:
    """The line after a value, which may take several lines."""
    for last in range(at + 1, end + 1):
        try:
            tomllib.loads("\n".join(lines[at:last]))
        except tomllib.TOMLDecodeError:
            continue
        return last
    return at + 1


def _comment(line: str) -> str:
    """The comment behind a value on one line, with the space before it."""
    for at in (found.start() for found in re.finditer(r"\s*#", line)):
        try:
            if tomllib.loads(line[:at]) == tomllib.loads(line):
                return line[at:]
        except tomllib.TOMLDecodeError:
            continue
    return ""


def _ended(lines: Sequence[str]) -> list[str]:
    """Lines with an empty one at their end, unless there are none."""
    return [*lines, ""] if lines and lines[-1].strip() else list(lines)


def _nested(key: Key, value: Any) -> dict[str, Any]:
    value = list(value) if isinstance(value, (tuple, list)) else value
    for part in reversed(key):
        value = {part: value}
    return value


def _toml(value: object) -> str:
    if isinstance(value, (tuple, list)):
        return f"[{', '.join(map(_toml, value))}]"
    return json.dumps(value, ensure_ascii=False)
