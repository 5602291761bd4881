"""The messages of a file in the order of their times, after its header.

antennate writes them so. Another program may sort them by topic, for example, as MCAP leaves their
order open; then all of them are held at once.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import BinaryIO, NamedTuple

from antennate.telemetry.chunks import Chunk, Fault, Message, is_foreign, walk
from antennate.telemetry.summary import End
from antennate.telemetry.topics import HEADER_TOPICS, TOPICS

_OURS = frozenset(topic.name for topic in TOPICS)
_HEADER = frozenset(topic.name for topic in HEADER_TOPICS)


class _Contents(NamedTuple):
    """The header of a file of another program, and whether its messages are in order."""

    header: Chunk
    ordered: bool


def in_order(file: BinaryIO) -> Iterator[Chunk | Fault | End]:
    """What a file holds, as `walk` has it, but messages in the order of their times.

    Of another program, the messages of the header come first, wherever they are.

    Raises:
        OSError: The file cannot be read.
    """
    found = _contents(file) if is_foreign(file) else None
    if found is not None:
        yield found.header
    if found is None or found.ordered:
        yield from walk(file)
        return
    others, messages = list[Fault | End](), list[Message]()
    for place in walk(file):
        if isinstance(place, Chunk):
            messages += _ours(place.messages, found.header.channels)
        else:
            others.append(place)
    messages.sort(key=lambda message: message.time)
    yield found.header._replace(messages=tuple(messages))
    yield from others


def _contents(file: BinaryIO) -> _Contents | None:
    """What a first pass over a file tells; None if it has no chunk."""
    whole: Chunk | None = None
    channels, schemas = dict[int, tuple[str, int, str]](), dict[int, tuple[str, str]]()
    first, last, ordered = dict[str, Message](), 0, True
    for chunk in walk(file):
        if not isinstance(chunk, Chunk):
            continue
        channels |= chunk.channels
        schemas |= chunk.schemas
        guarded = chunk.guarded and (whole is None or whole.guarded)
        whole = (whole or chunk)._replace(guarded=guarded)
        for message in _ours(chunk.messages, channels):
            name = channels[message.channel][0]
            if name in _HEADER:
                first.setdefault(name, message)
            else:
                ordered, last = ordered and last <= message.time, message.time
    if whole is None:
        return None
    header = whole._replace(messages=tuple(first.values()), channels=channels, schemas=schemas)
    return _Contents(header, ordered)


def _ours(
    messages: Iterable[Message], channels: Mapping[int, tuple[str, int, str]]
) -> Iterator[Message]:
    """The messages of known topics; those of others, which may be large, are not held."""
    known = {number for number, (name, *_) in channels.items() if name in _OURS}
    return (message for message in messages if message.channel in known)
