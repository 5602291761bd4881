"""The messages of a file in the order of their times, after its header.

antennate writes them so. Another program may sort them by topic, for example, as MCAP leaves their
order open; then they go to a file that has no name, with only their times and places in memory.
"""

from __future__ import annotations

import struct
from array import array
from collections.abc import Iterable, Iterator, Mapping
from tempfile import TemporaryFile
from typing import BinaryIO

import numpy as np

from antennate.telemetry.chunks import Fault, is_foreign, walk
from antennate.telemetry.contents import Chunk, Message
from antennate.telemetry.summary import End
from antennate.telemetry.topics import HEADER_TOPICS, TOPICS

_OURS = frozenset(topic.name for topic in TOPICS)
_HEADER = frozenset(topic.name for topic in HEADER_TOPICS)
_MOST = 1 << 21
"""Most messages whose times and places are held, 24 bytes each: an hour at 100 Hz and more."""
_ROOM = 1 << 31
"""Most bytes of their content on the disk."""
_ENTRY = struct.Struct("<QHIQQ")
"""Before the content of a message on the disk: its chunk, channel, number, time and length."""


def in_order(file: BinaryIO) -> Iterator[Chunk | Fault | End]:
    """What a file holds, as `walk` has it, but messages in the order of their times.

    Of another program, the messages of the header come first, wherever they are.

    Raises:
        OSError: The file cannot be read.
    """
    header, kept = _contents(file) if is_foreign(file) else (None, True)
    if header is not None:
        yield header
    if header is None or kept:
        yield from walk(file)
    else:
        yield from _in_new_order(file, header)


def _in_new_order(file: BinaryIO, header: Chunk) -> Iterator[Chunk | Fault | End]:
    """What a file holds: each message as a chunk of its own, with the place of that which it is of.

    Faults and the end come first.
    """
    times, places, room = array("Q"), array("Q"), 0
    with TemporaryFile() as spool:
        for found in walk(file):
            if not isinstance(found, Chunk):
                yield found
                continue
            for channel, number, time, data in _ours(found.messages, header.channels):
                times.append(time)
                places.append(room)
                spool.write(_ENTRY.pack(found.offset, channel, number, time, len(data)))
                room += _ENTRY.size + spool.write(data)
                if len(times) > _MOST or room > _ROOM:
                    why = f"more than {_MOST} messages or {_ROOM} bytes"
                    cure = "sort the file first, as by `mcap sort`"
                    yield Fault(found.offset, f"{why} not in the order of their times; {cure}")
                    return
        for row in np.argsort(np.frombuffer(times, np.uint64), kind="stable"):
            spool.seek(places[row])
            offset, channel, number, time, size = _ENTRY.unpack(spool.read(_ENTRY.size))
            message = Message(channel, number, time, spool.read(size))
            yield Chunk(offset, (message,), {}, {}, 0, header.guarded, foreign=True)


def _contents(file: BinaryIO) -> tuple[Chunk | None, bool]:
    """The header, as a chunk that declares all channels, and whether the others are in order.

    There is none in a file without a chunk.
    """
    begin: Chunk | None = None
    channels, schemas = dict[int, tuple[str, int, str]](), dict[int, tuple[str, str]]()
    first, kept, last = dict[str, Message](), True, 0
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
                kept = kept and last <= message.time
                last = message.time
    if begin is None:
        return None, kept
    messages = tuple(first.values())
    return begin._replace(messages=messages, channels=channels, schemas=schemas), kept


def _ours(
    messages: Iterable[Message], channels: Mapping[int, tuple[str, int, str]]
) -> Iterator[Message]:
    """The messages of known topics; those of others, which may be large, are not held."""
    known = {number for number, (name, *_) in channels.items() if name in _OURS}
    return (message for message in messages if message.channel in known)
