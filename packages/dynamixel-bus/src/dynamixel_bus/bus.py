"""The master of a half-duplex bus of DYNAMIXEL servos: every servo answers for itself.

A read of many servos gives a value, an error or silence for each, within a budget of time. The
chain of answers to a group read stops at a silent servo (DynamixelSDK issue 331), and the next ones
are asked anew without it.

Nothing in the protocol says to which request an answer belongs, so late answers are told apart by
what can be told: the id and the length. Each id keeps the lengths of its unanswered requests for
`latest` seconds, and meanwhile it is asked for a length that none of them had (some `spare` bytes
more), or not at all. After trouble the bus is also drained until it was quiet for a while.
Time is monotonic and comes from outside; nothing is kept that an exception could leave wrong.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import wraps
from itertools import islice
from typing import Any, Concatenate, ParamSpec, TypeVar

from dynamixel_bus import packets
from dynamixel_bus.answers import (
    SILENT,
    Answer,
    Echo,
    PendingRequests,
    Span,
    Timing,
    answer,
    cut,
    fitting,
)
from dynamixel_bus.packets import HEADER, OVERHEAD, Status
from dynamixel_bus.parser import Parser
from dynamixel_bus.port import Port, PortError

CHUNK = 1024
_CHUNKS = 64
"""Most chunks thrown away at once: more than Linux keeps for a line."""
PING_DATA = 3
"""Bytes of the answer to a ping: model number and firmware version."""
FAST_TRIES = 3
"""Fast reads without any answer, but answers to a slow one, after which fast ones are given up: at
1 % loss three in a row are one in 10^6 (assumed)."""
KNOWN_TRIES = 100
"""Fast reads without any answer after which they are given up once one was answered: then servos
understand them, and late answers of a second are a busy computer's (assumed)."""
ALONE = 2
"""Misses in a row after which a servo no longer holds up the others; noise loses one (assumed)."""
BUSY = 0.010
"""How long goals wait for a quiet bus [s]: one tick (assumed)."""


P = ParamSpec("P")
R = TypeVar("R")


def exclusive(method: Callable[Concatenate[Any, P], R]) -> Callable[Concatenate[Any, P], R]:
    """A method that waits until no other thread is in one of its kind, by the lock `turn`."""

    @wraps(method)
    def waiting(self: Any, /, *args: P.args, **kwargs: P.kwargs) -> R:
        with self.turn:
            return method(self, *args, **kwargs)

    return waiting


@dataclass(slots=True)
class Tally:
    """What became of the answers of servos.

    Attributes:
        misses: Requests to one of them without a right answer.
        stale: Answers that were right but came too late, and were thrown away.
        drained: Bytes thrown away before a request.
        echoes: Requests that the adapter gave back.
    """

    misses: int = 0
    stale: int = 0
    bad_crc: int = 0
    drained: int = 0
    echoes: int = 0


