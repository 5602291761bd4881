"""What a wire of bytes must be able to do, whatever it is made of."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from typing import Protocol

from dynamixel_bus.errors import BusError, reason


class PortError(BusError):
    """The wire failed: it is gone, busy, or does not take what is written."""


class Port(Protocol):
    """A wire of bytes. Each method raises PortError if the wire is gone."""

    def write(self, data: bytes) -> None:
        """Send all of it; may return before it has left."""
        ...

    def read(self, most: int, timeout: float) -> bytes:
        """What has come, at most so many bytes; empty if nothing comes within `timeout` [s]."""
        ...

    def drain(self) -> int:
        """Throw away what has come; how many bytes that was."""
        count = 0
        while part := self.read(4096, 0.0):
            count += len(part)
        return count


class Line(Port, Protocol):
    """A port that can be closed."""

    def close(self) -> None:
        """Let it go."""
        ...


@contextlib.contextmanager
def port_errors(what: str, *kinds: type[Exception]) -> Iterator[None]:
    """Raise a PortError, which says what could not be done, for exceptions of these kinds."""
    try:
        yield
    except kinds as error:
        raise PortError(f"could not {what}: {reason(error)}") from error
