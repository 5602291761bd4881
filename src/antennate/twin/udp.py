"""A board's frames over UDP, signed as the firmware signs them, as one end of a twin."""

from __future__ import annotations

import socket
import struct
import time
from typing import Any

from antennate.errors import BadInputError
from antennate.hardware.esp32 import datagram, frame
from antennate.params import TwinParams

_ALIVE = TwinParams().udp_silence
"""A board that has been silent for longer [s] does not answer either."""


class UdpEnd:
    """Answers asks and sends each frame in a datagram of its own.

    Args:
        host: Address to listen on; only this one.
        port: UDP port, 0 for any that is free.
        key: The board's.

    Raises:
        BadInputError: The port cannot be had.
    """

    def __init__(self, host: str, port: int, key: bytes) -> None:
        self._signer = datagram.Signer(key)
        self._speaker: datagram.Speaker | None = None
        self._boot = -1
        self._spoke = 0.0
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
        """Answer what has come; a board hears nothing else."""
        try:
            asked, sender = self._socket.recvfrom(datagram.ASK_SIZE + 1)
        except OSError:
            return b""
        now = time.monotonic()
        if self._speaker is not None and now - self._spoke < _ALIVE:
            answer = self._speaker.answer(asked, sender, round(1e3 * now))
            if answer is not None:
                self._say(answer, sender)
        return b""

    def write(self, data: bytes) -> int:
        """Send whole frames; a greeting is kept for whoever asks."""
        now = time.monotonic()
        self._spoke = now
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
                    self._say(signed, self._speaker.listener)
        return len(data)

    @property
    def taken(self) -> bool:
        """Always: whoever asks is sent frames."""
        return True

    def clear(self) -> None:
        """Nothing: what was sent is on its way."""

    def close(self) -> None:
        """Let the port go."""
        self._socket.close()

    def _begin(self, hello: bytes, boot: int) -> None:
        if boot != self._boot:
            size = frame.SAMPLE_FRAME_SIZE
            self._speaker = datagram.Speaker(self._signer, boot, hello, size)
            self._boot = boot

    def _say(self, data: bytes | bytearray, receiver: Any) -> None:
        try:
            self._socket.sendto(data, receiver)
        except OSError:
            return
