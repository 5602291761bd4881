"""What a servo may answer, what is asked of it, and how long it may take."""

from __future__ import annotations

from dataclasses import dataclass, replace

from antennate.hardware.dynamixel.packets import OVERHEAD, Status, StatusError


@dataclass(frozen=True, slots=True)
class Value:
    """A servo answered with the bytes asked for; `alert` if it reports a hardware error too."""

    data: bytes
    alert: bool


@dataclass(frozen=True, slots=True)
class Refused:
    """A servo answered why it cannot; `alert` if it reports a hardware error too."""

    error: StatusError
    alert: bool


@dataclass(frozen=True, slots=True)
class Silent:
    """No right answer came in time."""


Answer = Value | Refused | Silent
SILENT = Silent()


@dataclass(frozen=True, slots=True)
class Span:
    """Bytes of the control table to read, from an address on.

    `spare` more bytes may be read too, to tell new answers from late ones.
    """

    address: int
    length: int
    spare: int = 0


MOTION = Span(126, 10, spare=12)
"""Load or current (2 bytes), velocity (4) and position (4) of both models; up to 147 all is
defined, so that more may be read."""
POSITION = Span(132, 4, spare=12)
"""The position of both models."""
_GAP = 0.002
"""The 1 ms of a USB adapter and as much again [s] (assumed)."""


@dataclass(frozen=True, slots=True)
class Timing:
    """What the bus may take.

    Attributes:
        baud: Bits per second; a byte is ten bits.
        gap: Longest silence inside an answer or before it, beyond the time on the wire [s]; more
            than the return delay of the servos and the latency of the adapter.
        quiet: Silence after which nothing more is expected [s].
        latest: An answer later than this never comes [s]: six times the 16 ms of a slow adapter
            (assumed).
    """

    baud: int = 1_000_000
    gap: float = _GAP
    quiet: float = _GAP
    latest: float = 0.1

    def wire(self, count: int) -> float:
        """Time of so many bytes on the wire [s]."""
        return 10.0 * count / self.baud

    def answer(self, length: int) -> float:
        """Longest time to an answer with so many bytes of data, or between two [s]."""
        return self.wire(OVERHEAD + length) + self.gap


def answer(status: Status) -> Answer:
    """What a status packet says."""
    if status.error != StatusError.NONE:
        return Refused(status.error, status.alert)
    return Value(status.data, status.alert)


def cut(answers: dict[int, Answer], length: int) -> dict[int, Answer]:
    """The answers with no more data than was wanted."""
    return {
        servo: replace(reply, data=reply.data[:length]) if isinstance(reply, Value) else reply
        for servo, reply in answers.items()
    }
