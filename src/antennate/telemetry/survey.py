"""What a log holds, from the summary of its closed file: no tick but the last is decoded.

The summary tells how many messages there are and where; every record and the CRC of each chunk are
checked all the same, so that a log which is damaged is not said to be sound. What another program
wrote is read tick by tick in its place, as its messages may stand in any order.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import BinaryIO, NamedTuple

from antennate.errors import LogError
from antennate.telemetry.chunks import Fault, is_foreign, walk
from antennate.telemetry.contents import Chunk
from antennate.telemetry.summary import places, summary
from antennate.telemetry.topics import EVENTS, HEADER_TOPICS, MANEUVER, TOPICS, Topic


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
    """The survey of a log that antennate has closed; None of another, or if it is damaged.

    Args:
        file: The log.
        topics: Its topics by their channel.

    Raises:
        OSError: It cannot be read.
    """
    end = summary(file)
    if end is None or not end.told or is_foreign(file):
        return None
    counts = Counter[Topic | None]()
    for channel, count in end.counts.items():
        counts[topics.get(channel)] += count
    try:
        messages = [
            each
            for chunk in _intact(file, topics)
            for each in chunk.messages
            if topics.get(each.channel) in (EVENTS, MANEUVER)
        ]
        events = [m for m in messages if topics.get(m.channel) is EVENTS]
        for event in events:
            EVENTS.decode(event.data)
        ticks = [m for m in messages if topics.get(m.channel) is MANEUVER]
        number = MANEUVER.decode(ticks[-1].data)["number"] if ticks else 0
    except (ValueError, LogError):  # also of an event that is none
        return None
    if bool(ticks) != bool(counts[MANEUVER]):
        return None  # it does not tell where they are
    kept = {topic: counts[topic] for topic in TOPICS if counts[topic]}
    for topic in HEADER_TOPICS:
        kept.pop(topic, None)
    told = [(event.time, event.data) for event in events]
    return Survey(kept, told, *span([tick.time for tick in ticks]), number)


def _intact(file: BinaryIO, topics: Mapping[int, Topic]) -> Iterator[Chunk]:
    """The chunks, those that are of use with their messages."""
    for found in walk(file, _to_read(file, topics)):
        if isinstance(found, Fault):
            raise ValueError(found.reason)
        if isinstance(found, Chunk):
            yield found


def _to_read(file: BinaryIO, topics: Mapping[int, Topic]) -> frozenset[int]:
    """Where the chunks are with events, and the first and the last one with ticks."""
    events, ends = list[int](), list[int]()
    for place in places(file):
        held = {topics.get(channel) for channel in place.channels}
        if EVENTS in held:
            events.append(place.offset)
        if MANEUVER in held:
            ends = [*ends[:1], place.offset]
    return frozenset(events + ends)


def span(times: Sequence[int]) -> tuple[int, int]:
    """The first and the last of some times in order; both 0 of none."""
    return (times[0], times[-1]) if times else (0, 0)
