"""A log of simulated ticks that a process of its own writes, for a simulation in real time.

The simulation writes each tick to a pipe without waiting. What does not fit is kept here and
follows with the next ticks; beyond `_WAITING` it is dropped and counted. A pipe that closes without
`_END` means that the simulation was killed: then the log is not closed either, so that a reader
sees it.
"""

from __future__ import annotations

import contextlib
import fcntl
import os
import select
import signal
import struct
import subprocess
import sys
import threading
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Self

import numpy as np

from antennate.errors import LogError
from antennate.messages import ended_by, one_line
from antennate.telemetry.feed import read
from antennate.telemetry.header import Header
from antennate.telemetry.rows import RowLog, Rows
from antennate.telemetry.topics import CONTACT_FORCES, COORDINATES, Topic
from antennate.types import Floats

_NOTHING: Mapping[Topic, bytes] = {}
_Tick = tuple[bytes, Mapping[Topic, bytes]]
_HEAD = struct.Struct("<BI")
_TIME = struct.Struct("<d")
_ROW, _FORCES, _PLACE, _EVENT, _FIRST, _END = range(6)
_BESIDE = {CONTACT_FORCES: _FORCES, COORDINATES: _PLACE}
_TOPICS = {kind: topic for topic, kind in _BESIDE.items()}
_ROOM = 1 << 20
"""Bytes that the pipe may hold: about 10 s of ticks."""
_WAITING = 3000
"""Most messages that wait for room in the pipe: 30 s at 100 Hz."""
_PATIENCE = 10.0
"""Time for the other process to write the last ticks to a slow disk [s]; assumed."""
_IDLE = 0.05
"""Time without a tick after which those that wait are written [s]."""
_STDIN, _STDOUT = 0, 1
_STOPS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


