"""The chunks of an MCAP file, also of one that is cut or damaged.

The readers of `mcap` end at the first damage. Here a chunk whose CRC is wrong is left out and the
next one is searched for; what lies between chunks is not needed. Nothing is decompressed beyond
`_LARGEST`, whatever a file says.
"""

from __future__ import annotations

import io
import re
import struct
import zlib
from collections.abc import Iterator, Mapping
from typing import BinaryIO, NamedTuple

MAGIC = b"\x89MCAP0\r\n"
_HEADER, _FOOTER, _SCHEMA, _CHANNEL, _MESSAGE, _CHUNK, _INDEX = range(1, 8)
_CHUNK_INDEX, _STATISTICS, _DATA_END = 8, 11, 15
_RECORD = struct.Struct("<BQ")
_PREFIX = struct.Struct("<QQQII")
"""Of a chunk: first and last time, size and CRC of its content, length of the next word."""
_BEGIN = re.compile(
    rb"\x06.{%d}(?:\x04\0\0\0zstd|\x03\0\0\0lz4|\0\0\0\0)" % (_RECORD.size + _PREFIX.size - 5),
    re.DOTALL,
)
"""How a chunk begins, up to the word for its compression."""
_LONGEST_BEGIN = _RECORD.size + _PREFIX.size + 4
_ENTRY = struct.Struct("<HIQQ")
_FOOT = struct.Struct("<BQQQI")
_PLACE = struct.Struct("<QQQQI")
"""Of an index of a chunk: first and last time, begin, length, bytes of the list of channels."""
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
    """An intact chunk: its messages, and what it declares.

    A channel has its topic, the number of its schema and the encoding of its messages; a schema has
    the name of a type and its definition, and may stand in an earlier chunk.
    """

    offset: int
    messages: tuple[Message, ...]
    channels: Mapping[int, tuple[str, int, str]]
    schemas: Mapping[int, tuple[str, str]]


class Fault(NamedTuple):
    """A place that cannot be read: where it begins [bytes], and why."""

    offset: int
    reason: str


class End(NamedTuple):
    """The summary of a closed file: messages of each channel."""

    counts: Mapping[int, int]


class Place(NamedTuple):
    """Where a chunk of a closed file is.

    Attributes:
        offset, length: Its begin and its length [bytes].
        channels: Those of its messages.
    """

    offset: int
    length: int
    channels: frozenset[int]


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
        found, then = _record(file, at, size)
        closed = then is None and not isinstance(found, Fault)
        if found is not None:
            yield found
        if isinstance(found, Fault) and (then is None or _damaged(file, then, size)):
            then = _next_chunk(file, at + 1)
        at = then
    end = summary(file)
    if end is not None:
        yield end
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
    if kind in (_SCHEMA, _CHANNEL, _MESSAGE) and end <= size:
        return Fault(at, "record outside of a chunk, so without a CRC"), end
    if kind not in (_HEADER, _CHUNK, _INDEX, _DATA_END) or length > _LONGEST:
        return Fault(at, "damaged record"), None
    if end > size:
        return Fault(at, "cut record"), None
    content = file.read(length)
    if kind == _CHUNK:
        return _chunk(at, content) or Fault(at, _fault_of(content)), end
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
    while True:
        file.seek(at)
        block = file.read(_BLOCK)
        found = _BEGIN.search(block)
        while found is not None:
            if _frames_a_chunk(file, at + found.start()):
                return at + found.start()
            found = _BEGIN.search(block, found.start() + 1)
        if len(block) < _BLOCK:
            return None
        at += _BLOCK - _LONGEST_BEGIN + 1


def _frames_a_chunk(file: BinaryIO, at: int) -> bool:
    file.seek(at)
    head = file.read(_RECORD.size + _LONGEST_BEGIN + 8)
    try:
        kind, length = _RECORD.unpack_from(head)
        word = _PREFIX.unpack_from(head, _RECORD.size)[-1]
        (packed,) = struct.unpack_from("<Q", head, _RECORD.size + _PREFIX.size + word)
    except struct.error:
        return False
    return kind == _CHUNK and length - _PREFIX.size - word - 8 == packed


def _chunk(at: int, content: bytes) -> Chunk | None:
    """An intact chunk, None if it is damaged."""
    from mcap.exceptions import McapError  # slow to import

    try:
        data = _unpacked(content)
        return None if data is None else _contents(at, data)
    except (struct.error, ValueError, McapError):
        return None


def _fault_of(content: bytes) -> str:
    """What is wrong with a chunk; MCAP lets a program leave its CRC out."""
    without = len(content) >= _PREFIX.size and _PREFIX.unpack_from(content)[3] == 0
    return "chunk without a CRC" if without else "damaged chunk"


