"""Our writer of MCAP files beside that of the package `mcap`, read by its readers."""

from __future__ import annotations

import io
import struct
from dataclasses import asdict
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.records import Chunk, ChunkIndex, Footer, MessageIndex, SummaryOffset
from mcap.stream_reader import StreamReader
from mcap.writer import Writer

from antennate.telemetry.container import Container

TYPES = (("std_msgs/msg/String", "string data"), ("std_msgs/msg/Float64", "float64 data"))
TOPICS = (("/a", 1), ("/b", 2), ("/c", 2))


def _messages(chunks: int) -> list[list[tuple[int, int, int, bytes]]]:
    """Channel, number, time and bytes of messages by chunk; times run on, but not in a chunk."""
    rng = np.random.default_rng(5)
    return [
        [
            (
                int(rng.integers(1, 3)),
                int(rng.integers(0, 2**32)),
                int(1_700_000_000_000_000_000 + chunk * 10**9 + rng.integers(0, 10**9)),
                rng.bytes(int(rng.integers(0, 300))),
            )
            for _ in range(40)
        ]
        for chunk in range(chunks)
    ]


def _ours(messages: list[list[tuple[int, int, int, bytes]]]) -> bytes:
    file = io.BytesIO()
    made = Container(file, "some program")
    for kind in TYPES:
        made.add_schema(*kind)
    for topic in TOPICS:
        made.add_channel(*topic)
    for chunk in messages:
        for channel, number, time, data in chunk:
            made.add(channel, number, time, data)
        made.end_chunk()
    made.finish()
    return file.getvalue()


def _theirs(messages: list[list[tuple[int, int, int, bytes]]]) -> bytes:
    file = io.BytesIO()
    made = Writer(file, chunk_size=1 << 40)
    made.start("ros2", "some program")
    for name, definition in TYPES:
        made.register_schema(name, "ros2msg", definition.encode())
    for topic, schema in TOPICS:
        made.register_channel(topic, "cdr", schema)
    for chunk in messages:
        for channel, number, time, data in chunk:
            made.add_message(channel, time, data, time, number)
        made.flush()
    made.finish()
    return file.getvalue()


def _records(file: bytes) -> list[Any]:
    """All records, chunks not opened, without places of groups that are empty."""
    records = StreamReader(io.BytesIO(file), emit_chunks=True, validate_crcs=True).records
    return [r for r in records if not isinstance(r, SummaryOffset) or r.group_length]


def _summary(file: bytes) -> dict[str, Any]:
    """What a reader takes of the end of a file, without what compression and places decide."""
    found = make_reader(io.BytesIO(file), validate_crcs=True).get_summary()
    assert found is not None
    chunks = [asdict(index) for index in found.chunk_indexes]
    for chunk in chunks:
        for name in ("chunk_start_offset", "chunk_length", "compressed_size"):
            del chunk[name]
        places = chunk["message_index_offsets"]
        first = min(places.values())
        chunk["message_index_offsets"] = {each: at - first for each, at in places.items()}
    statistics = found.statistics
    assert statistics is not None
    return {
        "schemas": found.schemas,
        "channels": found.channels,
        "statistics": asdict(statistics) | {"channel_message_counts": None},
        "counts": dict(statistics.channel_message_counts),
        "chunks": chunks,
    }


@pytest.mark.parametrize("chunks", [0, 1, 7])
def test_a_file_says_the_same_as_one_of_the_package(chunks: int) -> None:
    messages = _messages(chunks)
    ours, theirs = _ours(messages), _theirs(messages)
    assert _summary(ours) == _summary(theirs)


@pytest.mark.parametrize("reverse", [False, True])
def test_messages_of_a_topic_are_found_in_the_order_of_their_times(reverse: bool) -> None:
    messages = _messages(7)
    found = [
        [
            (channel.topic, asdict(message))
            for _, channel, message in make_reader(io.BytesIO(file)).iter_messages(
                ["/b"], reverse=reverse
            )
        ]
        for file in (_ours(messages), _theirs(messages))
    ]
    assert len(found[0]) == sum(channel == 2 for chunk in messages for channel, *_ in chunk)
    assert found[0] == found[1]


def test_records_and_indexes_are_those_of_a_file_of_the_package() -> None:
    messages = _messages(3)
    ours, theirs = _records(_ours(messages)), _records(_theirs(messages))
    assert [type(record) for record in ours] == [type(record) for record in theirs]
    assert sum(isinstance(record, Chunk) for record in ours) == 3
    indexes = [[r for r in each if isinstance(r, MessageIndex)] for each in (ours, theirs)]
    assert indexes[0] == indexes[1]


def test_every_place_that_the_summary_names_is_right() -> None:
    """A record begins with its opcode and its length; both are looked for where it is said to be.

    The opcodes are those of the specification of MCAP.
    """
    file = _ours(_messages(3))
    records = _records(file)

    def opcode(at: int) -> int:
        return file[at]

    def end(at: int) -> int:
        return at + 9 + int.from_bytes(file[at + 1 : at + 9], "little")

    chunks = [record for record in records if isinstance(record, Chunk)]
    places = [record for record in records if isinstance(record, ChunkIndex)]
    for chunk, place in zip(chunks, places, strict=True):
        at = place.chunk_start_offset
        assert opcode(at) == 0x06
        assert end(at) == at + place.chunk_length
        assert place.compressed_size == len(chunk.data)
        for index in place.message_index_offsets.values():
            assert opcode(index) == 0x07
        after = end(max(place.message_index_offsets.values()))
        assert after == at + place.chunk_length + place.message_index_length
    groups = [record for record in records if isinstance(record, SummaryOffset)]
    assert [group.group_opcode for group in groups] == [0x03, 0x04, 0x0B, 0x08]
    foot = next(record for record in records if isinstance(record, Footer))
    at = foot.summary_start
    for group in groups:
        assert group.group_start == at
        while at < group.group_start + group.group_length:
            assert opcode(at) == group.group_opcode
            at = end(at)
        assert at == group.group_start + group.group_length
    assert at == foot.summary_offset_start
    assert opcode(at) == 0x0E


def test_a_message_that_does_not_fit_leaves_no_trace() -> None:
    file = io.BytesIO()
    made = Container(file, "some program")
    made.add_channel("/a", made.add_schema(*TYPES[0]))
    made.add(1, 1, 10, b"good")
    for number, time in ((1, -1), (2**32, 1), (1, 2**64)):
        with pytest.raises(struct.error):
            made.add(1, number, time, b"")
    made.finish()
    messages = list(make_reader(io.BytesIO(file.getvalue()), validate_crcs=True).iter_messages())
    assert [(message.log_time, message.data) for *_, message in messages] == [(10, b"good")]
