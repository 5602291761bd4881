"""A port on the network: signed datagrams of an antenna board.

Only what the board of this key said just now comes in, and nothing else.
"""

from __future__ import annotations

import errno
import hmac
import os
import select
import socket
import struct
import time
from collections.abc import Callable
from dataclasses import dataclass

from antennate.errors import reason
from antennate.hardware.esp32 import datagram, frame
from antennate.params.hardware import NetworkParams
from dynamixel_bus.port import Port, PortError

_COUNTS, _TAG = datagram.COUNTS_SIZE, datagram.TAG_SIZE
_GREETING_SIZE = frame.HELLO_FRAME_SIZE + _COUNTS + _TAG
_KINDS = {
    _GREETING_SIZE: datagram.GREETING,
    frame.SAMPLE_FRAME_SIZE + _TAG: datagram.FRAME,
    frame.MOTION_FRAME_SIZE + _TAG: datagram.FRAME,
}
"""What a datagram of this size is."""
_BODIES = (frame.SAMPLE_SIZE + frame.CRC_SIZE, frame.MOTION_SIZE + frame.CRC_SIZE)
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
class DatagramCounts:
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
        self.tally = DatagramCounts()
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
        kind = _KINDS.get(len(data))
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
        if body is None or len(body) not in _BODIES:
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


_LONGEST = 256
"""More than any datagram of a board [bytes]; what is longer is cut, and then refused."""
_ABSENT = {errno.ECONNREFUSED, errno.EHOSTUNREACH, errno.ENETUNREACH, errno.ENETDOWN, errno.ENOBUFS}
"""What sending says while the board or the network is away; it may come back."""


class UdpPort(Port):
    """The frames of one board. Datagrams of other senders are not received.

    Args:
        host: Where the board is, a name or an address.
        port: Its UDP port.
        key: The board's key; empty for a board without one, in whose place anybody can send frames.
        params: Pace and limits.
        clock: Time that never steps [s].
    """

    def __init__(
        self,
        host: str,
        port: int,
        key: bytes,
        params: NetworkParams | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        params = params or NetworkParams()
        self._where = f"udp://{host}:{port}"
        self._clock = clock
        self._verifier = Verifier(key, os.urandom(16), params)
        self.tally = self._verifier.tally
        self._looks = Bucket(params.look_rate, params.look_burst)
        self._held = b""
        try:
            family, kind, _, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_DGRAM)[0]
            self._socket = socket.socket(family, kind)
            self._socket.setblocking(False)
            self._socket.connect(address)  # the kernel drops datagrams of other senders
        except OSError as error:
            raise PortError(f"could not open {self._where}: {reason(error)}") from error

    def write(self, data: bytes) -> None:
        """Ask the board anew; it listens to nothing else, so the bytes themselves are not sent."""
        self._send(self._verifier.ask())

    def read(self, most: int, timeout: float) -> bytes:
        """Authentic frames that have come, empty if none comes within `timeout` [s]."""
        end = self._clock() + timeout
        while True:
            now = self._clock()
            if (ask := self._verifier.due_ask(now)) is not None:
                self._send(ask)
            if not self._held:
                self._held = self._look(now)
            if self._held or now >= end:
                came, self._held = self._held[:most], self._held[most:]
                return came
            select.select([self._socket], [], [], min(end - now, 0.05))

    def close(self) -> None:
        """Let it go; the board falls silent by itself."""
        self._socket.close()

    def _look(self, now: float) -> bytes:
        """Frames of the datagrams that wait; a flood is looked at in part only."""
        frames = bytearray()
        while self._looks.take(now):
            data = self._receive()
            if data is None:
                break
            frame, again = self._verifier.take(data, now)
            frames += frame
            if again:
                self._send(self._verifier.ask())
        return bytes(frames)

    def _receive(self) -> bytes | None:
        try:
            return self._socket.recv(_LONGEST)
        except BlockingIOError:
            return None
        except OSError as error:
            if error.errno in _ABSENT:
                return None
            raise PortError(f"could not read from {self._where}: {reason(error)}") from error

    def _send(self, data: bytes) -> None:
        try:
            self._socket.send(data)
        except BlockingIOError:
            return
        except OSError as error:
            if error.errno not in _ABSENT:
                raise PortError(f"could not write to {self._where}: {reason(error)}") from error
