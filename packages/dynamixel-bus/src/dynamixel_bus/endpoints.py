"""The servers' ends of a wire: a pseudo-terminal and a TCP port."""

from __future__ import annotations

import contextlib
import fcntl
import os
import selectors
import socket
import struct
import termios
import tty
from typing import Protocol

from dynamixel_bus.errors import BadInputError

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
    except OSError:  # not this kind of Linux
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

    def __init__(self, host: str, port: int) -> None:
        try:
            self._listener = socket.create_server((host, port), backlog=4)
        except OSError as error:
            raise BadInputError(
                f"--tcp: expected a free port, found {host}:{port}: {error}"
            ) from None
        self._listener.setblocking(False)
        self._client: socket.socket | None = None
        self._unsent = b""
        self._ready = selectors.DefaultSelector()
        self._ready.register(self._listener, selectors.EVENT_READ)
        self.path = f"tcp://{host}:{self._listener.getsockname()[1]}"

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
        self._ready.unregister(client)
        client.close()
        self._client = None
