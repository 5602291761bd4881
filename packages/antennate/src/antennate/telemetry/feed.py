"""Ticks on their way to another process, which keeps and shows them; the loop never waits for it.

A message is the content of a record behind its length and how many were dropped before it. The
loop writes it to a pipe without waiting. What does not fit, as while the other process starts on a
busy machine, is kept here and follows with the next ticks; beyond `_WAITING` it is dropped and
counted. The content of no bytes says that the loop has ended in order; a pipe that closes without
it means that the loop was killed.
"""

from __future__ import annotations

import contextlib
import fcntl
import math
import os
import select
import struct
import subprocess
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from select import PIPE_BUF
from typing import BinaryIO, NamedTuple

from antennate.errors import LogError
from antennate.messages import ended_by, one_line

_HEAD = struct.Struct("<II")
_ROOM = 1 << 20
"""Bytes that the pipe may hold, whole ticks to each page of 4096: 17 s of ticks of 0.55 kB, 7 s of
the longest, which have 1.2 kB with their causes."""
_WAITING = 3000
"""Most ticks that wait for room in the pipe: 30 s at 100 Hz, as long as a start may take."""
_AT_ONCE = 16
"""Most of them that go to the pipe with one tick, so that the loop is not held up."""
_PATIENCE = 5.0
"""Time for the other process to write the last ticks to a slow disk under load [s]; assumed."""
_STARTING = 30.0
"""Time for it to begin at all, if it has not yet [s]: its imports on a busy machine; assumed."""
KEPT, NOT_KEPT = b"k", b"n"
"""What the other process says once it takes messages: whether it keeps them."""
RESTARTS = 3
"""Processes that may follow the first; a defect that more of them meet is not cured (assumed)."""
_POLL = 0.02
_LONGEST = 1 << 17
_IDLE = 0.05
"""Time without a message after which the taker may do something else [s]."""


class Message(NamedTuple):
    """One message: the content of a record, and the ticks dropped so far."""

    content: bytes
    dropped: int