def _unpacked(content: bytes) -> bytes | None:
    """The records of a chunk, None if it is damaged; other programs compress in other ways."""
    try:
        _, _, wanted, crc, word = _PREFIX.unpack_from(content)
        begin = _PREFIX.size + word
        (length,) = struct.unpack_from("<Q", content, begin)
    except struct.error:
        return None
    packed = content[begin + 8 :]
    unpack = _UNPACK.get(content[_PREFIX.size : begin])
    if unpack is None or length != len(packed) or wanted > _LARGEST:
        return None
    data = unpack(packed, wanted + 1)
    return data if len(data) == wanted and zlib.crc32(data) == crc else None


def _of_zstd(packed: bytes, most: int) -> bytes:
    from zstandard import ZstdDecompressor, ZstdError  # slow to import

    try:
        return ZstdDecompressor().stream_reader(packed).read(most)
    except ZstdError:
        return b""


def _of_lz4(packed: bytes, most: int) -> bytes:
    from lz4.frame import LZ4FrameDecompressor

    try:
        return LZ4FrameDecompressor().decompress(packed, most)
    except RuntimeError:
        return b""


_UNPACK = {b"zstd": _of_zstd, b"lz4": _of_lz4, b"": lambda packed, most: packed[:most]}
"""What unpacks at most so many bytes, by the word for it."""


def _contents(at: int, data: bytes) -> Chunk:
    """What the content of a chunk says.

    Raises:
        ValueError, struct.error, McapError: It is not made of records.
    """
    from mcap.data_stream import ReadDataStream
    from mcap.records import Channel, Schema

    messages: list[Message] = []
    schemas: dict[int, tuple[str, str]] = {}
    channels: dict[int, tuple[str, int, str]] = {}
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
            schemas[schema.id] = (schema.name, schema.data.decode(errors="replace"))
        elif kind == _CHANNEL:
            found = Channel.read(ReadDataStream(io.BytesIO(data[place:end])))
            channels[found.id] = (found.topic, found.schema_id, found.message_encoding)
        place = end
    return Chunk(at, tuple(messages), channels, schemas)


def summary(file: BinaryIO) -> End | None:
    """The summary at the end of a closed file, None of any other.

    Raises:
        OSError: The file cannot be read.
    """
    from mcap.data_stream import ReadDataStream
    from mcap.exceptions import McapError
    from mcap.records import Statistics

    try:
        for kind, body in _summarised(file):
            if kind == _STATISTICS:
                found = Statistics.read(ReadDataStream(io.BytesIO(body)))
                return End(found.channel_message_counts)
    except (struct.error, ValueError, McapError):
        pass
    return None


def places(file: BinaryIO) -> Iterator[Place]:
    """Where the chunks of a closed file are, in its order.

    Raises:
        OSError: The file cannot be read.
        ValueError: Its summary says something else.
    """
    known: dict[frozenset[int], frozenset[int]] = {}
    for kind, body in _summarised(file):
        if kind == _CHUNK_INDEX:
            try:
                _, _, offset, length, size = _PLACE.unpack_from(body)
                listed = struct.iter_unpack("<HQ", body[_PLACE.size : _PLACE.size + size])
                channels = frozenset(channel for channel, _ in listed)
            except struct.error as error:
                raise ValueError(str(error)) from None
            yield Place(offset, length, known.setdefault(channels, channels))


def is_sound(file: BinaryIO, place: Place) -> bool:
    """Whether a chunk is there with the right CRC; nothing of it is decoded.

    Raises:
        OSError: The file cannot be read.
    """
    return _unpacked(_content(file, place)) is not None


def chunk_at(file: BinaryIO, place: Place) -> Chunk | None:
    """The chunk of a place, None if it is damaged.

    Raises:
        OSError: The file cannot be read.
    """
    return _chunk(place.offset, _content(file, place))


def _content(file: BinaryIO, place: Place) -> bytes:
    """What stands in the record of a chunk; empty where there is none."""
    file.seek(place.offset)
    record = file.read(min(place.length, _LONGEST))
    head = _RECORD.pack(_CHUNK, max(0, place.length - _RECORD.size))
    return record[len(head) :] if record.startswith(head) else b""


def _summarised(file: BinaryIO) -> Iterator[tuple[int, bytes]]:
    """Kind and content of each record of the summary; none of a file that has no intact one."""
    foot = file.seek(0, io.SEEK_END) - _FOOT.size - len(MAGIC)
    if foot < 0:
        return
    file.seek(foot)
    last = file.read()
    kind, length, start, _, crc = _FOOT.unpack_from(last)
    sound = kind == _FOOTER and length == _FOOT.size - _RECORD.size and last.endswith(MAGIC)
    if not sound or not 0 < start < foot or foot - start > _LONGEST_SUMMARY:
        return
    file.seek(start)
    data = file.read(foot - start)
    if zlib.crc32(last[: _FOOT.size - 4], zlib.crc32(data)) != crc:
        return
    at = 0
    while at + _RECORD.size <= len(data):
        kind, length = _RECORD.unpack_from(data, at)
        at += _RECORD.size + length
        yield kind, data[at - length : at]
