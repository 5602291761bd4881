"""What a log holds, by the summary of its closed file or tick by tick.

The summary tells how many messages there are and where; no tick but the last is decoded. Every
record and the CRC of each chunk are checked all the same, so that a log which is damaged is not
said to be sound.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from typing import BinaryIO, NamedTuple

from antennate.telemetry.ticks import Tick
from antennate.telemetry.topics import EVENTS, HEADER_TOPICS, MANEUVER, TOPICS, Topic

_Stamped = tuple[int, bytes]
"""Time [ns] and bytes of a message."""


class Record(NamedTuple):
    """One message as it is: topic, number of its tick, time [ns], bytes."""

    topic: Topic
    number: int
    time: int
    data: bytes


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


def tick_by_tick(groups: Iterable[tuple[Sequence[Record], Tick | None]]) -> Survey:
    """The survey of all messages of a log."""
    counts, events, times, number = Counter[Topic](), list[_Stamped](), list[int](), 0
    for records, tick in groups:
        counts.update(record.topic for record in records)
        events += [(record.time, record.data) for record in records if record.topic is EVENTS]
        if tick is not None:
            times, number = [*times[:1], records[0].time], tick.number
    return _survey(counts, events, times, number)


def by_summary(file: BinaryIO, topics: Mapping[int, Topic]) -> Survey | None:
    """The survey of a log that antennate has closed; None of another, or if it is damaged.

    What another program wrote is read tick by tick in its place: its messages may have any order.

    Args:
        file: The log.
        topics: Its topics by their channel.
    """
    from antennate.telemetry.chunks import UNSOUND, Fault, is_own, walk  # slow to import

    events, ticks = list[_Stamped](), list[_Stamped]()
    try:
        if not is_own(file):
            return None
        counts, wanted = _summary(file, topics)
        for place in walk(file, wanted):
            if isinstance(place, Fault):
                return None
            for message in getattr(place, "messages", ()):
                topic = topics.get(message.channel_id)
                if topic is EVENTS:
                    EVENTS.decode(message.data)
                    events.append((message.log_time, message.data))
                elif topic is MANEUVER:
                    ticks = [*ticks[:1], (message.log_time, message.data)]
        number = MANEUVER.decode(ticks[-1][1])["number"] if ticks else 0
    except UNSOUND:  # also of an event that is none
        return None
    if bool(ticks) != bool(counts[MANEUVER]):
        return None  # it does not tell where they are
    return _survey(counts, events, [time for time, _ in ticks], number)


def _summary(file: BinaryIO, topics: Mapping[int, Topic]) -> tuple[Counter[Topic], frozenset[int]]:
    """Messages of each topic, and where chunks with events and the first and last ticks begin."""
    from mcap.records import ChunkIndex, Statistics

    from antennate.telemetry.chunks import summary

    counts, events, ticks = Counter[Topic](), list[int](), list[int]()
    for record in summary(file):
        if isinstance(record, Statistics):
            for channel, count in record.channel_message_counts.items():
                if channel in topics:
                    counts[topics[channel]] += count
        elif isinstance(record, ChunkIndex):
            content = {topics.get(channel) for channel in record.message_index_offsets}
            if EVENTS in content:
                events.append(record.chunk_start_offset)
            if MANEUVER in content:
                ticks = [*ticks[:1], record.chunk_start_offset]
    return counts, frozenset(events + ticks)


def _survey(
    counts: Counter[Topic], events: Sequence[_Stamped], times: Sequence[int], number: int
) -> Survey:
    messages = {each: counts[each] for each in TOPICS if counts[each] and each not in HEADER_TOPICS}
    first, last = (times[0], times[-1]) if times else (0, 0)
    return Survey(messages, events, first, last, number)
