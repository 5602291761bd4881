"""Master and virtual servos in one invented time, which passes while the master waits."""

from __future__ import annotations

from dynamixel_bus.port import Port
from dynamixel_bus.servo_bus import ServoBus

_ROUNDING = 1e-9
"""Times that differ by less are one [s]."""


class SimulatedWire(Port):
    """A port of a master on the wire of virtual servos, and the clock of both.

    Args:
        bus: The servos.
        latency: Time by which the adapter delivers late [s].
        t: The time at first [s].
    """

    def __init__(self, bus: ServoBus, latency: float = 0.0, t: float = 0.0) -> None:
        self.bus = bus
        self.latency = latency
        self._t = t
        self._came = b""

    def now(self) -> float:
        """The time [s]."""
        return self._t

    def sleep(self, seconds: float) -> None:
        """Let time pass."""
        self._until(self._t + seconds)

    def sleep_until(self, t: float) -> None:
        """Let time pass until t [s], if it has not yet."""
        if t > self._t:
            self._until(t)

    def write(self, data: bytes) -> None:
        """Send; takes no time, the wire does."""
        self.bus.receive(self._t, data)

    def read(self, most: int, timeout: float) -> bytes:
        """Bytes that have come by now, or first come within `timeout` [s]."""
        end = self._t + timeout
        self._collect()
        while not self._came and self._t < end:
            due = self.bus.next_time()
            self._until(end if due is None else max(self._t, min(due + self.latency, end)))
        came, self._came = self._came[:most], self._came[most:]
        return came

    def drain(self) -> int:
        """Throw away the bytes that have come; how many."""
        self._collect()
        count, self._came = len(self._came), b""
        return count

    def move(self, t: float) -> None:
        """Let the servos move until t [s]; a subclass may move what hangs on them."""
        self.bus.advance(t)

    def _until(self, t: float) -> None:
        self.move(t)
        self._t = t
        self._collect()

    def _collect(self) -> None:
        self._came += self.bus.transmit(self._t - self.latency + _ROUNDING)
