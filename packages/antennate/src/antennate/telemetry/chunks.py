"""The chunks of an MCAP file, also of one that is cut or damaged.

The package `mcap` parses records, unpacks chunks and checks their CRC. Records are framed here, in
place of its `StreamReader`: that ends at the first damage and believes each length that a record
names. A damaged chunk is left out and the next one is searched for; what lies between chunks is not
needed. Nothing is unpacked beyond `_LARGEST` a chunk and `_RATIO` a file, whatever a file says.
"""

from __future__ import annotations

import io
import re
import struct
import zlib
from collections import Counter
from collections.abc import Container, Iterator, Mapping, Sequence
from typing import BinaryIO, NamedTuple

from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Header, McapRecord, Message, Schema, Statistics
from mcap.records import Chunk as ChunkRecord
from mcap.stream_reader import StreamReader, breakup_chunk, get_chunk_data_stream
from zstandard import ZstdError, frame_content_size

from antennate.errors import LogError
from antennate.telemetry.header import LIBRARY

MAGIC = b"\x89MCAP0\r\n"
RECORD = struct.Struct("<BQ")
"""Kind and length, before the content of each record."""
UNSOUND = (struct.error, ValueError, OverflowError, McapError, ZstdError)
"""What damaged records make the libraries raise."""
_SKIPPED = (Opcode.HEADER, Opcode.MESSAGE_INDEX, Opcode.ATTACHMENT, Opcode.METADATA)
_LOOSE = (Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE)
"""Kinds of records that stand in chunks."""
_PREFIX = struct.Struct("<QQQII")
"""Begin of a chunk: first and last time, size and CRC of its content, length of the next word."""
_LZ4 = b"\x03\0\0\0lz4"
_BEGIN = re.compile(
    rb"\x06.{%d}(?:\x04\0\0\0zstd|%b|\0\0\0\0)" % (RECORD.size + _PREFIX.size - 5, _LZ4),
    re.DOTALL,
)
"""How a chunk begins, up to the word for its compression."""
_LONGEST_BEGIN = RECORD.size + _PREFIX.size + 4
_FOOT = struct.Struct("<BQQQI")
"""The last record: kind, length, begin of the summary, of its offsets, CRC."""
_LARGEST = 1 << 23
"""Most bytes of a chunk's content; programs usually close a chunk at 1 or 4 MB."""
_LONGEST = 1 << 24
"""Most bytes of a record, compressed."""
_LONGEST_SUMMARY = 1 << 28
_RATIO = 100
"""Most bytes of the content of all chunks for each byte of the file."""
_BLOCK = 1 << 20


class Fault(NamedTuple):
    """A place that cannot be read: where it begins [bytes], and why."""

    offset: int
    reason: str


class Chunk(NamedTuple):
    """An intact chunk: where it begins [bytes], its messages, and what it declares.

    Its size is that of its content [bytes]. Without a CRC nothing guards it: it may not be as it
    was written.
    """

    offset: int
    messages: Sequence[Message]
    channels: Mapping[int, Channel]
    schemas: Mapping[int, Schema]
    size: int
    guarded: bool


class End(NamedTuple):
    """The end of a closed file: how many messages of each channel were written."""

    counts: Mapping[int, int]


def walk(file: BinaryIO, wanted: Container[int] | None = None) -> Iterator[Chunk | Fault | End]:
    """What a file holds, in order; the end comes last, if the file was closed.

    Args:
        file: The file.
        wanted: Where chunks begin that are read, None for all; of others only the CRC is checked.
    """
    size, foreign = file.seek(0, io.SEEK_END), _writer(file) not in (None, LIBRARY)
    at, closed, unpacked, counts = len(MAGIC), False, 0, Counter[int]()
    file.seek(0)
    if file.read(len(MAGIC)) != MAGIC:
        yield Fault(0, "no MCAP file")
        at = _next_chunk(file, 0, size)
    while at < size and not closed:
        place, end = _record(file, at, size), size
        if not isinstance(place, Fault):
            kind, content, end = place
            closed = kind == Opcode.DATA_END
            if kind == Opcode.CHUNK:
                place = _chunk(at, content, wanted is None or at in wanted, foreign)
        if isinstance(place, Chunk):
            unpacked += place.size
            if unpacked > _RATIO * size:
                yield Fault(at, f"more than {_RATIO} bytes unpacked for each byte of the file")
                break
            counts.update(message.channel_id for message in place.messages)
            yield place
        elif isinstance(place, Fault):
            yield place
            end = _next_chunk(file, at + 1, size)
        at = end
    try:
        statistics = (each for each in summary(file) if isinstance(each, Statistics))
        end_of_file = End(next((each.channel_message_counts for each in statistics), counts))
    except UNSOUND:
        end_of_file = Fault(size, "damaged summary") if closed else None
    if end_of_file is not None:
        yield end_of_file


