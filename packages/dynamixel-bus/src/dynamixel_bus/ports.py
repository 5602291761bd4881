"""Ports that a master opens: a serial line and a TCP connection."""

from __future__ import annotations

import select
import socket
import termios
from contextlib import AbstractContextManager
from typing import Any

from dynamixel_bus.errors import MissingPackageError
from dynamixel_bus.port import Port, PortError, port_errors

_SERIAL_FAILURES = (OSError, TypeError, ValueError, termios.error)
"""What pyserial raises; it lets some through as they are."""
_OPENING_TIME = 3.0
"""Longest wait for a connection [s]: a lost packet of the handshake is sent again after 1 and 3
s."""
_WRITING_TIME = 0.1
"""Longest wait until all is sent [s], as of a serial line: 1 kB at 115 200 bit/s (assumed)."""


class SerialPort(Port):
    """A serial line, by its device file and bits per second, that no other program may open.

    DTR and RTS are both on, as Linux leaves them when a line is opened.

    Raises:
        PortError: It cannot be opened, or another program holds it.
        MissingPackageError: pyserial is not installed.
    """

    def __init__(self, path: str, baud: int) -> None:
        try:
            import serial
        except ModuleNotFoundError as error:
            raise MissingPackageError(
                f"expected pyserial for serial lines, found no module {error.name}; install it by "
                "`pip install pyserial`, the extra `serial` of dynamixel-bus"
            ) from None
        self._path = path
        with self._mapped("open"):
            line: Any = serial.Serial(baudrate=baud, timeout=0, write_timeout=0.1, exclusive=True)
            line.dtr = line.rts = True
            line.port = path
            line.open()
            self._line = line

    def write(self, data: bytes) -> None:
        """Send all of it."""
        with self._mapped("write to"):
            sent = self._line.write(data)
        if sent != len(data):
            raise PortError(f"{self._path}: expected to send {len(data)} bytes, sent {sent}")

    def read(self, most: int, timeout: float) -> bytes:
        """What has come, empty if nothing comes within `timeout` [s]."""
        with self._mapped("read from"):
            self._line.timeout = max(timeout, 0.0)
            first = self._line.read(1)
            if not first or most == 1:
                return first
            self._line.timeout = 0
            return first + self._line.read(most - 1)

    def close(self) -> None:
        """Let it go."""
        with self._mapped("close"):
            self._line.close()

    def _mapped(self, what: str) -> AbstractContextManager[None]:
        return port_errors(f"{what} {self._path}", *_SERIAL_FAILURES)


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
