"""Configurations as TOML, results as strict JSON, rows as CSV; and rows back from CSV.

What workers return is kept as JSON too, with its types and every bit of every number: dataclasses,
models, enumerations, tuples and arrays are objects with the key `@`. Nothing is ever unpickled: a
file names only classes of packages that are trusted already.
"""

from __future__ import annotations

import base64
import csv
import io
import json
import math
import re
import sys
from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, fields, is_dataclass
from enum import Enum
from html import escape
from typing import Any, cast

import numpy as np
from pydantic import BaseModel

from antennate.errors import BadInputError, ConfigError
from antennate.messages import shown
from antennate.params.base import Params, meaning

_CONTROL = re.compile(r"[\x00-\x1f\x7f-\x9f]+")
_NUMBERS = {
    int: re.compile(r"0|-?[1-9][0-9]*"),
    float: re.compile(r"-?(0|[1-9][0-9]*)(\.[0-9]+)?(e[+-]?[0-9]+)?|-?inf|nan"),
}
"""Numbers as they are written."""
_FORMULA = ("=", "+", "-", "@")
_BAR = re.compile(r"`([^`]*\|[^`]*)`|\|")


def strict(value: Any) -> Any:
    """The value with every NaN and infinity as None, and arrays as lists, fit for strict JSON."""
    if isinstance(value, Mapping):
        return {key: strict(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [strict(item) for item in value]
    if isinstance(value, np.ndarray | np.generic):
        return strict(value.tolist())
    return None if isinstance(value, float) and not math.isfinite(value) else value


def to_json(value: Any) -> str:
    """Strict JSON, indented, as result.json holds it.

    Raises:
        BadInputError: It holds an object of another kind.
    """
    return json.dumps(strict(value), indent=2, allow_nan=False, default=_refuse) + "\n"


def pieces(content: str | bytes | Iterator[str]) -> Iterator[bytes]:
    """The content of a file, piece by piece.

    Raises:
        ConfigError: It is neither text nor bytes nor pieces of text.
    """
    if not isinstance(content, str | bytes | Iterator):
        raise ConfigError(f"content: expected text, bytes or pieces, found {shown(content)}")
    for piece in (content,) if isinstance(content, str | bytes) else content:
        if not isinstance(piece, str | bytes):
            raise ConfigError(f"content: expected pieces of text, found {shown(piece)}")
        yield piece.encode() if isinstance(piece, str) else piece


def as_mapping(row: Any) -> Mapping[str, Any]:
    """A row by the names of its fields.

    Raises:
        ConfigError: It is neither a mapping nor a dataclass.
    """
    if isinstance(row, Mapping):
        return cast("Mapping[str, Any]", row)
    if not is_dataclass(row) or isinstance(row, type):
        raise ConfigError(f"row: expected a dictionary or a dataclass, found {shown(row)}")
    return asdict(row)


def _refuse(value: Any) -> Any:
    raise BadInputError(
        "expected numbers, texts, lists and dictionaries in a result or row, found "
        f"{type(value).__name__}"
    )


def to_csv(rows: Iterable[Mapping[str, Any]]) -> str:
    """A table with a header; text that a spreadsheet would take for a formula gets a quote."""
    return "".join(csv_lines(rows))


def csv_lines(rows: Iterable[Mapping[str, Any]]) -> Iterator[str]:
    """The same line by line, for a table that does not fit into memory.

    Raises:
        ConfigError: A row has other columns than the first.
    """
    file = io.StringIO()
    writer = csv.writer(file, lineterminator="\n")
    names: Sequence[str] = ()
    for number, row in enumerate(rows):
        if not number:
            names = list(row)
            writer.writerow(names)
        if row.keys() != set(names):
            raise ConfigError(
                f"row {number}: expected the columns {', '.join(names)}, found {', '.join(row)}"
            )
        writer.writerow([_cell(row[name]) for name in names])
        yield file.getvalue()
        file.seek(0)
        file.truncate()


def from_csv(text: str) -> list[dict[str, Any]]:
    """Rows of such a table; numbers as int or float, empty cells as None.

    Raises:
        ValueError: It is no such table.
    """
    usual = csv.field_size_limit(max(len(text), csv.field_size_limit()))
    try:
        lines = csv.reader(io.StringIO(text), strict=True)
        names = next(lines, [])
        if twice := [name for name, count in Counter(names).items() if count > 1]:
            raise ValueError(f"the column {twice[0]!r} twice")
        rows: list[dict[str, Any]] = []
        for line in filter(None, lines):
            if len(line) != len(names):
                raise ValueError(f"{len(line)} of {len(names)} cells in row {len(rows) + 1}")
            rows.append(dict(zip(names, map(_value_of, line), strict=True)))
        if not rows or not text.endswith("\n"):
            raise ValueError("no end of its last row" if rows else "no row")
        return rows
    except csv.Error as error:
        raise ValueError(str(error)) from None
    finally:
        csv.field_size_limit(usual)


def _cell(value: Any) -> Any:
    if not isinstance(value, str):
        return value
    text = _CONTROL.sub(" ", value)
    return f"'{text}" if text.startswith(_FORMULA) else text


def _value_of(cell: str | None) -> Any:
    if not cell:
        return None
    if cell in ("True", "False"):
        return cell == "True"
    for kind, form in _NUMBERS.items():
        if form.fullmatch(cell):
            return kind(cell)
    return cell[1:] if cell.startswith("'") and cell[1:].startswith(_FORMULA) else cell


def to_toml(config: Params) -> str:
    """The complete configuration, each number with its unit and meaning.

    Reading it back gives an equal one.
    """
    return "\n".join(_lines(config, ())) + "\n"


def _lines(group: Params, path: tuple[str, ...]) -> Iterator[str]:
    if path:
        yield ""
        yield f"[{'.'.join(path)}]"
    groups = []
    written = group.model_dump()
    for name in (name for name in type(group).model_fields if name in written):
        value = getattr(group, name)
        if isinstance(value, Params):
            groups.append((name, value))
        elif value is None:
            yield f"# {name} is not set: {meaning(type(group), name)}"
        else:
            yield f"{name} = {_toml(value)}  # {meaning(type(group), name)}"
    for name, value in groups:
        yield from _lines(value, (*path, name))


def _toml(value: Any) -> str:
    if isinstance(value, tuple | list):
        return f"[{', '.join(_toml(item) for item in value)}]"
    if isinstance(value, BaseModel):
        value = value.model_dump(exclude_defaults=True)
    if isinstance(value, Mapping):
        items = (f"{_toml(key)} = {_toml(item)}" for key, item in value.items())
        return f"{{{', '.join(items)}}}"
    if isinstance(value, str | bool):
        # unlike JSON, TOML takes no halves of a character, and no bare delete character
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    return repr(value)


_KIND = "@"


def encoded(value: Any) -> Any:
    """A value as what JSON can hold.

    Raises:
        TypeError: It holds an object of another kind.
    """
    match value:
        case Enum():
            return {_KIND: _name(value), "value": value.value}
        case np.ndarray() | np.generic():
            data = base64.b64encode(np.ascontiguousarray(value).tobytes()).decode()
            kind = "array" if isinstance(value, np.ndarray) else "scalar"
            return {_KIND: kind, "dtype": value.dtype.str, "shape": value.shape, "data": data}
        case None | bool() | int() | float() | str():
            return value
        case BaseModel():
            return {_KIND: _name(value), "fields": value.model_dump_json()}
        case tuple():
            return {_KIND: "tuple", "of": [encoded(item) for item in value]}
        case list():
            return [encoded(item) for item in value]
        case Mapping():
            pairs = [(encoded(key), encoded(item)) for key, item in value.items()]
            if all(isinstance(key, str) and key != _KIND for key, _ in pairs):
                return dict(pairs)
            return {_KIND: "dict", "of": pairs}
    if is_dataclass(value) and not isinstance(value, type):
        return {_KIND: _name(value)} | {
            field.name: encoded(getattr(value, field.name)) for field in fields(value)
        }
    raise TypeError(f"expected a result that can be kept, found {type(value).__name__}")


def decoded(data: Any, packages: Collection[str] | None) -> Any:
    """Back from `encoded`.

    Args:
        data: What JSON held.
        packages: Top-level packages whose classes may be named; None for what objects of any class
            say in place of them.

    Raises:
        ValueError: It is nothing that `encoded` makes.
    """
    if isinstance(data, list):
        return [decoded(item, packages) for item in data]
    if not isinstance(data, dict):
        return data
    kind = data.get(_KIND)
    if kind is None:
        return {key: decoded(item, packages) for key, item in data.items()}
    try:
        if kind == "tuple":
            return tuple(decoded(item, packages) for item in data["of"])
        if kind == "dict":
            return {decoded(k, packages): decoded(item, packages) for k, item in data["of"]}
        if kind in ("array", "scalar"):
            flat = np.frombuffer(base64.b64decode(data["data"]), np.dtype(data["dtype"]))
            array = flat.reshape(data["shape"]).copy()
            return array if kind == "array" else array[()]
        if packages is None:
            return _plain(data)
        return _object(_class(kind, packages), data, packages)
    except (KeyError, TypeError, AttributeError) as error:
        raise ValueError(f"expected a result, found {error}") from None


def _object(kind: type, data: Mapping[str, Any], packages: Collection[str]) -> Any:
    if issubclass(kind, Enum):
        return kind(data["value"])
    if issubclass(kind, BaseModel):
        return kind.model_validate_json(data["fields"])
    if not is_dataclass(kind):
        raise TypeError(f"the class {kind.__name__}")
    return kind(**{k: decoded(item, packages) for k, item in data.items() if k != _KIND})


def _name(value: Any) -> str:
    return f"{type(value).__module__}:{type(value).__qualname__}"


def _class(name: str, packages: Collection[str]) -> type:
    """A class that is imported already, of a trusted package."""
    module, _, path = name.partition(":")
    if module.partition(".")[0] not in packages or module not in sys.modules:
        raise TypeError(f"a class of {module}")
    kind: Any = sys.modules[module]
    for part in path.split("."):
        kind = getattr(kind, part)
    if not isinstance(kind, type):
        raise TypeError(f"no class {name}")
    return kind


def plain_row(data: Mapping[str, Any]) -> dict[str, Any]:
    """A row as a table has it, from what `encoded` made of its dataclass."""
    return {key: strict(decoded(item, None)) for key, item in data.items() if key != _KIND}


def _plain(data: Mapping[str, Any]) -> Any:
    """What an object of any class says: an enumeration, a model, or the fields of a dataclass."""
    if data.keys() == {_KIND, "value"}:
        return data["value"]
    return json.loads(data["fields"]) if data.keys() == {_KIND, "fields"} else plain_row(data)


def dumped(value: Any) -> str:
    """JSON on one line; NaN and infinities are kept.

    Raises:
        BadInputError: It holds an object of another kind.
    """
    return json.dumps(value, separators=(",", ":"), default=_refuse)


def markdown_row(*cells: object) -> str:
    """A row of a table in Markdown."""
    return "| " + " | ".join(_BAR.sub(_without_bar, str(cell)) for cell in cells) + " |"


def _without_bar(found: re.Match[str]) -> str:
    """Code, or a bar alone, without a character that would end the cell."""
    code = found[1]
    if code is None:
        return "&#124;"
    return f"<code>{escape(code, quote=False).replace('|', '&#124;')}</code>"


def markdown_heads(*names: str) -> str:
    """The first two lines of a table in Markdown."""
    return markdown_row(*names) + "\n" + "|" + "---|" * len(names)
