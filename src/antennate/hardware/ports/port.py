"""What a wire of bytes must be able to do, whatever it is made of."""

from __future__ import annotations

from typing import Protocol

from antennate.errors import AntennateError


class PortError(AntennateError):
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
        ...
