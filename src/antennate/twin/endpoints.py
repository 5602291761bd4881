"""The twin's endpoints of its wires, and the pseudo-terminal as one of them."""

from __future__ import annotations

import contextlib
import os
import termios
import tty
from typing import Protocol

from antennate.twin import serial_speed

_CHUNK = 4096


class Endpoint(Protocol):
    """The twin's side of a wire; `select` takes it."""

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
        serial_speed.unset(self._slave)
        os.set_blocking(self._master, False)
        self.path = os.ttyname(self._slave)

    def baud(self) -> int | None:
        """Bits per second that the client has set, None if it has set none."""
        return serial_speed.speed(self._slave)

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
