"""An antenna board on the network as a Port; only what it signed for this connection comes in."""

from __future__ import annotations

import errno
import os
import select
import socket
import time
from collections.abc import Callable

from antennate.errors import reason
from antennate.hardware.esp32.verifier import Bucket, Verifier
from antennate.params.hardware import NetworkParams
from antennate.port import Port, PortError

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

    Raises:
        PortError: The host is not known.
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
        found = bytearray()
        while self._looks.take(now):
            data = self._receive()
            if data is None:
                break
            frame, again = self._verifier.take(data, now)
            found += frame
            if again:
                self._send(self._verifier.ask())
        return bytes(found)

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
