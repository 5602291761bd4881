"""What a log holds, from the summary of its closed file: no tick is decoded.

The summary tells how many messages there are and where; the CRC of each chunk is checked all the
same, so that a log which is damaged is not said to be sound.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import BinaryIO, NamedTuple

from antennate.errors import LogError
from antennate.telemetry.chunks import Chunk, chunk_at, is_sound
from antennate.telemetry.summary import Place, places, summary
from antennate.telemetry.ticks import Tick
from antennate.telemetry.topics import EVENTS, HEADER_TOPICS, MANEUVER, TICK_TOPICS, TOPICS, Topic


class Survey(NamedTuple):
    """What a log holds.

    Attributes:
        messages: How many there are of each topic, but those of the header.
        events: Time [ns] and bytes of each event.
        first, last: Times of the first and the last tick [ns]; both 0 without any.
        number: That of the last tick, 0 without any.
    """

    messages: Mapping[Topic, int]
    events: Sequence[tuple[int, bytes]]
    first: int
    last: int
    number: int


def by_summary(file: BinaryIO, topics: Mapping[int, Topic]) -> Survey | None:
    """The survey of a closed file; None if it is not closed, or anything of it is not sound.

    Args:
        file: The log.
        topics: Its topics by their channel.

    Raises:
        OSError: It cannot be read.
    """
    end = summary(file)
    if end is None or not end.told:
        return None
    if not topics.keys() >= end.counts.keys():
        return None  # channels that later chunks declare, as other programs may
    counts = {topics[channel]: n for channel, n in end.counts.items()}
    if len({counts.get(topic, 0) for topic in TICK_TOPICS}) != 1:
        return None  # a tick is not whole
    try:
        events, ends = _looked_through(file, topics)
        chunks = [chunk for place in ends if (chunk := chunk_at(file, place)) is not None]
        for chunk in chunks:
            _require_ticks(chunk, topics)
    except (ValueError, LogError):  # also of an event that is none
        return None
    if counts.get(MANEUVER) and not chunks:
        return None  # it does not tell where they are
    ticks = [m for chunk in chunks for m in chunk.messages if topics.get(m.channel) is MANEUVER]
    numbers, times = [m.number for m in ticks], [m.time for m in ticks]
    if numbers != sorted(numbers) or times != sorted(times):
        return None
    kept = {topic: counts[topic] for topic in TOPICS if counts.get(topic)}
    for topic in HEADER_TOPICS:
        kept.pop(topic, None)
    return Survey(kept, events, *span(times), numbers[-1] if numbers else 0)


def _require_ticks(chunk: Chunk, topics: Mapping[int, Topic]) -> None:
    """Check that the ticks of a chunk can be read.

    Raises:
        LogError: One cannot.
    """
    ticks: dict[int, dict[Topic, bytes]] = {}
    for message in chunk.messages:
        if (topic := topics.get(message.channel)) in TICK_TOPICS and topic is not None:
            ticks.setdefault(message.number, {})[topic] = message.data
    for found in ticks.values():
        if len(found) < len(TICK_TOPICS):
            raise LogError("a tick that is not whole")
        Tick.of_messages(found)


def _looked_through(
    file: BinaryIO, topics: Mapping[int, Topic]
) -> tuple[list[tuple[int, bytes]], list[Place]]:
    """The events, and the places of the first and the last chunk with ticks.

    Raises:
        OSError: It cannot be read.
        ValueError: A chunk is damaged, or has parts of ticks alone, as where messages are sorted by
            their topic: then it is to be seen which ticks are whole.
    """
    events, ends = list[tuple[int, bytes]](), list[Place]()
    for place in places(file):
        held = {topics[channel] for channel in place.channels if channel in topics}
        chunk = chunk_at(file, place) if EVENTS in held else None
        if chunk is None and (EVENTS in held or not is_sound(file, place)):
            raise ValueError("a damaged chunk")
        messages = () if chunk is None else chunk.messages
        of_chunk = [(m.time, m.data) for m in messages if topics.get(m.channel) is EVENTS]
        for _, data in of_chunk:
            EVENTS.decode(data)
        events += of_chunk
        if not held.isdisjoint(TICK_TOPICS):
            if not held.issuperset(TICK_TOPICS):
                raise ValueError("parts of ticks")
            ends = [*ends[:1], place]
    return events, ends


def span(times: Sequence[int]) -> tuple[int, int]:
    """The first and the last of some times in order; both 0 of none."""
    return (times[0], times[-1]) if times else (0, 0)