class Bus:
    """Master of one bus. Threads that share it wait for each other, a whole request long.

    Calls raise PortError if the bus is gone.

    Attributes:
        timing: Speed and patience of the wire.
        fast: Groups are read with fast sync reads, as long as the servos understand them.
        missed: Requests in a row that a servo left unanswered, by id, of those it was asked.
        turn: Held by the thread whose request is on the bus.
    """

    def __init__(
        self,
        port: Port,
        timing: Timing | None = None,
        fast: bool = True,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.timing = timing or Timing()
        self.tally = Tally()
        self.turn = threading.RLock()
        self.fast = fast
        self.missed: dict[int, int] = {}
        self._port, self._clock = port, clock
        self._fast_failures, self._fast_tries = 0, FAST_TRIES
        self._pending = PendingRequests(self.timing.latest, clock)
        self._calm, self._echo = False, Echo()
        self._last_byte = self._sent = clock()

    @exclusive
    def write_all(self, address: int, data: Mapping[int, bytes], anyway: bool = False) -> None:
        """Write equally many bytes to several servos at once; none answers.

        Args:
            address: Of the first byte.
            data: Bytes by id.
            anyway: Write into the noise as well, for what may be written again and again.

        Raises:
            PortError: The bus did not become quiet in time.
        """
        if not self._send(packets.sync_write(address, data), None, anyway):
            raise PortError(f"expected a quiet bus, found it busy for {1e3 * BUSY:g} ms")
        self._calm = True

    @exclusive
    def read_all(self, ids: Sequence[int], span: Span, budget: float = 0.010) -> dict[int, Answer]:
        """Read the same span of several servos.

        A servo at which the chain stops is asked again at its end; one that was silent twice in a
        row is asked alone, after the others. All of it takes at most `budget` [s].

        Returns:
            An answer for each id, in the order of `ids`.
        """
        end = self._clock() + budget
        answers: dict[int, Answer] = dict.fromkeys(ids, SILENT)
        alone = [servo for servo, n in self.missed.items() if n >= ALONE and servo in ids]
        left = sorted(set(ids) - set(alone), key=lambda servo: (servo in self.missed, servo))
        fast, dumb = self.fast, False
        while left and self._time_for(span, len(left), end):
            got = (self._read_fast if fast else self._read_chain)(left, span, end)
            dumb = self._count_fast(fast, dumb, bool(got))
            answers |= got
            left, fast = [servo for servo in left if servo not in got], False
            self._note(got, left[:1])
            again = [servo for servo in left[:1] if self.missed[servo] < ALONE]
            left = left[1:] + again
        for servo in alone:
            if self._time_for(span, 1, end):
                answers[servo] = self._read_one(servo, span, end)
        return answers

    @exclusive
    def read(self, servo: int, span: Span) -> Answer:
        """Read a span of one servo."""
        return self._read_one(servo, span, self._clock() + self.timing.latest)

    @exclusive
    def write(self, servo: int, address: int, data: bytes) -> Answer:
        """Write to one servo and wait for its answer; a Value without data is success."""
        return self._ask(servo, packets.write(servo, address, data), 0)

    @exclusive
    def ping(self, servo: int) -> Answer:
        """Model number (2 bytes, low first) and firmware version of one servo."""
        return self._ask(servo, packets.ping(servo), PING_DATA)

    @exclusive
    def reboot(self, servo: int) -> Answer:
        """Restart one servo; it does not listen for a while after it has answered."""
        return self._ask(servo, packets.reboot(servo), 0)

    @exclusive
    def clear(self, servo: int) -> Answer:
        """Let one servo, standing still, forget its whole turns."""
        return self._ask(servo, packets.clear(servo), 0)

    @exclusive
    def scan(self, window: float = 0.8) -> list[Status]:
        """Answers of all servos to a ping within a time [s], an id twice if it answers twice."""
        self.settle()
        end = self._clock() + window
        self._send(packets.ping(), end)
        parser, statuses = Parser(), list[Status]()
        while self._clock() < end:
            statuses += filter(None, map(packets.as_status, parser.feed(self._listen(window, end))))
        self.tally.bad_crc += parser.counters.bad_crc
        return statuses

    @exclusive
    def settle(self) -> None:
        """Wait until no late answer can come any more and noise is over, at most `latest` [s]."""
        end = self._clock() + self.timing.latest
        while (left := self._pending.longest()) > 0.0:
            self._listen(left, self._clock() + left)
        self._quiet(end)

    # one request and its answers

    def _ask(self, servo: int, request: bytes, length: int) -> Answer:
        if self._pending.holds(servo):
            self.settle()
        end = self._clock() + self.timing.latest
        return self._exchange(request, [servo], length, end).get(servo, SILENT)

    def _read_one(self, servo: int, span: Span, end: float) -> Answer:
        length = self._pending.free([servo], span)
        if length is None:
            return SILENT
        request = packets.read(servo, span.address, length)
        answers = cut(self._exchange(request, [servo], length, end), span.length)
        self._note(answers, [] if answers else [servo])
        return answers.get(servo, SILENT)

    def _read_chain(self, ids: Sequence[int], span: Span, end: float) -> dict[int, Answer]:
        length = self._pending.free(ids, span)
        if length is None:
            return {}
        request = packets.sync_read(ids, span.address, length)
        return cut(self._exchange(request, ids, length, end), span.length)

    def _read_fast(self, ids: Sequence[int], span: Span, end: float) -> dict[int, Answer]:
        length = self._pending.free(ids, span)
        if length is None:
            return {}
        self._pending.open(ids, length)
        if not self._send(packets.fast_sync_read(ids, span.address, length), end):
            return {}
        size = packets.fast_reply_size(len(ids), length)
        received = b""
        wait = self._sent - self._clock() + self.timing.answer(length)
        while part := self._listen(wait, end):
            received += part
            if len(received) - max(received.find(HEADER), 0) >= size:
                break
            wait = self.timing.answer(length)
        statuses = packets.split_fast_reply(received, ids, length)
        good = {status.id: answer(status) for status in statuses}
        self.tally.bad_crc += packets.broken_fast_reply(received, len(ids), length, len(good))
        self._finish(ids, length, good, len(received) == size)
        return cut(good, span.length)

    def _exchange(
        self, request: bytes, ids: Sequence[int], length: int, end: float
    ) -> dict[int, Answer]:
        """Send one request and take the answers to it, each from another servo.

        An answer does not say which request it belongs to. It is taken if it comes from a servo
        that was asked and has as many bytes of data as were asked for; of a servo that may still
        answer an earlier request, a refusal, which has no data, could be to either and is not
        taken. All else is counted as stale. A servo that answers twice is not believed at all: one
        of the two answers is a late one of the same length. The wait ends as soon as all have
        answered, after a silence that is longer than any within a chain of answers, or at `end`
        [s]. What comes back are the right answers by id.
        """
        late = {servo for servo in ids if self._pending.holds(servo)}
        self._pending.open(ids, length)
        if not self._send(request, end):
            return {}
        parser, good, stale = Parser(), dict[int, Answer](), 0
        twice: set[int] = set()
        wait = self._sent - self._clock() + self.timing.answer(length)
        while len(good) < len(ids) and (part := self._listen(wait, end)):
            wait = self.timing.answer(length)
            for packet in parser.feed(part):
                status = fitting(packet, length, late)
                if status and status.id in ids and status.id not in good:
                    good[status.id] = answer(status)
                    continue
                stale += 1
                twice |= {status.id} if status else set()
        good = {servo: reply for servo, reply in good.items() if servo not in twice}
        self.tally.stale += stale
        self.tally.bad_crc += parser.counters.bad_crc
        dirty = stale or parser.pending or parser.counters.skipped_bytes
        self._finish(ids, length, good, not dirty)
        return good

    def _finish(
        self, ids: Sequence[int], length: int, good: Mapping[int, Answer], clean: bool
    ) -> None:
        self._pending.close(good, length)
        missed = len(ids) - len(good)
        self.tally.misses += missed
        self._calm = clean and not missed

    def _note(self, good: Iterable[int], silent: Iterable[int]) -> None:
        for servo in good:
            self.missed.pop(servo, None)
        for servo in silent:
            self.missed[servo] = self.missed.pop(servo, 0) + 1

    def _count_fast(self, fast: bool, dumb: bool, answered: bool) -> bool:
        if fast:
            if answered:
                self._fast_failures, self._fast_tries = 0, KNOWN_TRIES
            return not answered
        if dumb and answered:
            self._fast_failures += 1
            self.fast = self._fast_failures < self._fast_tries
            return False
        return dumb

    # the wire

    def _time_for(self, span: Span, count: int, end: float) -> bool:
        """A first answer would come before the end, unless servos or adapter are slow."""
        wire = self.timing.wire(2 * OVERHEAD + 3 + count + span.length + span.spare)
        return self._clock() + wire + 0.5 * self.timing.gap <= end

    def _send(self, request: bytes, end: float | None, anyway: bool = False) -> bool:
        """Send once the bus is known to be quiet; False, unless `anyway`, if `_quiet` says no."""
        calm, self._calm = self._calm, False
        dropped = self._drain()
        self.tally.drained += dropped
        if dropped:
            self._last_byte = self._clock()
        if (dropped or not calm) and not self._quiet(end) and not anyway:
            return False
        self._echo.expect(request)
        self._port.write(request)
        self._sent = max(self._sent, self._clock()) + self.timing.wire(len(request))
        return True

    def _quiet(self, end: float | None) -> bool:
        """Whether nothing has come for a while, by `end` [s].

        None lets the bus be busy for BUSY. Time for which the process did not run does not count
        then: the bytes that came meanwhile are all there when it runs again, and may be the last.
        """
        until = self._clock() + BUSY if end is None else end
        while True:
            now = self._clock()
            left = max(self._last_byte, self._sent) + self.timing.quiet - now
            if left <= 0.0 or now >= until:
                return left <= 0.0
            self.tally.drained += len(self._listen(left, until))
            if end is None:
                until += max(self._clock() - now - left, 0.0)

    def _drain(self) -> int:
        """Throw away what has come; how many bytes that was without echoes."""
        if not self._echo.requests:
            return self._port.drain()
        parts = iter(lambda: self._port.read(CHUNK, 0.0), b"")
        return sum(len(self._without_echo(part)) for part in islice(parts, _CHUNKS))

    def _listen(self, timeout: float, end: float) -> bytes:
        """What comes within a time [s] and is no echo."""
        end = min(end, self._clock() + timeout)
        while part := self._port.read(CHUNK, max(end - self._clock(), 0.0)):
            if part := self._without_echo(part):
                self._last_byte = self._clock()
                return part
        return b""

    def _without_echo(self, part: bytes) -> bytes:
        rest = self._echo.remove(part)
        self.tally.echoes = self._echo.requests
        return rest
