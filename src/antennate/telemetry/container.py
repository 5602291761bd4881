"""Writes an MCAP file: types, channels, chunks of messages with their indexes, and a summary.

The records are those of the package `mcap`, but for messages and their indexes: its own writer
makes some forty calls for each message, which cost a simulated trial more than the rest of its log.
"""

from __future__ import annotations

import struct
import zlib
from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping
from io import BufferedIOBase
from typing import Any

import numpy as np
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Channel,
    Chunk,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    McapRecord,
    Schema,
    Statistics,
    SummaryOffset,
)
from zstandard import ZstdCompressor

from antennate.telemetry.cdr import Form
from antennate.telemetry.chunks import MAGIC
from antennate.types import Ints

_COMPRESSION = "zstd"
_EFFORT = 1
"""Level of the compression: files are 1 % larger than at the usual 3, and it takes a third less."""
_MESSAGE = struct.Struct("<BQHIQQ")
"""Kind, length, channel, number, and twice the time [ns]: logged and published."""
_MESSAGES = np.dtype("u1,<u8,<u2,<u4,<u8,<u8")
"""The same of many at once."""
_INDEX = struct.Struct("<BQHI")
"""Kind, length, channel, bytes of the pairs of time and place that follow."""
_HEAD = struct.calcsize("<BQ")
"""Bytes of a record that its length does not count."""
_FOOT = struct.Struct("<BQQQ")
"""Kind, length and both places of the last record, which its own CRC covers."""


