"""The servers' ends of a wire: a pseudo-terminal, a TCP port, and one with speed and modem lines.

An RFC 2217 port is a TCP port that is a serial line: a client opens rfc2217://HOST:PORT, as
pyserial's `serial_for_url` and esptool do. Linux switches DTR and RTS on in one step when a line is
opened and off when it is closed, and so does this end for a client that comes or goes.
"""

from __future__ import annotations

import contextlib
import fcntl
import os
import selectors
import socket
import struct
import termios
import tty
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any, Protocol

from antennate.errors import BadInputError, MissingPackageError
from antennate.messages import extra

_CHUNK = 4096
_LAYOUT = "=4IB19B2I"
"""Linux's `struct termios2`: four flags, line, control characters, input and output speed."""
_GET = 0x802C542A
"""Linux's TCGETS2, which also tells speeds that have no name."""
_NAMED = {
    value: int(name[1:])
    for name, value in vars(termios).items()
    if name[0] == "B" and name[1:].isdigit()
}
_LONGEST = 64
"""Most bytes of a command that has no end: those of RFC 2217 for settings have six."""
_BAD_COMMAND = (TypeError, ValueError, KeyError, struct.error)
"""What pyserial raises upon commands that are none."""


class Endpoint(Protocol):
    """The server's side of a wire; `select` takes it."""

    @property
    def path(self) -> str:
        """What a client opens."""
        ...

    def fileno(self) -> int:
        """Ready to be read when something has come."""
        ...

    def baud(self) -> int | None:
        """Bits per second that the client has set, None if there is no such thing."""
        ...

    def read(self) -> bytes:
        """Bytes that have come."""
        ...

    def write(self, data: bytes) -> None:
        """Send; bytes that find no room are lost."""
        ...

    def close(self) -> None:
        """Close it."""
        ...


class Terminal:
    """One pseudo-terminal; a client opens `path`."""

    def __init__(self) -> None:
        self._master, self._slave = os.openpty()
        tty.setraw(self._slave, termios.TCSANOW)
        _unset_speed(self._slave)
        os.set_blocking(self._master, False)
        self.path = os.ttyname(self._slave)

    def baud(self) -> int | None:
        """Bits per second that the client has set, None if it has set none."""
        return _speed(self._slave)

    def fileno(self) -> int:
        """File descriptor of our side."""
        return self._master

    def read(self) -> bytes:
        """Bytes that have come."""
        try:
            return os.read(self._master, _CHUNK)
        except BlockingIOError:
            return b""

    def write(self, data: bytes) -> None:
        """Send; bytes that find no room because nobody reads are lost, as on a real line."""
        with contextlib.suppress(BlockingIOError):
            os.write(self._master, data)

    def close(self) -> None:
        """Close both sides."""
        os.close(self._master)
        os.close(self._slave)


def _unset_speed(terminal: int) -> None:
    """Mark the speed of a terminal as one that nobody has set: 50 bit/s."""
    mode = termios.tcgetattr(terminal)
    mode[4] = mode[5] = termios.B50
    termios.tcsetattr(terminal, termios.TCSANOW, mode)


def _speed(terminal: int) -> int | None:
    """Bits per second, None while nobody has set it."""
    try:
        answer = fcntl.ioctl(terminal, _GET, bytes(struct.calcsize(_LAYOUT)))
        baud = struct.unpack(_LAYOUT, answer)[-1]
    except OSError:  # not Linux, or not this kind of it
        baud = _NAMED.get(termios.tcgetattr(terminal)[5], 0)
    return None if baud == 50 else baud


class TcpEndpoint:
    """Listens on a port; a client connects to `path`.

    Args:
        host: Address to listen on; only this one.
        port: TCP port, 0 for any that is free.

    Raises:
        BadInputError: The port cannot be had.
    """

    flag, scheme = "--tcp", "tcp"

    def __init__(self, host: str, port: int) -> None:
        try:
            self._listener = socket.create_server((host, port), backlog=4)
        except OSError as error:
            raise BadInputError(
                f"{self.flag}: expected a free port, found {host}:{port}: {error}"
            ) from None
        self._listener.setblocking(False)
        self._client: socket.socket | None = None
        self._unsent = b""
        self._ready = selectors.DefaultSelector()
        self._ready.register(self._listener, selectors.EVENT_READ)
        self.path = f"{self.scheme}://{host}:{self._listener.getsockname()[1]}"

    def fileno(self) -> int:
        """Ready to be read if a client comes, sends or goes."""
        return self._ready.fileno()

    def baud(self) -> int | None:
        """There is none."""
        return None

    def read(self) -> bytes:
        """Bytes that have come."""
        came = b"" if self._client is None else self._receive(self._client)
        try:
            client, _ = self._listener.accept()
        except OSError:  # nobody, or somebody who is gone already
            return came
        if self._client is not None:
            client.close()
            return came
        client.setblocking(False)
        client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._client, self._unsent = client, b""
        self._ready.register(client, selectors.EVENT_READ)
        self._begin()
        return came

    def write(self, data: bytes) -> None:
        """Send all of it, or nothing where there is no room because nobody reads."""
        if self._client is None:
            return
        try:
            if self._unsent:
                self._unsent = self._unsent[self._client.send(self._unsent) :]
            if not self._unsent:
                self._unsent = data[self._client.send(data) :]
        except BlockingIOError:
            return
        except OSError:
            self._part(self._client)

    def close(self) -> None:
        """Close client and listener."""
        if self._client is not None:
            self._part(self._client)
        self._ready.close()
        self._listener.close()

    def _begin(self) -> None:
        """A client has come."""

    def _receive(self, client: socket.socket) -> bytes:
        try:
            if data := client.recv(_CHUNK):
                return data
        except BlockingIOError:
            return b""
        except OSError:
            pass
        self._part(client)
        return b""

    def _part(self, client: socket.socket) -> None:
        if client is not self._client:
            return
        self._ready.unregister(client)
        client.close()
        self._client = None


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
        except _BAD_COMMAND:
            self._part(client)
            return b""
        if len(self._manager.suboption or b"") > _LONGEST:
            self._part(client)
        return data

    def _part(self, client: socket.socket) -> None:
        super()._part(client)
        self._line.set_lines(False, False)
