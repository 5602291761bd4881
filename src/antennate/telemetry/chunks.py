"""The chunks of an MCAP file, also of one that is cut or damaged.

The readers of `mcap` end at the first damage. Here a chunk whose CRC is wrong is left out and the
next one is searched for; what lies between chunks is not needed. Nothing is decompressed beyond
`_LARGEST`, whatever a file says.
"""

from __future__ import annotations

import io
import struct
import zlib
from collections.abc import Iterator, Mapping
from typing import BinaryIO, NamedTuple

MAGIC = b"\x89MCAP0\r\n"
_HEADER, _FOOTER, _SCHEMA, _CHANNEL, _MESSAGE, _CHUNK, _INDEX = range(1, 8)
_STATISTICS, _DATA_END = 11, 15
_RECORD = struct.Struct("<BQ")
_PREFIX = struct.Struct("<QQQII")
"""Of a chunk: first and last time, size and CRC of its content, length of the next word."""
_ZSTD = b"zstd"
_MARK = struct.pack("<I", len(_ZSTD)) + _ZSTD
_BEFORE_MARK = _RECORD.size + _PREFIX.size - 4
_ENTRY = struct.Struct("<HIQQ")
_FOOT = struct.Struct("<BQQQI")
_LARGEST = 1 << 26
"""Most bytes of a chunk's content."""
_LONGEST = 1 << 24
"""Most bytes of a record, compressed."""
_LONGEST_SUMMARY = 1 << 28
_BLOCK = 1 << 20


class Message(NamedTuple):
    """One message: its channel, its number, its time [ns] and its bytes."""

    channel: int
    number: int
    time: int
    data: bytes


class Chunk(NamedTuple):
    """An intact chunk: its messages, and the channels that it describes.

    A channel has the topic, the name of the type and its definition.
    """

    offset: int
    messages: tuple[Message, ...]
    channels: Mapping[int, tuple[str, str, str]]


class Fault(NamedTuple):
    """A place that cannot be read: where it begins [bytes], and why."""

    offset: int
    reason: str


class End(NamedTuple):
    """The summary of a closed file: messages of each channel."""

    counts: Mapping[int, int]


def walk(file: BinaryIO) -> Iterator[Chunk | Fault | End]:
    """What a file holds, in order; the summary comes last, if the file was closed.

    Raises:
        OSError: The file cannot be read.
    """
    size = file.seek(0, io.SEEK_END)
    file.seek(0)
    at: int | None = len(MAGIC)
    if file.read(len(MAGIC)) != MAGIC:
        yield Fault(0, "no MCAP file")
        at = _next_chunk(file, 0)
    closed = False
    while at is not None and at < size and not closed:
        found, end = _record(file, at, size)
        closed = end is None and not isinstance(found, Fault)
        if found is not None:
            yield found
        if isinstance(found, Fault) and (end is None or _damaged(file, end, size)):
            end = _next_chunk(file, at + 1)
        at = end
    summary = _summary(file, size)
    if summary is not None:
        yield summary
    elif closed:
        yield Fault(size, "damaged summary")


def _record(file: BinaryIO, at: int, size: int) -> tuple[Chunk | Fault | None, int | None]:
    """What one record is and where it ends: None and no end for that of all data."""
    file.seek(at)
    head = file.read(_RECORD.size)
    if len(head) < _RECORD.size:
        return Fault(at, "cut record"), None
    kind, length = _RECORD.unpack(head)
    end = at + _RECORD.size + length
    if kind not in (_HEADER, _CHUNK, _INDEX, _DATA_END) or length > _LONGEST:
        return Fault(at, "damaged record"), None
    if end > size:
        return Fault(at, "cut record"), None
    content = file.read(length)
    if kind == _CHUNK:
        return _chunk(at, content) or Fault(at, "damaged chunk"), end
    sound = {
        _INDEX: len(content) >= 6 and int.from_bytes(content[2:6], "little") == length - 6,
        _DATA_END: length == 4,
        _HEADER: at == len(MAGIC),
    }[kind]
    if not sound:
        return Fault(at, "damaged record"), None
    return None, None if kind == _DATA_END else end


def _damaged(file: BinaryIO, at: int, size: int) -> bool:
    """Whether what begins at a place is no record."""
    return at < size and isinstance(_record(file, at, size)[0], Fault)


