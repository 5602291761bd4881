"""Every usable reading of a board, in order: what measuring needs and the control loop does not."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from antennate.hardware.esp32.clock import Timed
from antennate.hardware.esp32.listener import CHUNK, Listener
from antennate.hardware.ports.port import Port


@dataclass(frozen=True, slots=True)
class Reading:
    """One usable sample.

    Attributes:
        timed: The sample and the board's time.
        now: Host's time at which it arrived [s].
    """

    timed: Timed
    now: float


class Stream(Listener):
    """Reads a board's port, and waits for what comes.

    Args:
        port: Its wire.
        now: Monotonic time [s].
    """

    def __init__(self, port: Port, now: Callable[[], float]) -> None:
        super().__init__()
        self._port = port
        self._now = now

    def take(self, timeout: float) -> list[Reading]:
        """Readings that have come, or come within `timeout` [s].

        Raises:
            PortError: The port is gone.
        """
        data = self._port.read(CHUNK, timeout)
        now = self._now()
        return [Reading(timed, now) for timed in self.hear(data, now)]