class Container:
    """One file, from its first byte on.

    Args:
        file: Where it goes.
        library: The program that writes it.
    """

    def __init__(self, file: BufferedIOBase, library: str) -> None:
        self._file, self._packer = file, ZstdCompressor(_EFFORT)
        self._schemas, self._channels = list[Schema](), list[Channel]()
        self._content, self._indexes = bytearray(), defaultdict[int, list[int]](list)
        self._chunks, self._counts = bytearray(), Counter[int]()
        self._statistics = Statistics(
            attachment_count=0,
            channel_count=0,
            channel_message_counts=self._counts,
            chunk_count=0,
            message_count=0,
            message_end_time=0,
            message_start_time=0,
            metadata_count=0,
            schema_count=0,
        )
        file.write(MAGIC + _bytes([Header("ros2", library)]))

    def add_schema(self, name: str, definition: str) -> int:
        """Declare a type of messages of ROS 2; its number."""
        self._schemas.append(Schema(len(self._schemas) + 1, definition.encode(), "ros2msg", name))
        self._content += _bytes(self._schemas[-1:])
        return len(self._schemas)

    def add_channel(self, topic: str, schema: int) -> int:
        """Declare a topic with messages of a type; its number."""
        self._channels.append(Channel(len(self._channels) + 1, topic, "cdr", {}, schema))
        self._content += _bytes(self._channels[-1:])
        return len(self._channels)

    def add(self, channel: int, number: int, time: int, data: bytes) -> None:
        """Add a message to the chunk, with its number and its time [ns]."""
        content, length = self._content, _MESSAGE.size - _HEAD + len(data)
        record = _MESSAGE.pack(Opcode.MESSAGE, length, channel, number, time, time) + data
        self._indexes[channel].extend((time, len(content)))
        content += record

    def add_rows(
        self,
        numbers: Ints,
        times: Ints,
        messages: Mapping[int, tuple[Form, Mapping[str, Any]]],
        beside: Mapping[int, Mapping[int, bytes]],
    ) -> None:
        """Add rows of messages, one of each channel a row, as `add` would do one after the other.

        Args:
            numbers: Number of the messages of each row, shape (n,).
            times: Their time [ns], shape (n,).
            messages: By channel, the form of its messages and the columns of their numbers.
            beside: More messages of single rows, by row and by channel.
        """
        starts, size = dict[int, int](), 0
        for channel, (form, _) in messages.items():
            starts[channel] = size
            size += _MESSAGE.size + form.size
        block = np.empty((len(times), size), np.uint8)
        for channel, (form, columns) in messages.items():
            begin = starts[channel] + _MESSAGE.size
            head = block[:, starts[channel] : begin].view(_MESSAGES)[:, 0]
            length = _MESSAGE.size - _HEAD + form.size
            values = Opcode.MESSAGE, length, channel, numbers, times, times
            for name, value in zip(head.dtype.names or (), values, strict=True):
                head[name] = value
            form.fill(block[:, begin : begin + form.size], columns)
        begins, done = np.empty(len(times), np.int64), 0
        for row in sorted({*beside, len(times) - 1}):
            begins[done : row + 1] = len(self._content) + size * np.arange(row + 1 - done)
            self._content += block[done : row + 1].data
            done = row + 1
            for channel, data in beside.get(row, {}).items():
                self.add(channel, int(numbers[row]), int(times[row]), data)
        for channel, start in starts.items():
            self._indexes[channel].extend(
                np.stack([times, begins + start], axis=1).ravel().tolist()
            )

    def end_chunk(self) -> None:
        """Write the chunk, unless no message is in it."""
        if not self._indexes:
            return
        content, indexes = self._content, self._indexes
        self._content, self._indexes = bytearray(), defaultdict(list)
        times = [time for index in indexes.values() for time in (min(index[::2]), max(index[::2]))]
        chunk = Chunk(
            compression=_COMPRESSION,
            data=self._packer.compress(content),
            message_start_time=min(times),
            message_end_time=max(times),
            uncompressed_crc=zlib.crc32(content),
            uncompressed_size=len(content),
        )
        start, record = self._file.tell(), _bytes([chunk])
        after, places = bytearray(), dict[int, int]()
        for channel, index in indexes.items():
            places[channel] = start + len(record) + len(after)
            size = 8 * len(index)
            after += _INDEX.pack(
                Opcode.MESSAGE_INDEX, _INDEX.size - _HEAD + size, channel, size
            ) + struct.pack(f"<{len(index)}Q", *index)
            self._counts[channel] += len(index) // 2
        self._file.write(record + after)
        place = ChunkIndex(
            chunk_start_offset=start,
            chunk_length=len(record),
            message_index_offsets=places,
            message_index_length=len(after),
            compression=_COMPRESSION,
            compressed_size=len(chunk.data),
            uncompressed_size=len(content),
            message_start_time=chunk.message_start_time,
            message_end_time=chunk.message_end_time,
        )
        self._chunks += _bytes([place])
        statistics = self._statistics
        if not statistics.chunk_count:
            statistics.message_start_time = chunk.message_start_time
        statistics.message_start_time = min(statistics.message_start_time, chunk.message_start_time)
        statistics.message_end_time = max(statistics.message_end_time, chunk.message_end_time)
        statistics.chunk_count += 1

    def finish(self) -> None:
        """Write the last chunk and the summary. Nothing may follow."""
        self.end_chunk()
        self._file.write(_bytes([DataEnd(0)]))
        self._statistics.schema_count = len(self._schemas)
        self._statistics.channel_count = len(self._channels)
        self._statistics.message_count = self._counts.total()
        groups = {
            Opcode.SCHEMA: _bytes(self._schemas),
            Opcode.CHANNEL: _bytes(self._channels),
            Opcode.STATISTICS: _bytes([self._statistics]),
            Opcode.CHUNK_INDEX: self._chunks,
        }
        start, body, offsets = self._file.tell(), bytearray(), list[SummaryOffset]()
        for kind, group in groups.items():
            if group:
                offsets.append(SummaryOffset(kind, start + len(body), len(group)))
                body += group
        after = start + len(body)
        body += _bytes(offsets)
        foot = _FOOT.pack(Opcode.FOOTER, _FOOT.size - _HEAD + 4, start, after)
        crc = zlib.crc32(foot, zlib.crc32(body))
        self._file.write(bytes(body) + _bytes([Footer(start, after, crc)]) + MAGIC)


def _bytes(records: Iterable[McapRecord]) -> bytes:
    build = RecordBuilder()
    for record in records:
        record.write(build)
    return build.end()
