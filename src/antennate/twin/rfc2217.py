"""A TCP port that is a serial line with speed and modem lines, by RFC 2217; pyserial's protocol.

A client opens rfc2217://HOST:PORT, as pyserial's `serial_for_url` and esptool do. Linux switches
DTR and RTS on in one step when a line is opened and off when it is closed, and so does this end for
a client that comes or goes.
"""

from __future__ import annotations

import socket
import struct
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

from antennate.errors import MissingPackageError
from antennate.messages import extra
from antennate.twin.tcp import TcpEndpoint

_LONGEST = 64
"""Most bytes of a command that has no end: those of RFC 2217 for settings have six."""
_NONSENSE = (TypeError, ValueError, KeyError, struct.error)
"""What pyserial raises upon commands that are none."""


class _Line:
    """What pyserial takes for the serial line: settings, of which the speed and two lines act.

    Args:
        on_lines: Told DTR and RTS when one of them has changed.
    """

    bytesize, parity, stopbits, xonxoff, rtscts, break_condition = 8, "N", 1, False, False, False
    cts = dsr = cd = True
    ri = False

    def __init__(self, on_lines: Callable[[bool, bool], None]) -> None:
        self.baudrate = 0
        self._on_lines = on_lines
        self._dtr = self._rts = False

    @property
    def dtr(self) -> bool:
        """Data Terminal Ready."""
        return self._dtr

    @dtr.setter
    def dtr(self, on: bool) -> None:
        self.set_lines(on, self._rts)

    @property
    def rts(self) -> bool:
        """Request To Send."""
        return self._rts

    @rts.setter
    def rts(self, on: bool) -> None:
        self.set_lines(self._dtr, on)

    def set_lines(self, dtr: bool, rts: bool) -> None:
        """Both in one step."""
        if (dtr, rts) != (self._dtr, self._rts):
            self._dtr, self._rts = dtr, rts
            self._on_lines(dtr, rts)

    def reset_input_buffer(self) -> None:
        """There is none."""

    def reset_output_buffer(self) -> None:
        """There is none."""


class Rfc2217Endpoint(TcpEndpoint):
    """Listens on a port for one client at a time.

    Args:
        host: Address to listen on; only this one.
        port: TCP port, 0 for any that is free.
        on_lines: Told DTR and RTS when one of them has changed.

    Raises:
        BadInputError: The port cannot be had.
        MissingPackageError: pyserial is not installed.
    """

    flag, scheme = "--rfc2217", "rfc2217"

    def __init__(
        self, host: str, port: int, on_lines: Callable[[bool, bool], None] = lambda dtr, rts: None
    ) -> None:
        try:
            from serial.rfc2217 import PortManager
        except ModuleNotFoundError as error:
            raise MissingPackageError(
                f"--rfc2217: expected pyserial, found no module {error.name}; install it with "
                f"{extra('hardware')}"
            ) from None
        super().__init__(host, port)
        self._make: Callable[..., Any] = PortManager
        self._line = _Line(on_lines)
        self._manager: Any = None

    def baud(self) -> int | None:
        """Bits per second that the client has set, None if it has set none."""
        return self._line.baudrate or None

    def write(self, data: bytes) -> None:
        """Send all of it, or nothing where there is no room because nobody reads."""
        if self._manager is not None:
            super().write(b"".join(self._manager.escape(data)))

    def _begin(self) -> None:
        self._line.baudrate = 0
        self._line.set_lines(True, True)
        self._manager = self._make(self._line, SimpleNamespace(write=super().write))

    def _receive(self, client: socket.socket) -> bytes:
        came = super()._receive(client)
        try:
            data = b"".join(self._manager.filter(came)) if came else b""
        except _NONSENSE:
            self._part(client)
            return b""
        if len(self._manager.suboption or b"") > _LONGEST:
            self._part(client)
        return data

    def _part(self, client: socket.socket) -> None:
        super()._part(client)
        self._line.set_lines(False, False)
