"""The chunks of an MCAP file, also of one that is cut or damaged.

The readers of `mcap` end at the first damage. Here a chunk whose CRC is wrong is left out and the
next one is searched for; what lies between chunks is not needed. Nothing is decompressed beyond
`_LARGEST` a chunk and `_RATIO` a file, whatever a file says.

MCAP lets a program leave out chunks and CRCs. antennate never does, so in its files that is damage;
what another program wrote is read all the same, and said to be unguarded. Attachments and metadata,
which anybody may add to a file, are read past.
"""

from __future__ import annotations

import io
import re
import struct
import zlib
from collections import Counter
from collections.abc import Container, Iterator
from typing import BinaryIO, NamedTuple

from antennate.telemetry.contents import CHANNEL, MESSAGE, SCHEMA, Chunk, Messages, contents_of
from antennate.telemetry.summary import MAGIC, RECORD, End, summary

_HEADER, _CHUNK, _INDEX = 1, 6, 7
_ATTACHMENT, _METADATA, _DATA_END = 9, 12, 15
_KINDS = (_HEADER, _CHUNK, _INDEX, _ATTACHMENT, _METADATA, _DATA_END)
_LOOSE = (SCHEMA, CHANNEL, MESSAGE)
"""Kinds of records that are found outside of chunks where there are none."""
LIBRARY = "antennate "
"""How the program is named that writes the logs of antennate, before its version."""
_PREFIX = struct.Struct("<QQQII")
"""Of a chunk: first and last time, size and CRC of its content, length of the next word."""
_BEGIN = re.compile(
    rb"\x06.{%d}(?:\x04\0\0\0zstd|\x03\0\0\0lz4|\0\0\0\0)" % (RECORD.size + _PREFIX.size - 5),
    re.DOTALL,
)
"""How a chunk begins, up to the word for its compression."""
_LONGEST_BEGIN = RECORD.size + _PREFIX.size + 4
_LARGEST = 1 << 26
"""Most bytes of a chunk's content."""
_LONGEST = 1 << 24
"""Most bytes of a record, compressed."""
_RATIO = 100
"""Most bytes of the content of all chunks for each byte of the file."""
_WINDOW = 1 << 25
"""Most bytes that zstd may look back; programs use 32 MB at most."""
_BLOCK = 1 << 20


class Fault(NamedTuple):
    """A place that cannot be read: where it begins [bytes], and why."""

    offset: int
    reason: str


class _Source(NamedTuple):
    """A file: its size, whether another program wrote it, where its chunks are to be read."""

    file: BinaryIO
    size: int
    foreign: bool
    wanted: Container[int] | None


def walk(file: BinaryIO, wanted: Container[int] | None = None) -> Iterator[Chunk | Fault | End]:
    """What a file holds, in order; the summary comes last, if the file was closed.

    The messages of a chunk can be read until the next one is asked for: two might not find room.

    Args:
        file: The file.
        wanted: Where chunks begin that are read, None for all; of others only the CRC is checked.

    Raises:
        OSError: The file cannot be read.
    """
    size = file.seek(0, io.SEEK_END)
    at: int | None = len(MAGIC)
    source, counts = _Source(file, size, is_foreign(file), wanted), Counter[int]()
    file.seek(0)
    if file.read(len(MAGIC)) != MAGIC:
        yield Fault(0, "no MCAP file")
        at = _next_chunk(file, 0)
    closed, unpacked = False, 0
    while at is not None and at < size and not closed:
        found, then = _record(source, at)
        closed = then is None and not isinstance(found, Fault)
        if isinstance(found, Chunk):
            unpacked += found.size
            if unpacked > _RATIO * size:
                yield Fault(at, f"more than {_RATIO} bytes unpacked for each byte of the file")
                break
            counts.update(message.channel for message in found.messages)
        if found is not None:
            yield found
        if isinstance(found, Chunk) and isinstance(found.messages, Messages):
            found.messages.release()
        if isinstance(found, Fault) and (then is None or _damaged(source, then)):
            then = _next_chunk(file, at + 1)
        at = then
    end = summary(file)
    if end is not None:
        yield end if end.told else End(counts)
    elif closed:
        yield Fault(size, "damaged summary")


def is_foreign(file: BinaryIO) -> bool:
    """Whether a file says that another program wrote it.

    Raises:
        OSError: The file cannot be read.
    """
    from mcap.data_stream import ReadDataStream  # slow to import
    from mcap.exceptions import McapError
    from mcap.records import Header

    file.seek(len(MAGIC))
    head = file.read(RECORD.size)
    if len(head) < RECORD.size or head[0] != _HEADER:
        return False
    try:
        content = file.read(min(RECORD.unpack(head)[1], _LONGEST))
        library = Header.read(ReadDataStream(io.BytesIO(content))).library
    except (struct.error, ValueError, McapError):
        return False
    return not library.startswith(LIBRARY)


