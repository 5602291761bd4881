"""What comes back on the wire: answers of servos, answers that are late, and echoes of requests.

Nothing in the protocol says to which request an answer belongs. For each id the lengths of its
unanswered requests are kept, so that the next one can ask for another length.

The bus has one wire for both ways. An adapter whose receiver stays on while it sends gives the
master each of its own packets. They are safe to drop: only a whole request, byte for byte as it was
sent, is taken for an echo, and none can be an answer, whose instruction byte is 0x55.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

from dynamixel_bus import packets
from dynamixel_bus.packets import OVERHEAD, Packet, Status, StatusError


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
"""Load or current (2 bytes), velocity (4) and position (4) of all models; up to 147 all is
defined, so that more may be read."""
POSITION = Span(132, 4, spare=12)
"""The position of all models."""
DRIVE = Span(124, 12, spare=12)
"""PWM (2 bytes), load or current, velocity and position of all models."""
_MOST_ECHOES = 8
"""Requests whose echo may still come: more than are sent before the master reads again."""
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


def fitting(packet: Packet, length: int, late: set[int]) -> Status | None:
    """The status in a packet, if it can be the answer to a request for so many bytes.

    `late` are ids whose late answers may still come: a refusal of theirs may be to the last one.
    """
    status = packets.as_status(packet)
    if status is None:
        return None
    refused = status.error != StatusError.NONE and not status.data
    if refused and length > 0 and status.id in late:
        return None
    return status if refused or len(status.data) == length else None


def cut(answers: dict[int, Answer], length: int) -> dict[int, Answer]:
    """The answers with no more data than was wanted."""
    return {
        servo: replace(reply, data=reply.data[:length]) if isinstance(reply, Value) else reply
        for servo, reply in answers.items()
    }


class PendingRequests:
    """For each id the lengths of its unanswered requests, each until its answer never comes [s]."""

    def __init__(self, patience: float, clock: Callable[[], float]) -> None:
        self._patience, self._clock = patience, clock
        self._until: dict[int, dict[int, float]] = {}

    def open(self, ids: Iterable[int], length: int) -> None:
        """These are about to be asked for so many bytes."""
        until = self._clock() + self._patience
        for servo in ids:
            self._until.setdefault(servo, {})[length] = until

    def close(self, ids: Iterable[int], length: int) -> None:
        """These have answered with so many bytes."""
        for servo in ids:
            self._until.get(servo, {}).pop(length, None)

    def holds(self, servo: int) -> bool:
        """A late answer of this servo may still come."""
        return bool(self._lengths(servo))

    def free(self, ids: Sequence[int], span: Span) -> int | None:
        """The shortest length that no late answer of these has; None if there is none."""
        lengths = {length for servo in ids for length in self._lengths(servo)}
        allowed = range(span.length, span.length + span.spare + 1)
        return next((length for length in allowed if length not in lengths), None)

    def longest(self) -> float:
        """Time until nothing late can come from anybody [s]."""
        latest = max((t for old in self._until.values() for t in old.values()), default=0.0)
        return latest - self._clock()

    def _lengths(self, servo: int) -> list[int]:
        now = self._clock()
        old = self._until.get(servo, {})
        for length in [length for length, until in old.items() if until <= now]:
            del old[length]
        return list(old)


class Echo:
    """Takes echoes out of what comes.

    Attributes:
        requests: Requests that came back so far.
    """

    def __init__(self) -> None:
        self.requests = 0
        self._sent: deque[bytes] = deque(maxlen=_MOST_ECHOES)
        self._begun = b""

    def expect(self, request: bytes) -> None:
        """This is about to be sent."""
        self._sent.append(request)

    def remove(self, data: bytes) -> bytes:
        """The rest of these bytes; what may be the beginning of an echo waits for the next ones."""
        data, self._begun = self._begun + data, b""
        while self._sent and data:
            request = self._sent[0]
            if request.startswith(data) and len(data) < len(request):
                self._begun, data = data, b""
                break
            self._sent.popleft()
            if data.startswith(request):
                self.requests += 1
                data = data[len(request) :]
        return data
