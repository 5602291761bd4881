"""A board's frames over UDP, signed as the firmware signs them, as an endpoint."""

from __future__ import annotations

import socket
import struct
import time
from collections.abc import Callable
from typing import Any

from antennate.errors import BadInputError
from antennate.hardware.esp32 import datagram, frame

_ALIVE = 0.1
"""A board that has been silent for longer [s], ten samples, does not answer either."""


class UdpEndpoint:
    """Answers requests and sends each frame in a datagram of its own.

    Args:
        host: Address to listen on; only this one.
        port: UDP port, 0 for any that is free.
        key: The board's.
        now: Monotonic time [s].

    Raises:
        BadInputError: The port cannot be had.
    """

    def __init__(
        self, host: str, port: int, key: bytes, now: Callable[[], float] = time.monotonic
    ) -> None:
        self._now = now
        self._signer = datagram.Signer(key)
        self._speaker: datagram.Speaker | None = None
        self._boot = -1
        self._written = 0.0
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        try:
            self._socket.bind((host, port))
        except OSError as error:
            self._socket.close()
            raise BadInputError(
                f"--udp: expected a free port, found {host}:{port}: {error}"
            ) from None
        self.path = f"udp://{host}:{self._socket.getsockname()[1]}"

    def fileno(self) -> int:
        """Of the socket."""
        return self._socket.fileno()

    def baud(self) -> int | None:
        """There is none."""
        return None

    def read(self) -> bytes:
        """Answer a request that has come; a board takes nothing else."""
        try:
            asked, sender = self._socket.recvfrom(datagram.ASK_SIZE + 1)
        except OSError:
            return b""
        now = self._now()
        if self._speaker is not None and now - self._written < _ALIVE:
            answer = self._speaker.answer(asked, sender, round(1e3 * now))
            if answer is not None:
                self._send(answer, sender)
        return b""

    def write(self, data: bytes) -> None:
        """Send whole frames; a greeting is kept for clients that ask."""
        now = self._now()
        self._written = now
        for chunk in data.split(b"\0"):
            body = frame.unstuff(chunk) if chunk else None
            if body is None:
                continue
            whole = b"\0" + chunk + b"\0"
            if body[1] == frame.HELLO:
                self._begin(whole, struct.unpack_from(frame.HELLO_LAYOUT, body)[2])
            elif self._speaker is not None:
                signed = self._speaker.sign(whole, round(1e3 * now))
                if signed is not None:
                    self._send(signed, self._speaker.listener)

    def close(self) -> None:
        """Close the port."""
        self._socket.close()

    def _begin(self, hello: bytes, boot: int) -> None:
        if boot != self._boot:
            size = frame.SAMPLE_FRAME_SIZE
            self._speaker = datagram.Speaker(self._signer, boot, hello, size)
            self._boot = boot

    def _send(self, data: bytes | bytearray, receiver: Any) -> None:
        try:
            self._socket.sendto(data, receiver)
        except OSError:
            return
