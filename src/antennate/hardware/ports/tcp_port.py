"""A TCP connection as a Port, such as a twin on another machine serves."""

from __future__ import annotations

import select
import socket
from contextlib import AbstractContextManager

from antennate.port import Port, PortError, port_errors

_OPENING_TIME = 3.0
"""Longest wait for a connection [s]: a lost packet of the handshake is sent again after 1 and 3
s."""
_WRITING_TIME = 0.1
"""Longest wait until all is sent [s], as of a serial line: 1 kB at 115 200 bit/s (assumed)."""


class TcpPort(Port):
    """A connection without delays of its own (TCP_NODELAY).

    Raises:
        PortError: Nobody listens there.
    """

    def __init__(self, host: str, port: int) -> None:
        self._where = f"tcp://{host}:{port}"
        with self._mapped("open"):
            self._line = socket.create_connection((host, port), timeout=_OPENING_TIME)
            self._line.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._line.settimeout(_WRITING_TIME)

    def write(self, data: bytes) -> None:
        """Send all of it."""
        with self._mapped("write to"):
            self._line.sendall(data)

    def read(self, most: int, timeout: float) -> bytes:
        """What has come, empty if nothing comes within `timeout` [s]."""
        with self._mapped("read from"):
            if not select.select([self._line], [], [], max(timeout, 0.0))[0]:
                return b""
            if data := self._line.recv(most):
                return data
        raise PortError(f"{self._where}: the other end has closed, or serves another client")

    def close(self) -> None:
        """Let it go."""
        self._line.close()

    def _mapped(self, what: str) -> AbstractContextManager[None]:
        return port_errors(f"{what} {self._where}", OSError, ValueError)
