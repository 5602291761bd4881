"""The host's end of signed datagrams: what the board of this key said just now, and nothing else.

No input or output, and no clock: the time [s] is an argument.
"""

from __future__ import annotations

import hmac
import struct
from dataclasses import dataclass

from antennate.hardware.esp32 import datagram, frame
from antennate.params.hardware import NetworkParams

_COUNTS, _TAG = datagram.COUNTS_SIZE, datagram.TAG_SIZE
_GREETING_SIZE = frame.HELLO_FRAME_SIZE + _COUNTS + _TAG
_FRAME_SIZE = frame.SAMPLE_FRAME_SIZE + _TAG
_NUMBERS = 1 << 32
_OPEN_ASKS = 16
"""Asks that may still be answered: 4 s of them."""


class Bucket:
    """Allows so many events a second [1/s], and at most `depth` at once."""

    def __init__(self, rate: float, depth: int) -> None:
        self._rate, self._depth = rate, depth
        self._level, self._t = float(depth), float("-inf")

    def take(self, now: float) -> bool:
        """Whether one more is allowed at time now [s]; it is counted then."""
        self._level = min(self._depth, self._level + self._rate * max(now - self._t, 0.0))
        self._t = max(now, self._t)
        if self._level < 1.0:
            return False
        self._level -= 1.0
        return True


@dataclass(slots=True)
class Tally:
    """What became of every datagram.

    Attributes:
        received: All of them.
        greetings: Authentic answers to asks, each newer than the one before.
        frames: Authentic frames handed on.
        forged: Of a wrong size or with a wrong tag.
        old: Authentic, but of another boot or not newer than the last one.
        limited: Authentic, but more than allowed.
    """

    received: int = 0
    greetings: int = 0
    frames: int = 0
    forged: int = 0
    old: int = 0
    limited: int = 0


class Verifier:
    """Asks one board for frames and passes on what is authentic and new.

    Args:
        key: The board's.
        nonce: Random bytes of this connection, never used before.
        params: Rates.
    """

    def __init__(self, key: bytes, nonce: bytes, params: NetworkParams) -> None:
        if len(nonce) != datagram.NONCE_SIZE:
            raise ValueError(f"expected a nonce of {datagram.NONCE_SIZE} bytes, found {len(nonce)}")
        self.tally = Tally()
        self._signer = datagram.Signer(key)
        self._nonce = nonce
        self._period = params.ask_period
        self._allowed = Bucket(params.rate, params.burst)
        self._asked = float("-inf")
        self._number = self._answered = 0
        self._boot: int | None = None
        self._grants = 0
        self._seq: int | None = None

    def due_ask(self, now: float) -> bytes | None:
        """What to send at time now [s], if it is time to ask."""
        if now - self._asked < self._period:
            return None
        self._asked = now
        return self.ask()

    def ask(self) -> bytes:
        """The next ask: with what the board last sent, which proves that its datagrams arrive."""
        self._number += 1  # 2**32 of them last for 34 years
        return datagram.encode_ask(
            self._signer, self._nonce, self._number, self._boot or 0, self._grants
        )

    def take(self, data: bytes, now: float) -> tuple[bytes, bool]:
        """The frame in a datagram, empty if it is not to be used; and whether to ask anew at once.

        `now` is the time at which it came [s].
        """
        self.tally.received += 1
        content, tag = data[:-_TAG], data[-_TAG:]
        kind = {_FRAME_SIZE: datagram.FRAME, _GREETING_SIZE: datagram.GREETING}.get(len(data))
        expected = b"" if kind is None else self._signer.tag(kind, self._nonce, content)
        if not hmac.compare_digest(expected, tag):
            self.tally.forged += 1
            return b"", False
        if kind == datagram.FRAME:
            return self._frame(content, now), False
        return self._greeting(content)

    def _greeting(self, content: bytes) -> tuple[bytes, bool]:
        """Answers are taken in the order of the asks, so that no earlier boot comes back."""
        hello = content[:-_COUNTS]
        number, grants = struct.unpack(datagram.COUNTS_LAYOUT, content[-_COUNTS:])
        if not max(self._answered, self._number - _OPEN_ASKS) < number <= self._number:
            self.tally.old += 1
            return b"", False
        self.tally.greetings += 1
        self._answered, self._grants = number, grants
        body = frame.unstuff(hello[1:-1])
        if body is None or len(body) != frame.HELLO_SIZE + frame.CRC_SIZE:
            return hello, False  # the decoder says why not
        boot = struct.unpack(frame.HELLO_LAYOUT, body[: frame.HELLO_SIZE])[2]
        if first := boot != self._boot:
            self._boot, self._seq = boot, None
        return hello, first

    def _frame(self, content: bytes, now: float) -> bytes:
        body = frame.unstuff(content[1:-1])
        if body is None or len(body) != frame.SAMPLE_SIZE + frame.CRC_SIZE:
            return content
        boot, seq = struct.unpack(frame.SAMPLE_LAYOUT, body[: frame.SAMPLE_SIZE])[2:4]
        ahead = 1 if self._seq is None else (seq - self._seq) % _NUMBERS
        if boot != self._boot or not 0 < ahead < _NUMBERS // 2:
            self.tally.old += 1
            return b""
        self._seq = seq
        if not self._allowed.take(now):
            self.tally.limited += 1
            return b""
        self.tally.frames += 1
        return content
