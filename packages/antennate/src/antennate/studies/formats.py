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
import operator
import re
import sys
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
_ENDLESS = "one that holds itself or is nested too deep"
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
    """Strict JSON, indented, as result.json holds it."""
    try:
        return json.dumps(strict(value), indent=2, allow_nan=False, default=_refuse) + "\n"
    except RecursionError:
        raise BadInputError(f"expected a result that can be kept, found {_ENDLESS}") from None


def pieces(content: str | bytes | Iterator[str]) -> Iterator[bytes]:
    """The content of a file, piece by piece."""
    for piece in content if isinstance(content, Iterator) else [content]:
        if not isinstance(piece, str | bytes):
            raise ConfigError(f"content: expected text, bytes or pieces, found {shown(piece)}")
        yield piece.encode() if isinstance(piece, str) else piece


def as_mapping(row: Any) -> Mapping[str, Any]:
    """A row by the names of its fields."""
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
    """Lines of a table as of `to_csv`, for one that does not fit into memory."""
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
    """Rows of such a table; numbers as int or float, empty cells as None."""
    csv.field_size_limit(max(len(text), csv.field_size_limit()))
    try:
        lines = csv.reader(io.StringIO(text), strict=True)
        names = next(lines, [])
        if twice := [name for name in names if names.count(name) > 1]:
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
            yield f"# {name} is not set: {meaning(type(group), name, listed=False)}"
        else:
            yield f"{name} = {_toml(value)}  # {meaning(type(group), name, listed=False)}"
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


def encoded(value: Any) -> Any:
    """A value as what JSON can hold.

    Raises:
        TypeError: It has a part that cannot be kept, or holds itself.
    """
    try:
        return _encoded(value)
    except RecursionError:
        raise TypeError(f"expected a result that can be kept, found {_ENDLESS}") from None


def _encoded(value: Any) -> Any:
    match value:
        case Enum():
            return {"@": _name(value), "value": value.value}
        case np.ndarray() | np.generic():
            data = base64.b64encode(np.ascontiguousarray(value).tobytes()).decode()
            return {"@": "array", "dtype": value.dtype.str, "shape": value.shape, "data": data}
        case None | bool() | int() | float() | str():
            return value
        case BaseModel():
            return {"@": _name(value), "fields": value.model_dump_json()}
        case tuple():
            return {"@": "tuple", "of": _encoded([*value])}
        case list():
            return [_encoded(item) for item in value]
        case Mapping():
            if all(isinstance(key, str) and key != "@" for key in value):
                return {key: _encoded(item) for key, item in value.items()}
            return {"@": "dict", "of": [[_encoded(k), _encoded(v)] for k, v in value.items()]}
    if not is_dataclass(value) or isinstance(value, type):
        raise TypeError(f"expected a result that can be kept, found {type(value).__name__}")
    said = {field.name: _encoded(getattr(value, field.name)) for field in fields(value)}
    return {"@": _name(value), **said}


def decoded(data: Any, packages: Collection[str] | None) -> Any:
    """Back from `encoded`.

    Args:
        data: What JSON held.
        packages: Top-level packages whose classes may be named; None for the fields of an object in
            place of it, whatever its class.
    """
    match data:
        case list():
            return [decoded(item, packages) for item in data]
        case {"@": "tuple", "of": items}:
            return tuple(decoded(items, packages))
        case {"@": "dict", "of": pairs}:
            return dict(decoded(pairs, packages))
        case {"@": "array", "dtype": dtype, "shape": shape, "data": text}:
            flat = np.frombuffer(base64.b64decode(text), np.dtype(dtype))
            return flat.reshape(shape).copy()[()]
        case {"@": name, **said} if packages is not None:
            return _object(name, said, packages)
        case dict():
            return {key: decoded(item, packages) for key, item in data.items() if key != "@"}
        case _:
            return data


def _object(name: str, said: Mapping[str, Any], packages: Collection[str]) -> Any:
    """An object of a class that is imported already, of a trusted package."""
    module, _, path = name.partition(":")
    if module.partition(".")[0] not in packages:
        raise ValueError(f"expected a class of {' or '.join(packages)}, found {name}")
    try:
        kind: Any = operator.attrgetter(path)(sys.modules[module])
        if issubclass(kind, Enum):
            return kind(said["value"])
        if issubclass(kind, BaseModel):
            return kind.model_validate_json(said["fields"])
        fields(kind)  # of a dataclass; else a TypeError
        return kind(**decoded(said, packages))
    except (LookupError, TypeError, AttributeError) as error:
        raise ValueError(f"expected a result, found {error}") from None


def _name(value: Any) -> str:
    return f"{type(value).__module__}:{type(value).__qualname__}"


def dumped(value: Any) -> str:
    """JSON on one line; NaN and infinities are kept."""
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
