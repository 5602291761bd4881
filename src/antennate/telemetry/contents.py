"""What the content of a chunk of an MCAP file says: its messages, schemas and channels."""

from __future__ import annotations

import io
import struct
from array import array
from collections.abc import Iterator, Mapping
from typing import NamedTuple

from antennate.telemetry.summary import RECORD

SCHEMA, CHANNEL, MESSAGE = 3, 4, 5
"""Kinds of records that are the content of a chunk."""
_ENTRY = struct.Struct("<BQHIQQ")
"""Of a message: kind, length, channel, number, and twice its time."""
_LONGEST = 1 << 20
"""Most bytes of a schema or a channel."""
_LONGEST_MESSAGE = 1 << 23
"""Most bytes of a message; of longer ones only so many are read, and no message of ours is one."""


class Message(NamedTuple):
    """One message: its channel, its number, its time [ns] and its bytes."""

    channel: int
    number: int
    time: int
    data: bytes


class Messages:
    """The messages of a chunk, one at a time: all of them beside its content might take too much.

    Args:
        data: The content.
        begins: Where their records begin.
    """

    def __init__(self, data: bytes, begins: array[int]) -> None:
        self._data, self._begins = data, begins

    def __iter__(self) -> Iterator[Message]:
        data = self._data
        for at in self._begins:
            _, length, channel, number, time, _ = _ENTRY.unpack_from(data, at)
            begin = at + _ENTRY.size
            size = min(length + RECORD.size - _ENTRY.size, _LONGEST_MESSAGE)
            yield Message(channel, number, time, data[begin : begin + size])

    def release(self) -> None:
        """Hold them no longer."""
        self._data, self._begins = b"", array("I")


class Chunk(NamedTuple):
    """An intact chunk: its messages, and what it declares.

    A channel has its topic, the number of its schema and the encoding of its messages; a schema has
    the name of a type and its definition, and may stand in an earlier chunk. Its size is that of
    its content. Without a CRC nothing guards it: it may not be as it was written. One of another
    program may end within a tick.
    """

    offset: int
    messages: Messages | tuple[Message, ...]
    channels: Mapping[int, tuple[str, int, str]]
    schemas: Mapping[int, tuple[str, str]]
    size: int = 0
    guarded: bool = True
    foreign: bool = False


def contents_of(at: int, data: bytes) -> Chunk | None:
    """The chunk at a place with this content, None if it is not made of records."""
    from mcap.exceptions import McapError  # slow to import

    try:
        return _contents(at, data)
    except (struct.error, ValueError, McapError):
        return None


def _contents(at: int, data: bytes) -> Chunk:
    """The same."""
    from mcap.data_stream import ReadDataStream
    from mcap.records import Channel, Schema

    messages = array("I")
    schemas: dict[int, tuple[str, str]] = {}
    channels: dict[int, tuple[str, int, str]] = {}
    begin = 0
    while begin < len(data):
        kind, length = RECORD.unpack_from(data, begin)
        place = begin + RECORD.size
        end = place + length
        if end > len(data) or (kind in (SCHEMA, CHANNEL) and length > _LONGEST):
            raise ValueError("cut or long record")
        if kind == MESSAGE:
            if begin + _ENTRY.size > end:
                raise ValueError("cut message")
            messages.append(begin)
        elif kind == SCHEMA:
            schema = Schema.read(ReadDataStream(io.BytesIO(data[place:end])))
            schemas[schema.id] = (schema.name, schema.data.decode(errors="replace"))
        elif kind == CHANNEL:
            found = Channel.read(ReadDataStream(io.BytesIO(data[place:end])))
            channels[found.id] = (found.topic, found.schema_id, found.message_encoding)
        begin = end
    return Chunk(at, Messages(data, messages), channels, schemas)
