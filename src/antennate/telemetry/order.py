"""The messages of a file in the order of their times, after its header.

antennate writes them so. Another program may sort them by topic, for example, as MCAP leaves their
order open; then all of them are held at once.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import BinaryIO

from antennate.files import in_units
from antennate.telemetry.chunks import Chunk, Fault, Message, is_foreign, walk
from antennate.telemetry.summary import End
from antennate.telemetry.topics import HEADER_TOPICS, TOPICS

_OURS = frozenset(topic.name for topic in TOPICS)
_HEADER = frozenset(topic.name for topic in HEADER_TOPICS)


_MOST = 1 << 31
"""Most bytes of messages that are held at once."""
_BESIDE = 200
"""Bytes that a message takes beside its content."""


class _Order:
    """What is held of messages to put them in order, and to find those of one time.

    Attributes:
        kept: Whether they are in the order of their times.
    """

    def __init__(self) -> None:
        self.kept = True
        self._last = self._all = self._now = self._most = 0

    def add(self, message: Message) -> None:
        """Take note of the next message."""
        size = len(message.data) + _BESIDE
        self._now = size + (self._now if message.time == self._last else 0)
        self._most = max(self._most, self._now)
        self._all += size
        self.kept = self.kept and self._last <= message.time
        self._last = message.time

    @property
    def held(self) -> int:
        """Bytes of those of one time, or of all if they are not in order."""
        return self._most if self.kept else self._all


def in_order(file: BinaryIO) -> Iterator[Chunk | Fault | End]:
    """What a file holds, as `walk` has it, but messages in the order of their times.

    Of another program, the messages of the header come first, wherever they are.

    Raises:
        OSError: The file cannot be read.
    """
    header, order = _contents(file) if is_foreign(file) else (None, _Order())
    if header is not None:
        yield header
    if header is not None and order.held > _MOST:
        why = "of one time" if order.kept else "that are not in the order of their times"
        yield Fault(header.offset, f"more than {in_units(_MOST)} of messages {why}")
    elif header is None or order.kept:
        yield from walk(file)
    else:
        yield from _in_new_order(file, header)


def _in_new_order(file: BinaryIO, header: Chunk) -> Iterator[Chunk | Fault | End]:
    """What a file holds, all of its messages at once."""
    others, messages = list[Fault | End](), list[Message]()
    for place in walk(file):
        if isinstance(place, Chunk):
            messages += _ours(place.messages, header.channels)
        else:
            others.append(place)
    messages.sort(key=lambda message: message.time)
    yield header._replace(messages=tuple(messages))
    yield from others


def _contents(file: BinaryIO) -> tuple[Chunk | None, _Order]:
    """The header, as a chunk that declares all channels, and the order of the other messages.

    There is none in a file without a chunk.
    """
    begin: Chunk | None = None
    channels, schemas = dict[int, tuple[str, int, str]](), dict[int, tuple[str, str]]()
    first, order = dict[str, Message](), _Order()
    for chunk in walk(file):
        if not isinstance(chunk, Chunk):
            continue
        channels |= chunk.channels
        schemas |= chunk.schemas
        guarded = chunk.guarded and (begin is None or begin.guarded)
        begin = (begin or chunk)._replace(guarded=guarded)
        for message in _ours(chunk.messages, channels):
            name = channels[message.channel][0]
            if name in _HEADER:
                first.setdefault(name, message)
            else:
                order.add(message)
    if begin is None:
        return None, order
    messages = tuple(first.values())
    return begin._replace(messages=messages, channels=channels, schemas=schemas), order


def _ours(
    messages: Iterable[Message], channels: Mapping[int, tuple[str, int, str]]
) -> Iterator[Message]:
    """The messages of known topics; those of others, which may be large, are not held."""
    known = {number for number, (name, *_) in channels.items() if name in _OURS}
    return (message for message in messages if message.channel in known)
