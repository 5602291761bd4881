"""Bytes to frames, without any input or output of its own.

However a stream is cut into pieces, the frames, the text and the counters are the same.
"""

from __future__ import annotations

import re
from binascii import crc32
from dataclasses import dataclass

from antennate.hardware.esp32 import frame
from antennate.hardware.esp32.wire import Frame, Refused, parse

LONGEST = 128
"""Bytes between delimiters that are held; from here on they cannot be a frame."""
SHORTEST = 2 + frame.CRC_SIZE + 1
"""Version, kind, CRC and one byte of COBS."""
TEXT_KEPT = 512
"""Bytes of text held until they are taken."""

_TEXT = re.compile(rb"[\t\n\r\x20-\x7e]{8,}")


@dataclass(slots=True)
class Counters:
    """What became of every byte: delimiters, judged and held ones add up to those received.

    The bytes between two delimiters are one piece.

    Attributes:
        received: Bytes fed.
        delimiters: Zero bytes.
        judged: Bytes of all pieces below.
        good: Frames delivered.
        refused: Intact frames of an unknown version, kind, length or range.
        crc_errors: Pieces of COBS with a wrong CRC.
        cobs_errors: Pieces that are not COBS.
        oversize: Pieces longer than any frame.
        noise: Pieces shorter than any frame.
        text: Pieces that are printable text only.
    """

    received: int = 0
    delimiters: int = 0
    judged: int = 0
    good: int = 0
    refused: int = 0
    crc_errors: int = 0
    cobs_errors: int = 0
    oversize: int = 0
    noise: int = 0
    text: int = 0


class FrameDecoder:
    """Finds frames in a stream; keeps less than 1 KiB whatever comes."""

    def __init__(self) -> None:
        self.counters = Counters()
        self._held = bytearray()
        self._spilled = False
        self._text = bytearray()

    @property
    def held(self) -> int:
        """Bytes waiting for their delimiter."""
        return len(self._held)

    def feed(self, data: bytes) -> list[Frame]:
        """Frames completed by these bytes, in order of arrival; Refused ones say why."""
        frames: list[Frame] = []
        self.counters.received += len(data)
        at = 0
        while at < len(data):
            limit = at + LONGEST - len(self._held)
            end = data.find(0, at, limit)
            if end < 0:
                self._held += data[at:limit]
                at = limit
                if len(self._held) == LONGEST:
                    self._spill()
                continue
            self._held += data[at:end]
            at = end + 1
            self.counters.delimiters += 1
            if (whole := self._close()) is not None:
                frames.append(whole)
        return frames

    def take_text(self) -> str:
        """Printable text found between frames since the last call, at most TEXT_KEPT bytes.

        Asking at most 8 times a second keeps a log below 4 KiB/s.
        """
        text = self._text.replace(b"\r", b"").decode("ascii")
        self._text = bytearray()
        return text

    def _spill(self) -> None:
        """Give up bytes that cannot be a frame any more, except text."""
        self._keep_text(self._held)
        self.counters.judged += len(self._held)
        self._held = bytearray()
        self._spilled = True

    def _close(self) -> Frame | None:
        """Classify what lies between two delimiters."""
        chunk, counters = bytes(self._held), self.counters
        self._held = bytearray()
        counters.judged += len(chunk)
        if self._spilled:
            self._spilled = False
            counters.oversize += 1
            self._keep_text(chunk)
            return None
        content = frame.unstuff(chunk) if len(chunk) >= SHORTEST else None
        if content is not None and _intact(content):
            parsed = parse(content[: -frame.CRC_SIZE])
            counters.refused += isinstance(parsed, Refused)
            counters.good += not isinstance(parsed, Refused)
            return parsed
        if chunk:
            self._reject(chunk, cobs=content is not None)
        return None

    def _reject(self, chunk: bytes, cobs: bool) -> None:
        self._keep_text(chunk)
        if _TEXT.fullmatch(chunk):
            self.counters.text += 1
        elif len(chunk) < SHORTEST:
            self.counters.noise += 1
        elif cobs:
            self.counters.crc_errors += 1
        else:
            self.counters.cobs_errors += 1

    def _keep_text(self, chunk: bytes | bytearray) -> None:
        for run in _TEXT.findall(chunk):
            self._text += run[: TEXT_KEPT - len(self._text)]


def _intact(content: bytes | bytearray) -> bool:
    end = len(content) - frame.CRC_SIZE
    return crc32(content[:end]) == int.from_bytes(content[end:], "little")
