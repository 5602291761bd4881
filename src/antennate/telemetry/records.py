"""The messages of a log, and which of them are of one tick.

That is told by their time. Their number matters only where several ticks have one time: other
programs may count the messages of each topic, or none.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

from antennate.telemetry.topics import CONTACT_FORCES, COORDINATES, EVENTS, Topic

BESIDE = (EVENTS, CONTACT_FORCES, COORDINATES)
"""Topics whose messages are no part of a tick."""


class Record(NamedTuple):
    """One message as it is: topic, number of its tick, time [ns], bytes."""

    topic: Topic
    number: int
    time: int
    data: bytes


def by_tick(held: Sequence[Record], doubled: bool) -> Iterable[Sequence[Record]]:
    """The messages of one time, tick by tick; those that say the same once.

    Args:
        held: The messages.
        doubled: Whether messages of this log were found twice, so that equal events are one.
    """
    if not (doubled or repeats(held)):
        return (held,)
    alike = {record._replace(number=0): record for record in held}
    if not repeats(alike):
        return ([*alike.values()],)
    ticks = dict[int, list[Record]]()
    for record in dict.fromkeys(held):
        ticks.setdefault(record.number, []).append(record)
    return ticks.values()


def repeats(held: Iterable[Record]) -> bool:
    """Whether there are more messages in a topic than a tick has."""
    parts = [record.topic.name for record in held if record.topic not in BESIDE]
    return len(parts) > len(set(parts))
