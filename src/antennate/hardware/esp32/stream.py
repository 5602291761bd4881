"""Every usable reading of a board, in order: what measuring needs and the control loop does not."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from antennate.hardware.esp32.clock import DeviceClock, Timed, Verdict
from antennate.hardware.esp32.decoder import FrameDecoder
from antennate.hardware.esp32.wire import Hello, Sample, objections
from antennate.hardware.ports.port import Port

_CHUNK = 4096


@dataclass(frozen=True, slots=True)
class Reading:
    """One usable sample.

    Attributes:
        timed: The sample and the board's time.
        now: Host's time at which it arrived [s].
    """

    timed: Timed
    now: float


class Stream:
    """Reads a board's port.

    Args:
        port: Its wire.
        now: Monotonic time [s].

    Attributes:
        decoder: With the counters of its bytes.
        clock: With the verdicts on its samples.
        hello: Its newest greeting, None before the first.
        refusals: Boards and frames refused since the beginning, each reason once.
    """

    def __init__(self, port: Port, now: Callable[[], float]) -> None:
        self.decoder = FrameDecoder()
        self.clock = DeviceClock()
        self.hello: Hello | None = None
        self.refusals: list[str] = []
        self._port = port
        self._now = now

    def take(self, timeout: float) -> list[Reading]:
        """Readings that have come, or come within `timeout` [s]."""
        data = self._port.read(_CHUNK, timeout)
        now, readings = self._now(), list[Reading]()
        for frame in self.decoder.feed(data):
            if isinstance(frame, Hello):
                self._greet(frame)
            elif not isinstance(frame, Sample):
                self._refuse(frame.reason)
            elif self.clock.take(frame, now) is Verdict.USED and self.clock.newest is not None:
                readings.append(Reading(self.clock.newest, now))
        return readings

    def _greet(self, hello: Hello) -> None:
        """Take a greeting; of a board that is refused no sample is ever used."""
        self.hello = hello
        if found := objections(hello):
            self._refuse(*found)
            return
        self.clock.greet(hello)

    def _refuse(self, *reasons: str) -> None:
        self.refusals += [reason for reason in reasons if reason not in self.refusals]
