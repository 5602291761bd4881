"""What an antenna board says: bytes in, its usable samples out, and never those of another one."""

from __future__ import annotations

from antennate.hardware.esp32.clock import DeviceClock, Timed, Verdict
from antennate.hardware.esp32.decoder import FrameDecoder
from antennate.hardware.esp32.wire import Hello, Sample, objections

CHUNK = 4096
"""Most bytes that are read from a port at once."""
_REFUSALS = 8


class Listener:
    """Listens to one board, always the one that greeted first.

    Attributes:
        decoder: With the counters of its bytes.
        clock: With the verdicts on its samples.
        hello: The newest greeting, None before the first; of a board that is refused no sample is
            ever used.
        refusals: Why boards or frames were refused: each reason once, newest last, at most 8.
    """

    def __init__(self) -> None:
        self.decoder = FrameDecoder()
        self.clock = DeviceClock()
        self.hello: Hello | None = None
        self.refusals: list[str] = []
        self._first: Hello | None = None

    def hear(self, data: bytes, now: float) -> list[Timed]:
        """Usable samples in bytes that have come by now [s]."""
        used: list[Timed] = []
        for frame in self.decoder.feed(data):
            if isinstance(frame, Hello):
                self._greet(frame)
            elif not isinstance(frame, Sample):
                self._refuse(frame.reason)
            elif self.clock.take(frame, now) is Verdict.USED and self.clock.newest is not None:
                used.append(self.clock.newest)
        return used

    def _greet(self, hello: Hello) -> None:
        self.hello = hello
        if reasons := self._objections(hello):
            self._refuse(*reasons)
            return
        self._first = self._first or hello
        self.clock.greet(hello)

    def _refuse(self, *reasons: str) -> None:
        others = [reason for reason in self.refusals if reason not in reasons]
        self.refusals = [*others, *reasons][-_REFUSALS:]

    def _objections(self, hello: Hello) -> tuple[str, ...]:
        """What speaks against a board, also that it is not the one that greeted first."""
        first = self._first
        if first is None:
            return objections(hello)
        if hello.device_id != first.device_id:
            return (
                f"expected the board {first.device_id} that greeted first, found another one, "
                f"{hello.device_id}; begin anew with it",
            )
        return objections(hello, first.config_hash)
