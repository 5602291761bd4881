"""Ticks on their way to another process, which keeps and shows them; the loop never waits for it.

A message is the content of a record behind its length and how many were dropped before it. The
loop writes it to a pipe at once or not at all: what the other process cannot take is dropped and
counted; in a twin's time, which stands still meanwhile, it waits. The content of no bytes says that
the loop has ended in order; a pipe that closes without it means that the loop was killed.
"""

from __future__ import annotations

import contextlib
import fcntl
import os
import struct
import subprocess
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from select import PIPE_BUF
from typing import BinaryIO

from antennate.errors import LogError
from antennate.params import HostParams

_HEAD = struct.Struct("<II")
_ROOM = 1 << 20
"""Bytes that the pipe may hold: half a minute of ticks."""
_PATIENCE = HostParams().log_patience
"""Time for the other process to write the last ticks [s]."""
_LONGEST = 1 << 17


@dataclass(frozen=True, slots=True)
class Message:
    """One message.

    Attributes:
        content: Of the record.
        dropped: Ticks dropped so far.
    """

    content: bytes
    dropped: int


class Feed:
    """The sending end; as a context it starts the other process and waits for its end.

    Args:
        words: Command line of a process that reads messages from its standard input.
        first: The content of the first message, of any length.
        waits: Wait for room instead of dropping, where the loop's time is not the host's.

    Attributes:
        dropped: Ticks that found no room.
        failed: The other process is gone, or ended with an error.
    """

    def __init__(self, words: Sequence[str], first: bytes, waits: bool = False) -> None:
        self._words, self._first, self._waits = words, first, waits
        self._process: subprocess.Popen[bytes] | None = None
        self._pipe = -1
        self.dropped = 0
        self.failed = False

    def __enter__(self) -> Feed:
        theirs, self._pipe = os.pipe()
        try:
            self._process = subprocess.Popen(self._words, stdin=theirs)  # noqa: S603 our own words
        finally:
            os.close(theirs)
        with contextlib.suppress(OSError, AttributeError):  # less room where not allowed or known
            fcntl.fcntl(self._pipe, fcntl.F_SETPIPE_SZ, _ROOM)
        with contextlib.suppress(BrokenPipeError):  # it has gone already; `send` will notice
            os.write(self._pipe, _HEAD.pack(len(self._first), 0) + self._first)
        os.set_blocking(self._pipe, self._waits)
        return self

    def __exit__(self, *_: object) -> None:
        process, self._process = self._process, None
        if process is None:
            return
        os.set_blocking(self._pipe, True)
        with contextlib.suppress(OSError):
            os.write(self._pipe, _HEAD.pack(0, self.dropped))
        os.close(self._pipe)
        try:
            self.failed |= process.wait(_PATIENCE) != 0
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
            self.failed = True

    def send(self, content: bytes) -> bool:
        """Hand over one record; False if it was dropped."""
        message = _HEAD.pack(len(content), self.dropped) + content
        done = not self.failed and len(message) <= PIPE_BUF  # more may be taken in part
        try:
            if done:
                os.write(self._pipe, message)
        except BlockingIOError:
            done = False
        except OSError:
            self.failed, done = True, False
        self.dropped += not done
        return done


def messages(stream: BinaryIO) -> Iterator[Message]:
    """What the sending end has said, in order.

    Raises:
        LogError: The stream ended in the middle: the sender was killed.
    """
    while head := stream.read(_HEAD.size):
        length, dropped = _HEAD.unpack(head) if len(head) == _HEAD.size else (_LONGEST + 1, 0)
        if length > _LONGEST:
            break
        if not length:
            return
        content = stream.read(length)
        if len(content) < length:
            break
        yield Message(content, dropped)
    raise LogError("expected the end of the drive, found that its process was killed")
