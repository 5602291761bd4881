"""Messages of ROS 2 as bytes: CDR, little end first, as MCAP files of ROS 2 hold them.

A type is made from the text of its definition. Only what logs need is known: numbers, strings,
arrays of fixed length and sequences of both, without nesting.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Mapping, Sequence
from functools import lru_cache
from itertools import islice
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from antennate.errors import LogError

_HEADER = b"\0\1\0\0"
"""Plain CDR, little end first. Alignment counts from behind it."""
_CODES = {"bool": "?", "uint8": "B", "int32": "i", "uint32": "I", "int64": "q", "uint64": "Q"}
_CODES |= {"float64": "d"}
_LINE = re.compile(r"(\w+)(\[(\d*)\])? +(\w+) *(?:#.*)?")
_COUNT = struct.Struct("<I")


class Field(NamedTuple):
    """One field: its name, its code for `struct` (empty for a string), how many values it has.

    The number is 0 for a single value and None for a sequence.
    """

    name: str
    code: str
    number: int | None


class MessageType:
    """One type of messages.

    Args:
        name: Its name, such as `std_msgs/msg/String`.
        fields: A line for each field: type, name and a comment behind `#`.
        schema: Its definition, if that is nested and so is not `fields` itself.

    Attributes:
        name: Its name.
        schema: Its definition.
        fields: Its fields.
    """

    def __init__(self, name: str, fields: str, schema: str = "") -> None:
        self.name, self.schema = name, schema or fields
        self.fields = tuple(map(_field, fields.splitlines()))
        sizes = [0 if not f.code or f.number is None else max(1, f.number) for f in self.fields]
        self._leading = next((i for i, size in enumerate(sizes) if not size), len(sizes))
        layout, at = "<", 0
        for field, size in zip(self.fields[: self._leading], sizes, strict=False):
            width = struct.calcsize(f"<{field.code}")
            layout += f"{-at % width}x{size}{field.code}"
            at += -at % width + size * width
        self._first = struct.Struct(layout)

    def encode(self, *values: Any) -> bytes:
        """The bytes of a message with these values, one for each field."""
        flat: list[Any] = []
        for field, value in zip(self.fields[: self._leading], values, strict=False):
            flat += value if field.number else (value,)
        try:
            body = bytearray(self._first.pack(*flat))
            for field, value in zip(
                self.fields[self._leading :], values[self._leading :], strict=True
            ):
                _put(body, field, value)
        except (struct.error, OverflowError) as error:
            raise LogError(f"expected a {self.name} of numbers that fit, found: {error}") from None
        return _HEADER + body

    def holds(self, columns: Mapping[str, NDArray[Any]]) -> bool:
        """Whether numbers fit into their fields; names that are no fields are passed over."""
        given = [field for field in self.fields if field.name in columns]
        return all(_fits(columns[field.name], field.code) for field in given)

    def vary(self, data: bytes, columns: Mapping[str, NDArray[Any]]) -> list[bytes]:
        """Messages that differ from a given one in some of their numbers alone.

        Args:
            data: The bytes of the given one.
            columns: Numbers of each message by field, shape (n,), or (n, several) where the field
                has several. Names that are no fields are passed over.

        Raises:
            LogError: A number does not fit.
        """
        if not self.holds(columns):
            raise LogError(f"expected a {self.name} of numbers that fit, found others")
        names, formats, offsets = list[str](), list[Any](), list[int]()
        body, at = data[len(_HEADER) :], 0
        for field in self.fields:
            value, at = _take(body, at, field)
            if field.name in columns:
                kind = np.dtype((f"<{field.code}", np.shape(value)))
                names.append(field.name)
                formats.append(kind)
                offsets.append(len(_HEADER) + at - kind.itemsize)
        layout = np.dtype(
            {"names": names, "formats": formats, "offsets": offsets, "itemsize": len(data)}
        )
        count = len(next(iter(columns.values())))
        rows = np.frombuffer(bytearray(data * count), layout)
        for name in names:
            rows[name] = columns[name]
        return rows.view(f"V{len(data)}").tolist()

    def decode(self, data: bytes) -> dict[str, Any]:
        """The values by name; several are a tuple."""
        body = data[len(_HEADER) :]
        values: dict[str, Any] = {}
        try:
            if data[: len(_HEADER)] != _HEADER:
                raise ValueError("another encoding")
            at = self._first.size
            numbers = iter(self._first.unpack_from(body))
            for field in self.fields[: self._leading]:
                values[field.name] = (
                    tuple(islice(numbers, field.number)) if field.number else next(numbers)
                )
            for field in self.fields[self._leading :]:
                values[field.name], at = _take(body, at, field)
            if at != len(body):
                raise ValueError(f"{len(body) - at} bytes too many")
        except (struct.error, ValueError) as error:
            raise LogError(f"expected a {self.name}, found {len(data)} bytes: {error}") from None
        return values


def _field(line: str) -> Field:
    match = _LINE.fullmatch(line)
    if match is None:
        raise ValueError(f"expected a type and a name, found {line!r}")
    kind, several, count, name = match.groups()
    code = "" if kind == "string" else _CODES[kind]
    return Field(name, code, None if several and not count else int(count or 0))


def _fits(column: NDArray[Any], code: str) -> bool:
    """Whether `struct` packs each number by its code; NumPy would convert what it does not."""
    if code in ("d", "?"):
        return column.dtype.kind in "biuf"
    if not code or column.dtype.kind not in "biu":
        return False
    ends = np.iinfo(code)
    return not column.size or ends.min <= int(column.min()) <= int(column.max()) <= ends.max


def _put(body: bytearray, field: Field, value: Any) -> None:
    """Add what has no fixed place; several strings are kept for the next message."""
    if not field.code:
        body += bytes(-len(body) % 4)
        body += _strings(tuple(value)) if field.number is None else _strings((value,))[4:]
        return
    if field.number is None:
        body += bytes(-len(body) % 4) + _COUNT.pack(len(value))
    values: Sequence[Any] = value if field.number != 0 else (value,)
    if len(values):
        width = struct.calcsize(f"<{field.code}")
        body += bytes(-len(body) % width)
        if isinstance(values, np.ndarray):
            body += values.astype(f"<{field.code}", copy=False).tobytes()
        else:
            body += struct.pack(f"<{len(values)}{field.code}", *values)


@lru_cache(maxsize=256)
def _strings(values: tuple[str, ...]) -> bytes:
    """A sequence of strings that begins at a multiple of four bytes."""
    texts = [_COUNT.pack(len(values)), *map(_string, values)]
    return b"".join([text + bytes(-len(text) % 4) for text in texts[:-1]] + texts[-1:])


@lru_cache(maxsize=256)
def _string(text: str) -> bytes:
    data = text.encode("utf-8", "backslashreplace")
    return _COUNT.pack(len(data) + 1) + data + b"\0"


def _take(body: bytes, at: int, field: Field) -> tuple[Any, int]:
    """One value and where the next one begins."""
    count = field.number
    if count is None:
        at += -at % 4
        (count,) = _COUNT.unpack_from(body, at)
        at += _COUNT.size
    if not field.code:
        texts: list[str] = []
        for _ in range(count if field.number is None else 1):
            text, at = _text(body, at)
            texts.append(text)
        return (tuple(texts) if field.number is None else texts[0]), at
    width = struct.calcsize(f"<{field.code}")
    number = count or int(field.number == 0)
    at += -at % width if number else 0
    if number * width > len(body) - at:
        raise ValueError(f"{number} numbers in {len(body) - at} bytes")
    values = struct.unpack_from(f"<{number}{field.code}", body, at)
    return (values[0] if field.number == 0 else values), at + number * width


def _text(body: bytes, at: int) -> tuple[str, int]:
    at += -at % 4
    (size,) = _COUNT.unpack_from(body, at)
    at += _COUNT.size
    if not 1 <= size <= len(body) - at or body[at + size - 1]:
        raise ValueError(f"a text of {size} bytes")
    return body[at : at + size - 1].decode(), at + size
