"""Our writer of MCAP files beside that of the package `mcap`, read by its readers."""

from __future__ import annotations

import io
from dataclasses import asdict
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.records import Chunk, MessageIndex, SummaryOffset
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
    kinds, indexes = list[list[str]](), list[list[MessageIndex]]()
    for file in (_ours(messages), _theirs(messages)):
        records = [
            record
            for record in StreamReader(
                io.BytesIO(file), emit_chunks=True, validate_crcs=True
            ).records
            if not isinstance(record, SummaryOffset) or record.group_length
        ]
        kinds.append([type(record).__name__ for record in records])
        indexes.append([record for record in records if isinstance(record, MessageIndex)])
    assert kinds[0] == kinds[1]
    assert kinds[0].count(Chunk.__name__) == 3
    assert indexes[0] == indexes[1]