def _record(source: _Source, at: int) -> tuple[Chunk | Fault | None, int | None]:
    """What one record is and where it ends: None and no end for that of all data."""
    file, size, foreign, _ = source
    file.seek(at)
    head = file.read(RECORD.size)
    if len(head) < RECORD.size:
        return Fault(at, "cut record"), None
    kind, length = RECORD.unpack(head)
    end = at + RECORD.size + length
    if kind in _LOOSE and end <= size:
        if foreign:
            return _loose(file, at, size)
        return Fault(at, "record outside of a chunk, so without a CRC"), end
    if kind not in _KINDS or (length > _LONGEST and kind != _ATTACHMENT):
        return Fault(at, "damaged record"), None
    if end > size:
        return Fault(at, "cut record"), None
    content = file.read(min(length, _LONGEST))
    if kind == _CHUNK:
        return _chunk(at, content, source) or Fault(at, _fault_of(content)), end
    if not _is_sound(kind, at, content, length):
        return Fault(at, "damaged record"), None
    return None, None if kind == _DATA_END else end


def _is_sound(kind: int, at: int, content: bytes, length: int) -> bool:
    """Whether a record of which nothing is used looks sound, by its place or the lengths in it."""
    try:
        if kind == _INDEX:
            return _after(content, 2) == length
        if kind == _METADATA:
            return _after(content, _after(content, 0)) == length
        if kind == _ATTACHMENT:
            data = _after(content, _after(content, 16))
            return data + 8 + struct.unpack_from("<Q", content, data)[0] + 4 == length
    except struct.error:
        return False
    return at == len(MAGIC) if kind == _HEADER else length == 4


def _after(content: bytes, at: int) -> int:
    """Where a text or a table ends that begins with its length."""
    return at + 4 + struct.unpack_from("<I", content, at)[0]


def _loose(file: BinaryIO, at: int, size: int) -> tuple[Chunk | Fault, int]:
    """Records outside of chunks that follow one another, some at a time, and where they end."""
    end = at
    while end - at <= _BLOCK:
        file.seek(end)
        head = file.read(RECORD.size)
        if len(head) < RECORD.size:
            break
        kind, length = RECORD.unpack(head)
        if kind not in _LOOSE or length > _LONGEST or end + RECORD.size + length > size:
            break
        end += RECORD.size + length
    file.seek(at)
    found = contents_of(at, file.read(end - at))
    return Fault(at, "damaged record") if found is None else found._replace(
        guarded=False, foreign=True
    ), end


def _damaged(source: _Source, at: int) -> bool:
    """Whether what begins at a place is no record."""
    return at < source.size and isinstance(_record(source, at)[0], Fault)


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
    head = file.read(RECORD.size + _LONGEST_BEGIN + 8)
    try:
        kind, length = RECORD.unpack_from(head)
        word = _PREFIX.unpack_from(head, RECORD.size)[-1]
        (packed,) = struct.unpack_from("<Q", head, RECORD.size + _PREFIX.size + word)
    except struct.error:
        return False
    return kind == _CHUNK and length - _PREFIX.size - word - 8 == packed


def _chunk(at: int, content: bytes, source: _Source) -> Chunk | None:
    """An intact chunk, None if it is damaged; one of another program may be without a CRC."""
    guarded = not (source.foreign and _lacks_crc(content))
    data = _unpacked(content, guarded)
    if data is None:
        return None
    size = len(data)
    if source.wanted is not None and at not in source.wanted:
        data = b""
    found = contents_of(at, data)
    return found and found._replace(size=size, guarded=guarded, foreign=source.foreign)


def _fault_of(content: bytes) -> str:
    """What is wrong with a chunk."""
    return "chunk without a CRC" if _lacks_crc(content) else "damaged chunk"


def _lacks_crc(content: bytes) -> bool:
    return len(content) >= _PREFIX.size and _PREFIX.unpack_from(content)[3] == 0


def _unpacked(content: bytes, guarded: bool) -> bytes | None:
    """The records of a chunk, None if it is damaged; other programs compress in other ways."""
    try:
        _, _, wanted, crc, word = _PREFIX.unpack_from(content)
        begin = _PREFIX.size + word
        (length,) = struct.unpack_from("<Q", content, begin)
    except struct.error:
        return None
    packed = memoryview(content)[begin + 8 :]
    unpack = _UNPACK.get(content[_PREFIX.size : begin])
    if unpack is None or length != len(packed) or wanted > _LARGEST:
        return None
    data = unpack(packed, wanted + 1)
    sound = len(data) == wanted and (zlib.crc32(data) == crc or not guarded)
    return data if sound else None


def _of_zstd(packed: memoryview, most: int) -> bytes:
    from zstandard import ZstdDecompressor, ZstdError  # slow to import

    try:
        return ZstdDecompressor(max_window_size=_WINDOW).stream_reader(packed).read(most)
    except ZstdError:
        return b""


def _of_lz4(packed: memoryview, most: int) -> bytes:
    from lz4.frame import LZ4FrameDecompressor

    try:
        return LZ4FrameDecompressor().decompress(packed, most)
    except RuntimeError:
        return b""


_UNPACK = {b"zstd": _of_zstd, b"lz4": _of_lz4, b"": lambda packed, most: bytes(packed[:most])}
"""What unpacks at most so many bytes, by the word for it."""