def _next_chunk(file: BinaryIO, at: int) -> int | None:
    """Where the next chunk begins that says the same length twice, from a place on."""
    at += _BEFORE_MARK
    while True:
        file.seek(at)
        block = file.read(_BLOCK)
        place = block.find(_MARK)
        while place >= 0:
            if _frames_a_chunk(file, at + place - _BEFORE_MARK):
                return at + place - _BEFORE_MARK
            place = block.find(_MARK, place + 1)
        if len(block) < _BLOCK:
            return None
        at += _BLOCK - len(_MARK) + 1


def _frames_a_chunk(file: BinaryIO, at: int) -> bool:
    before = _PREFIX.size + len(_ZSTD) + 8
    file.seek(at)
    head = file.read(_RECORD.size + before)
    if len(head) < _RECORD.size + before:
        return False
    kind, length = _RECORD.unpack_from(head)
    return kind == _CHUNK and length - before == int.from_bytes(head[-8:], "little")


def _chunk(at: int, content: bytes) -> Chunk | None:
    """An intact chunk, None if it is damaged."""
    from mcap.exceptions import McapError  # slow to import
    from zstandard import ZstdDecompressor, ZstdError

    begin = _PREFIX.size + len(_ZSTD)
    try:
        _, _, wanted, crc, _ = _PREFIX.unpack_from(content)
        (length,) = struct.unpack_from("<Q", content, begin)
        packed = content[begin + 8 :]
        if content[begin - len(_MARK) : begin] != _MARK or length != len(packed):
            return None
        if wanted > _LARGEST:
            return None
        data = ZstdDecompressor().stream_reader(packed).read(wanted + 1)
        return _contents(at, data) if len(data) == wanted and zlib.crc32(data) == crc else None
    except (struct.error, ValueError, ZstdError, McapError):
        return None


def _contents(at: int, data: bytes) -> Chunk:
    """What the content of a chunk says.

    Raises:
        ValueError, struct.error, McapError: It is not made of records.
    """
    from mcap.data_stream import ReadDataStream
    from mcap.records import Channel, Schema

    messages: list[Message] = []
    schemas: dict[int, Schema] = {}
    channels: dict[int, tuple[str, str, str]] = {}
    place = 0
    while place < len(data):
        kind, length = _RECORD.unpack_from(data, place)
        place += _RECORD.size
        end = place + length
        if end > len(data):
            raise ValueError("cut record")
        if kind == _MESSAGE:
            channel, number, time, _ = _ENTRY.unpack_from(data, place)
            messages.append(Message(channel, number, time, data[place + _ENTRY.size : end]))
        elif kind == _SCHEMA:
            schema = Schema.read(ReadDataStream(io.BytesIO(data[place:end])))
            schemas[schema.id] = schema
        elif kind == _CHANNEL:
            found = Channel.read(ReadDataStream(io.BytesIO(data[place:end])))
            about = schemas.get(found.schema_id)
            name, text = ("", b"") if about is None else (about.name, about.data)
            channels[found.id] = (found.topic, name, text.decode())
        place = end
    return Chunk(at, tuple(messages), channels)


def _summary(file: BinaryIO, size: int) -> End | None:
    """The summary at the end of a closed file, None of any other."""
    from mcap.data_stream import ReadDataStream
    from mcap.exceptions import McapError
    from mcap.records import Statistics

    foot = size - _FOOT.size - len(MAGIC)
    if foot < 0:
        return None
    file.seek(foot)
    last = file.read()
    kind, length, start, _, crc = _FOOT.unpack_from(last)
    sound = kind == _FOOTER and length == _FOOT.size - _RECORD.size and last.endswith(MAGIC)
    if not sound or not 0 < start < foot or foot - start > _LONGEST_SUMMARY:
        return None
    file.seek(start)
    data = file.read(foot - start)
    if zlib.crc32(last[: _FOOT.size - 4], zlib.crc32(data)) != crc:
        return None
    place = 0
    try:
        while place < len(data):
            kind, length = _RECORD.unpack_from(data, place)
            place += _RECORD.size
            if kind == _STATISTICS:
                body = ReadDataStream(io.BytesIO(data[place : place + length]))
                return End(Statistics.read(body).channel_message_counts)
            place += length
    except (struct.error, ValueError, McapError):
        pass
    return None