class LogProcess:
    """The sending end; as a context it closes the log.

    Args:
        path: A file that does not exist yet.
        header: What stands at its beginning.
        on_failure: Called once with the reason if it cannot be written any more.

    Attributes:
        path: The file.
        dropped: Messages for which there was no room.
        failure: Why it cannot be written any more; empty while it can.

    Raises:
        LogError: The file exists or cannot be written, or the disk is nearly full.
    """

    def __init__(
        self, path: Path, header: Header, on_failure: Callable[[str], None] = lambda _: None
    ) -> None:
        self.path, self.dropped, self._on_failure = path, 0, on_failure
        self._waiting, self._lock = deque[bytes](), threading.Lock()
        self.failure = ""
        self._process = subprocess.Popen(  # noqa: S603 our own words
            [sys.executable, "-m", __name__, str(path)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            process_group=0,  # Ctrl-C in the terminal is for the simulation alone
        )
        assert self._process.stdin is not None  # noqa: S101 it is asked for
        self._pipe = self._process.stdin.fileno()
        with contextlib.suppress(OSError, AttributeError):  # less room where not allowed
            fcntl.fcntl(self._pipe, fcntl.F_SETPIPE_SZ, _ROOM)
        self._send(_FIRST, header.pack())
        answer = self._answer()
        if answer:
            self.close()
            raise LogError(answer)
        os.set_blocking(self._pipe, False)

    def _answer(self) -> str:
        """What the process says first: nothing if the log has begun, else why it has not."""
        assert self._process.stdout is not None  # noqa: S101 it is asked for
        text = self._process.stdout.readline().decode("utf-8", "replace")
        return text.strip() if text else "expected a process that writes the log, found none"

    def add(self, numbers: Floats, beside: Mapping[Topic, bytes] = _NOTHING) -> None:
        """Hand over one tick as it is in `Rows`; it is dropped if there is no room."""
        parts = [(_BESIDE[topic], data) for topic, data in beside.items()]
        parts.append((_ROW, numbers.tobytes()))
        found = b"".join(_HEAD.pack(kind, len(content)) + content for kind, content in parts)
        self._hand_over(found)

    def event(self, text: str, t: float) -> None:
        """Hand over what happened after the last tick, at a time of the loop [s]."""
        content = _TIME.pack(t) + text.encode()
        self._hand_over(_HEAD.pack(_EVENT, len(content)) + content)

    def close(self) -> str:
        """End the log and wait until it is written; what is wrong with it, empty if nothing."""
        if self._pipe >= 0:
            with contextlib.suppress(OSError):
                os.set_blocking(self._pipe, True)
                while self._waiting:
                    self._write(self._waiting.popleft())
                self._send(_END)
            self._wait()
        missing = f"{self.dropped} ticks are missing in it" if self.dropped else ""
        return self.failure or missing

    def _wait(self) -> None:
        """Wait until the process has ended, and keep why it failed."""
        self._pipe, said, why = -1, b"", ""
        try:
            said, _ = self._process.communicate(timeout=_PATIENCE)
        except (OSError, subprocess.TimeoutExpired):
            why = f"the process that writes {self.path} did not end in {_PATIENCE:g} s"
            self._process.kill()
        if status := self._process.wait():
            ended = why or f"the process that writes {self.path} {ended_by(status)}"
            self.failure = one_line(said.decode("utf-8", "replace")) or ended

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _hand_over(self, message: bytes) -> None:
        if self.failure:
            return
        if len(self._waiting) >= _WAITING:
            self.dropped += 1
            return
        with self._lock, contextlib.suppress(BlockingIOError):  # it is full
            self._waiting.append(message)
            try:
                self._pass_on()
            except BrokenPipeError:
                self._wait()
                self._on_failure(self.failure)

    def _pass_on(self) -> None:
        """Write what waits.

        Raises:
            OSError: The pipe is full, or nobody reads any more.
        """
        while self._waiting:
            first = self._waiting[0]
            taken = os.write(self._pipe, first)
            if taken < len(first):
                self._waiting[0] = first[taken:]
                return
            self._waiting.popleft()

    def _send(self, kind: int, content: bytes = b"") -> None:
        self._write(_HEAD.pack(kind, len(content)) + content)

    def _write(self, message: bytes) -> None:
        while message:
            message = message[os.write(self._pipe, message) :]


def _messages(log: RowLog[_Tick] | None = None) -> Iterator[tuple[int, bytes]]:
    """What comes, until the pipe closes."""
    with open(_STDIN, "rb", buffering=0, closefd=False) as stream:
        while True:
            while log is not None and not select.select((stream,), (), (), _IDLE)[0]:
                log.settle()
            head = read(stream, _HEAD.size)
            if len(head) < _HEAD.size:
                return
            kind, length = _HEAD.unpack(head)
            content = read(stream, length)
            if len(content) < length:
                return
            yield kind, content


def _rows(ticks: Sequence[_Tick]) -> Rows:
    """Rows of ticks that have come."""
    numbers = np.frombuffer(b"".join(content for content, _ in ticks)).reshape(len(ticks), -1)
    return numbers, {i: beside for i, (_, beside) in enumerate(ticks) if beside}


def _keep(log: RowLog[_Tick]) -> bool:
    """Write what comes; whether the simulation ended the log."""
    beside: dict[Topic, bytes] = {}
    for kind, content in _messages(log):
        if kind in _TOPICS:
            beside[_TOPICS[kind]] = content
        elif kind == _ROW:
            log.add((content, beside))
            beside = {}
        elif kind == _EVENT:
            log.event(content[_TIME.size :].decode(), *_TIME.unpack_from(content))
        else:
            return True
    return False


def main() -> int:
    """Write the log; its path is the only word.

    One line on stdout says whether it has begun, another one why it cannot be written any more.
    """
    for number in _STOPS:  # the simulation decides when it is over
        signal.signal(number, signal.SIG_IGN)
    _, first = next(_messages(), (_FIRST, b""))
    try:
        log = RowLog(Path(sys.argv[1]), Header.unpack(first), _rows)
    except LogError as error:
        os.write(_STDOUT, one_line(str(error)).encode() + b"\n")
        return 1
    os.write(_STDOUT, b"\n")
    try:
        if _keep(log):
            log.close()
        else:
            log.flush()
    except LogError as error:
        with contextlib.suppress(OSError):  # nobody reads it
            os.write(_STDOUT, one_line(str(error)).encode())
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
