"""The messages of a file in the order of their times.

antennate writes them so. Another program may sort them by topic, for example, as MCAP leaves their
order open; then all of them are held at once.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import chain, pairwise
from typing import BinaryIO

from antennate.telemetry.chunks import Chunk, Fault, Message, is_foreign, walk
from antennate.telemetry.summary import End


def in_order(file: BinaryIO) -> Iterator[Chunk | Fault | End]:
    """What a file holds, as `walk` has it, but messages in the order of their times.

    Raises:
        OSError: The file cannot be read.
    """
    if not is_foreign(file) or _is_in_order(file):
        yield from walk(file)
        return
    others, chunks = list[Fault | End](), list[Chunk]()
    for found in walk(file):
        if isinstance(found, Chunk):
            chunks.append(found)
        else:
            others.append(found)
    yield Chunk(
        chunks[0].offset,
        tuple(sorted(_messages(chunks), key=lambda message: message.time)),
        {number: each for chunk in chunks for number, each in chunk.channels.items()},
        {number: each for chunk in chunks for number, each in chunk.schemas.items()},
        guarded=all(chunk.guarded for chunk in chunks),
        foreign=True,
    )
    yield from others


def _is_in_order(file: BinaryIO) -> bool:
    chunks = (found for found in walk(file) if isinstance(found, Chunk))
    times = (message.time for message in _messages(chunks))
    return all(before <= after for before, after in pairwise(times))


def _messages(chunks: Iterable[Chunk]) -> Iterator[Message]:
    return chain.from_iterable(chunk.messages for chunk in chunks)
