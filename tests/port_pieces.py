"""A port made of given bytes."""

from __future__ import annotations

from dynamixel_bus.port import PortError


class Pieces:
    """A port that gives what is put into it, or fails."""

    def __init__(self, data: bytes = b"") -> None:
        self.data, self.wrote, self.out = data, b"", False

    def read(self, most: int, timeout: float) -> bytes:
        self._check()
        came, self.data = self.data[:most], self.data[most:]
        return came

    def write(self, data: bytes) -> None:
        self._check()
        self.wrote += data

    def drain(self) -> int:
        return len(self.read(1 << 20, 0.0))

    def close(self) -> None:
        self.out = True

    def _check(self) -> None:
        if self.out:
            raise PortError("the cable is out")
