"""The end of a closed MCAP file: how many messages it has, and where its chunks are.

All of it may be left out: the counts, the places, the CRC, the summary itself. What has no CRC is
not used.
"""

from __future__ import annotations

import io
import struct
import zlib
from collections.abc import Iterator, Mapping
from typing import BinaryIO, NamedTuple

MAGIC = b"\x89MCAP0\r\n"
RECORD = struct.Struct("<BQ")
"""Kind and length, before the content of each record."""
_FOOTER, _CHUNK_INDEX, _STATISTICS = 2, 8, 11
_FOOT = struct.Struct("<BQQQI")
_PLACE = struct.Struct("<QQQQI")
"""Of an index of a chunk: first and last time, begin, length, bytes of the list of channels."""
_LONGEST = 1 << 28
"""Most bytes of a summary."""


class End(NamedTuple):
    """The end of a closed file: messages of each channel, if it tells them."""

    counts: Mapping[int, int]
    told: bool = True


class Place(NamedTuple):
    """Where a chunk of a closed file is.

    Attributes:
        offset: Its begin [bytes].
        channels: Those of its messages.
    """

    offset: int
    channels: frozenset[int]


def summary(file: BinaryIO) -> End | None:
    """What the end of a file tells; None if it was not closed, or its end is damaged.

    Raises:
        OSError: The file cannot be read.
    """
    from mcap.data_stream import ReadDataStream
    from mcap.exceptions import McapError
    from mcap.records import Statistics

    data = _summary(file)
    if data is None:
        return None
    try:
        for kind, body in _records(data):
            if kind == _STATISTICS:
                found = Statistics.read(ReadDataStream(io.BytesIO(body)))
                return End(found.channel_message_counts)
    except (struct.error, ValueError, McapError):
        return None
    return End({}, told=False)


def places(file: BinaryIO) -> Iterator[Place]:
    """Where the chunks of a closed file are, in its order.

    Raises:
        OSError: The file cannot be read.
        ValueError: Its summary says something else.
    """
    known: dict[frozenset[int], frozenset[int]] = {}
    for kind, body in _records(_summary(file) or b""):
        if kind == _CHUNK_INDEX:
            try:
                _, _, offset, _, size = _PLACE.unpack_from(body)
                listed = struct.iter_unpack("<HQ", body[_PLACE.size : _PLACE.size + size])
                channels = frozenset(channel for channel, _ in listed)
            except struct.error as error:
                raise ValueError(str(error)) from None
            yield Place(offset, known.setdefault(channels, channels))


def _summary(file: BinaryIO) -> bytes | None:
    """The records of the summary; none where it has no CRC, None of a file without a sound end."""
    foot = file.seek(0, io.SEEK_END) - _FOOT.size - len(MAGIC)
    if foot < 0:
        return None
    file.seek(foot)
    last = file.read()
    kind, length, start, _, crc = _FOOT.unpack_from(last)
    if kind != _FOOTER or length != _FOOT.size - RECORD.size or not last.endswith(MAGIC):
        return None
    start = start or foot  # there is none
    if start > foot or foot - start > _LONGEST:
        return None
    if crc == 0:
        return b""
    file.seek(start)
    data = file.read(foot - start)
    return data if zlib.crc32(last[: _FOOT.size - 4], zlib.crc32(data)) == crc else None


def _records(data: bytes) -> Iterator[tuple[int, bytes]]:
    """Kind and content of each record."""
    at = 0
    while at + RECORD.size <= len(data):
        kind, length = RECORD.unpack_from(data, at)
        at += RECORD.size + length
        yield kind, data[at - length : at]
