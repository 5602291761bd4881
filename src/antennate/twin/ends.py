"""The twin's ends of its wires, and the pseudo-terminal as one of them."""

from __future__ import annotations

import os
import termios
import tty
from typing import Protocol

from antennate.hardware.dynamixel.tables import BAUD_RATES

_CHUNK = 4096
_SPEEDS: dict[int, int] = {
    getattr(termios, f"B{baud}"): baud for baud in BAUD_RATES if hasattr(termios, f"B{baud}")
}


class End(Protocol):
    """The twin's end of a wire; `select` takes it."""

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
        """What has come."""
        ...

    def write(self, data: bytes) -> int:
        """Say it; what finds no room is lost. How many bytes found room."""
        ...

    @property
    def taken(self) -> bool:
        """Somebody has opened it, as far as that can be known."""
        ...

    def clear(self) -> None:
        """Throw away what was said and nobody has read, where that can be done."""
        ...

    def close(self) -> None:
        """Let it go."""
        ...


class Terminal:
    """One pseudo-terminal; whoever opens `path` talks to us."""

    def __init__(self) -> None:
        self._master, self._slave = os.openpty()
        tty.setraw(self._slave, termios.TCSANOW)
        os.set_blocking(self._master, False)
        self.path = os.ttyname(self._slave)

    def baud(self) -> int | None:
        """Bits per second that the client has set, None if it is none of the usual ones."""
        return _SPEEDS.get(termios.tcgetattr(self._slave)[5])

    def fileno(self) -> int:
        """Of our end."""
        return self._master

    def read(self) -> bytes:
        """What has come."""
        try:
            return os.read(self._master, _CHUNK)
        except BlockingIOError:
            return b""

    def write(self, data: bytes) -> int:
        """Say it; what finds no room because nobody listens is lost, as on a real line."""
        try:
            return os.write(self._master, data)
        except BlockingIOError:
            return 0

    @property
    def taken(self) -> bool:
        """Always: what is said waits for whoever opens it."""
        return True

    def clear(self) -> None:
        """Throw away what was said and nobody has read."""
        termios.tcflush(self._slave, termios.TCIFLUSH)

    def close(self) -> None:
        """Both ends."""
        os.close(self._master)
        os.close(self._slave)
