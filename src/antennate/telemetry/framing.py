"""A record on disk: `00 COBS(content + CRC-32) 00`, as on the antenna board's wire.

No record holds a zero byte, so a reader finds the next one after any damage, and a damaged one is
known by its CRC. The content's first two bytes are the schema and the kind of record.
"""

from __future__ import annotations

from binascii import crc32
from collections.abc import Iterator
from enum import IntEnum
from typing import BinaryIO

from antennate.hardware.esp32.frame import CRC_SIZE, stuff_into, unstuff

SCHEMA = 3
"""Number of the layout of all records; rises with every change."""
LONGEST = 1 << 17
"""Most bytes between two delimiters that are held; more cannot be a record."""

_CHUNK = 1 << 16
_RUN = 254


class Kind(IntEnum):
    """What a record is."""

    HEADER = 1
    TICK = 2
    END = 3


def framed(content: bytes) -> bytes:
    """The record of a content, with delimiters on both sides."""
    source = bytearray(content) + crc32(content).to_bytes(CRC_SIZE, "little")
    target = bytearray(len(source) + len(source) // _RUN + 3)
    end = stuff_into(target, 1, source)
    return bytes(target[: end + 1])


def opened(piece: bytes) -> bytes | None:
    """The content of what lies between two delimiters; None if it is damaged."""
    body = unstuff(piece)
    if body is None or len(body) < CRC_SIZE + 2:
        return None
    content = bytes(body[:-CRC_SIZE])
    return content if crc32(content) == int.from_bytes(body[-CRC_SIZE:], "little") else None


def pieces(file: BinaryIO) -> Iterator[tuple[int, bytes | None]]:
    """What lies between delimiters, each with its offset; None in place of one that is too long.

    Raises:
        OSError: The file cannot be read.
    """
    held = b""
    at = start = 0
    spilled = False
    while chunk := file.read(_CHUNK):
        *closed, held = (held + chunk).split(b"\0")
        for piece in closed:
            if spilled:
                yield start, None
            elif piece:
                yield at, piece
            spilled = False
            at += len(piece) + 1
        if len(held) > LONGEST or spilled:
            start = start if spilled else at
            spilled = True
            at += len(held)
            held = b""
    if spilled:
        yield start, None
    elif held:
        yield at, held