class Feed:
    """The sending end; as a context it starts the other process and waits for its end.

    A process that dies is followed by a new one, which gets the first message and what is sent
    from then on. A thread of its own looks after that, so that the loop never waits for it.

    Args:
        words: The command line of the n-th process, 1 the first. It reads messages from its
            standard input, and writes `KEPT` or `NOT_KEPT` to its standard output once it takes
            them, and then why it keeps them no more. Signals of the terminal do not reach it.
        first: The content of the first message, of any length.
        restarts: How many processes may follow the first.
        files: Open files that each process gets, beside its standard streams.

    Attributes:
        offered: Ticks that were to be sent.
        dropped: Those of them for which there was no room, or nobody to take them.
        started: Processes started so far.
        failed: The last one is gone for good, or ended with an error.
        failure: What first cost a tick, as far as it is known; empty while nothing did.
    """

    def __init__(
        self,
        words: Callable[[int], Sequence[str]],
        first: bytes,
        restarts: int = RESTARTS,
        files: Sequence[int] = (),
    ) -> None:
        self._words, self._first, self._files = words, first, files
        self._most = 1 + restarts
        self._process: subprocess.Popen[bytes] | None = None
        self._pipe = -1
        self._ending = False
        self._lock = threading.Lock()
        self._keeper = threading.Thread(target=self._look_after, name="recorder", daemon=True)
        self.offered = self.dropped = self.started = 0
        self.failed = self._begun = False
        self.failure = ""
        self._passed = self._passed_before = self._lost = 0
        self._answered, self._since = False, math.inf
        self._waiting = deque[bytes]()

    @property
    def keeps(self) -> bool:
        """Whether a process runs, has reported that it keeps messages, and took the last one."""
        return self._begun and not self._waiting

    @property
    def watched(self) -> bool:
        """Whether a process has taken messages, or none is to be waited for any more."""
        return self._answered or self.failed or time.monotonic() - self._since > _STARTING

    @property
    def pid(self) -> int | None:
        """Id of the process that runs or ran last."""
        return None if self._process is None else self._process.pid

    @property
    def complete(self) -> bool:
        """Whether one process has kept every tick."""
        return self.started == 1 and not (self.failed or self.dropped)

    def __enter__(self) -> Feed:
        self._since = time.monotonic()
        self._start()
        self._keeper.start()
        return self

    def __exit__(self, *_: object) -> None:
        end = time.monotonic() + (_PATIENCE if self._begun else _STARTING)
        while self._waiting and not self.failed and time.monotonic() < end:
            if not self._pass_on():
                time.sleep(_POLL)
        self.dropped += len(self._waiting)
        with self._lock:
            self._ending = True
        with contextlib.suppress(OSError):  # one that takes nothing is not waited for
            if select.select((), (self._pipe,), (), _PATIENCE)[1]:
                os.write(self._pipe, _HEAD.pack(0, self.dropped + self._lost))
        os.close(self._pipe)
        while self._keeper.is_alive() and not self._begun and time.monotonic() < end:
            self._keeper.join(_POLL)
        self._keeper.join(_PATIENCE)
        if self._keeper.is_alive() and self._process is not None:
            what = "did not end in time" if self._answered else "had not begun by the end"
            self._because(f"the process that writes it {what}")
            self._process.kill()
            self._keeper.join()
        if self.dropped:
            self._because(f"the process that writes it was too slow for {self.dropped} ticks")

    def send(self, content: bytes) -> bool:
        """Hand over one record; False if it was dropped."""
        message = _HEAD.pack(len(content), self.dropped + self._lost) + content
        self._pass_on()
        room = len(self._waiting) < _WAITING and not self.failed
        fits = room and len(message) <= PIPE_BUF  # more may be taken in part
        if fits:
            self._waiting.append(message)
            self._pass_on()
        self.offered += 1
        self.dropped += not fits
        return fits

    def _pass_on(self) -> bool:
        """Write what waits to the pipe, a few ticks at most; whether any was taken."""
        before = len(self._waiting)
        with contextlib.suppress(OSError):  # full, or nobody reads yet
            while self._waiting and before - len(self._waiting) < _AT_ONCE:
                os.write(self._pipe, self._waiting[0])
                self._waiting.popleft()
                self._passed += 1
        return len(self._waiting) < before

    def skip(self, why: str) -> None:
        """Count a record that could not be made, and so is not sent."""
        self._because(why)
        self.offered += 1
        self.dropped += 1

    def _look_after(self) -> None:
        """Whenever the process dies, start the next one."""
        while True:
            process = self._process
            if process is None or process.stdout is None:
                return
            with process.stdout as output:
                answer = output.read(1)
                self._begun = answer == KEPT
                self._answered = self._answered or bool(answer)
                said = output.read(_LONGEST) if answer in (KEPT, NOT_KEPT) else b""
                while output.read(4096):
                    pass
            died = process.wait() != 0
            self._begun = False
            if answer != KEPT:
                self._lost += self._passed - self._passed_before
            with self._lock:
                if died or not self._ending:
                    ended = f"the process that writes it {ended_by(process.returncode)}"
                    self._because(one_line(said.decode("utf-8", "replace")) or ended)
                if self._ending or self.started >= self._most:
                    self.failed = died or not self._ending
                    return
                try:
                    self._start()
                except OSError:
                    self.failed = True
                    return

    def _because(self, why: str) -> None:
        """Keep what cost the first tick; the rest follows from it."""
        self.failure = self.failure or why

    def _start(self) -> None:
        """Start a process; what is sent goes to it from now on."""
        reading, writing = os.pipe()
        try:
            with contextlib.suppress(OSError, AttributeError):  # less room where not allowed
                fcntl.fcntl(writing, fcntl.F_SETPIPE_SZ, _ROOM)
            os.write(writing, _HEAD.pack(len(self._first), self.dropped + self._lost) + self._first)
            os.set_blocking(writing, False)
            if self._pipe < 0:
                self._pipe = os.dup(writing)
            else:
                os.dup2(writing, self._pipe, inheritable=False)  # at once: the loop may be writing
            self.started += 1
            self._passed_before = self._passed
            self._process = subprocess.Popen(  # noqa: S603 our own words
                self._words(self.started),
                stdin=reading,
                stdout=subprocess.PIPE,
                pass_fds=self._files,
                process_group=0,  # Ctrl-C in the terminal is for the loop alone
            )
        finally:
            os.close(reading)
            os.close(writing)


def messages(stream: BinaryIO, idle: Callable[[], None] | None = None) -> Iterator[Message]:
    """The messages of the sending end, in order.

    Args:
        stream: What the sending end writes to; without a buffer if `idle` is given.
        idle: Called now and then while nothing comes.
    """
    while True:
        while idle is not None and not select.select((stream,), (), (), _IDLE)[0]:
            idle()
        head = read(stream, _HEAD.size)
        length, dropped = _HEAD.unpack(head) if len(head) == _HEAD.size else (_LONGEST + 1, 0)
        if not length:
            return
        content = read(stream, length) if length <= _LONGEST else b""
        if len(content) < length:
            break
        yield Message(content, dropped)
    raise LogError(
        "expected the end of the drive, found that its process was killed: servos may still have "
        "torque; switch their supply off, or run `antennate drive` again, which takes it off"
    )


def read(stream: BinaryIO, count: int) -> bytes:
    """Read that many bytes of a stream, fewer at its end."""
    data = b""
    while len(data) < count and (piece := stream.read(count - len(data))):
        data += piece
    return data