def _record(file: BinaryIO, at: int, size: int) -> tuple[int, bytes, int] | Fault:
    """Kind, content and end of a record that may stand outside of chunks."""
    file.seek(at)
    head = file.read(RECORD.size)
    if len(head) < RECORD.size:
        return Fault(at, "cut record")
    kind, length = RECORD.unpack(head)
    end = at + RECORD.size + length
    if kind in _LOOSE and end <= size:
        return Fault(at, "record outside of a chunk; `mcap sort` writes it into one")
    if kind not in (*_SKIPPED, Opcode.CHUNK, Opcode.DATA_END) or (
        length > _LONGEST and kind != Opcode.ATTACHMENT
    ):
        return Fault(at, "damaged record")
    if end > size:
        return Fault(at, "cut record")
    content = file.read(min(length, _LONGEST))
    if (kind == Opcode.DATA_END and length != 4) or (kind == Opcode.HEADER and at != len(MAGIC)):
        return Fault(at, "damaged record")  # a flipped bit makes them of an index
    if kind == Opcode.MESSAGE_INDEX and content[2:6] != struct.pack("<I", max(0, length - 6)):
        return Fault(at, "damaged record")  # its length may lead into the midst of a chunk
    return kind, content, end


def _next_chunk(file: BinaryIO, at: int, size: int) -> int:
    """Where the next chunk begins that says the same length twice; the end of the file if none."""
    while at < size:
        file.seek(at)
        block = file.read(_BLOCK)
        match = _BEGIN.search(block)
        while match is not None:
            if _frames_a_chunk(file, at + match.start()):
                return at + match.start()
            match = _BEGIN.search(block, match.start() + 1)
        at += max(1, len(block) - _LONGEST_BEGIN + 1) if len(block) == _BLOCK else _BLOCK
    return size


def _frames_a_chunk(file: BinaryIO, at: int) -> bool:
    file.seek(at)
    head = file.read(RECORD.size + _LONGEST_BEGIN + 8)
    try:
        _, length = RECORD.unpack_from(head)
        word = _PREFIX.unpack_from(head, RECORD.size)[-1]
        (packed,) = struct.unpack_from("<Q", head, RECORD.size + _PREFIX.size + word)
    except struct.error:
        return False
    return length - _PREFIX.size - word - 8 == packed


def _chunk(at: int, content: bytes, wanted: bool, foreign: bool) -> Chunk | Fault:
    """The chunk of a record, without what is in it unless that is wanted.

    Only other programs may leave out the CRC.
    """
    if content[_PREFIX.size - 4 :].startswith(_LZ4):
        raise LogError(
            "expected chunks compressed by zstd, found lz4; `mcap compress --compression zstd` "
            "writes the log anew"
        )
    try:
        chunk = ChunkRecord.read(ReadDataStream(io.BytesIO(content)))
        packed, size = len(chunk.data), chunk.uncompressed_size
        unpacked = frame_content_size(chunk.data) if chunk.compression == "zstd" else packed
        whole = len(content) == _PREFIX.size + len(chunk.compression) + 8 + packed
        if chunk.compression not in ("zstd", "") or not whole or unpacked not in (size, -1):
            return Fault(at, "damaged chunk")
        if chunk.uncompressed_crc == 0 and not foreign:
            return Fault(at, "chunk without a CRC")
        if size > _LARGEST:
            return Fault(at, f"chunk of more than {_LARGEST} bytes")
        records = list[McapRecord]()
        if wanted:
            records = breakup_chunk(chunk, validate_crc=True)
        else:
            get_chunk_data_stream(chunk, validate_crc=True)
    except UNSOUND:
        return Fault(at, "damaged chunk")
    return Chunk(
        at,
        [each for each in records if isinstance(each, Message)],
        {each.id: each for each in records if isinstance(each, Channel)},
        {each.id: each for each in records if isinstance(each, Schema)},
        size,
        guarded=chunk.uncompressed_crc != 0,
    )


def summary(file: BinaryIO) -> Iterator[McapRecord]:
    """The records at the end of a closed file; none where they have no CRC."""
    foot = file.seek(0, io.SEEK_END) - _FOOT.size - len(MAGIC)
    if foot < 0:
        raise ValueError("not closed")
    file.seek(foot)
    last = file.read()
    kind, length, start, _, crc = _FOOT.unpack_from(last)
    if kind != Opcode.FOOTER or length != _FOOT.size - RECORD.size or not last.endswith(MAGIC):
        raise ValueError("not closed")
    start = start or foot  # there is none
    if crc == 0 and start <= foot:
        return iter(())
    if not 0 <= foot - start <= _LONGEST_SUMMARY:
        raise ValueError("damaged summary")
    file.seek(start)
    data = file.read(foot - start)
    if zlib.crc32(last[: _FOOT.size - 4], zlib.crc32(data)) != crc:
        raise ValueError("damaged summary")
    return StreamReader(io.BytesIO(data + last), skip_magic=True).records


def is_own(file: BinaryIO) -> bool:
    """Whether a file says that antennate wrote it."""
    return _writer(file) == LIBRARY


def _writer(file: BinaryIO) -> str | None:
    """The program that the header of a file names, LIBRARY for antennate; None if it is damaged."""
    record = _record(file, len(MAGIC), file.seek(0, io.SEEK_END))
    if isinstance(record, Fault) or record[0] != Opcode.HEADER:
        return None
    try:
        name = Header.read(ReadDataStream(io.BytesIO(record[1]))).library
    except UNSOUND:
        return None
    return LIBRARY if name.startswith(LIBRARY) else name
