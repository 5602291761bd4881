"""Messages between a program and the process that shows it; sending never waits.

Both ends of a pair of sockets keep the borders of messages. What does not fit is dropped and
counted; the next message is newer anyway. A long one, as a picture of very many parts, goes in
pieces: those for which there is no room follow with the next calls, and until then further long
ones are dropped. Only for the shapes of a scene, which come once, one waits.
"""

from __future__ import annotations

import errno
import json
import select
import socket
import struct
import time
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from antennate.errors import BadInputError

SCENE, POSES, SNAPSHOT, TICK = b"S", b"P", b"G", b"T"
"""Kinds of messages: the scene, poses with forces or a snapshot of the engine, a tick."""
LINKS, PLACES = b"L", b"W"
"""Names of a robot's links and joints as JSON; where its links are, of `sim.frames`."""
HEADER, TEXT, STATE, END = b"H", b"X", b"Z", b"E"
"""The header of a log, a line of text, the state of the controls, the end in order."""
READY, FAILED = b"R", b"F"
"""What the other process says at first: it serves, or why it cannot."""
IDLE = "idle"
"""Word that lets that process give way to all others."""
_SEVERAL = b"+"
"""A kind that holds messages, each behind its kind and length."""
_BEGUN, _ENDED = b"b", b"e"
"""Kinds that hold a piece of a long message, and its last one."""
_PART = struct.Struct("<cI")
ORDER, GOALS = b"O", b"J"
"""Kinds that come back, as JSON: what a person wants; goals of joints that are accepted."""
_PIECE = 1 << 16
_LONGEST = 1 << 17
"""Most bytes of a message that goes at once."""
_ROOM = 1 << 20
"""Bytes that may wait to be taken; the system may allow less."""
_PATIENCE = 5.0
"""Longest wait for room for the scene [s]; assumed: the other end is starting."""
_LAST = 1.0
"""Longest wait for room for the last messages [s]; assumed: a page that is shown takes them."""


class Poses(NamedTuple):
    """Where all shapes are at a time.

    Attributes:
        t: Time of the trial [s].
        poses: As of `sim.shapes`, shape (n, 12).
        forces: As of `sim.shapes`, shape (k, 6).
    """

    t: float
    poses: Any
    forces: Any

    def pack(self) -> bytes:
        """The poses as bytes."""
        head = np.array([self.t, len(self.poses)], np.float64).tobytes()
        return head + self.poses.tobytes() + self.forces.tobytes()

    @classmethod
    def unpack(cls, content: bytes) -> Poses:
        """Poses from the bytes of `pack`."""
        try:
            t, count = np.frombuffer(content, np.float64, 2)
            numbers = np.frombuffer(content, np.float32, offset=16)
            end = 12 * int(count)
            return cls(float(t), numbers[:end].reshape(-1, 12), numbers[end:].reshape(-1, 6))
        except ValueError as error:
            raise BadInputError(f"expected poses, found {error}") from None


class Channel:
    """One end of the pair.

    Attributes:
        dropped: Messages for which there was no room.
        closed: The other end is gone.
    """

    def __init__(self, end: socket.socket) -> None:
        self._end = end
        end.setblocking(False)
        end.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _ROOM)
        self._come = select.poll()
        self._come.register(end, select.POLLIN)
        self.dropped, self.closed = 0, False
        self._left = deque[tuple[bytes, bytes]]()
        self._pieces = list[bytes]()

    @staticmethod
    def pair() -> tuple[socket.socket, socket.socket]:
        """Two sockets; each makes a `Channel` in its process."""
        return socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)

    def fileno(self) -> int:
        """File of the channel, to wait for."""
        return self._end.fileno()

    def send(self, kind: bytes, content: bytes = b"") -> bool:
        """Send a message, or drop it if there is no room now; whether it was taken."""
        return self._send((kind, content))

    def send_together(self, *messages: tuple[bytes, bytes]) -> bool:
        """Send messages, each with its kind, or drop all; half the price of two of them."""
        parts = [_SEVERAL]
        for kind, content in messages:
            parts += (_PART.pack(kind, len(content)), content)
        return self._send(parts)

    def _send(self, parts: Sequence[bytes]) -> bool:
        if sum(map(len, parts)) <= _LONGEST:
            sent = self._put(parts)  # before what is left: it may pass
            self._go_on()
        else:
            self._go_on()
            if sent := not self._left:
                self._left += _pieces(b"".join(parts))
                self._go_on()
        self.dropped += not sent and not self.closed
        return sent and not self.closed

    def _go_on(self) -> None:
        """Send what is left of a long message, as far as there is room."""
        while self._left and self._put(self._left[0]):
            self._left.popleft()

    def _put(self, parts: Sequence[bytes]) -> bool:
        """Whether there was room."""
        try:
            self._end.sendmsg(parts)
        except BlockingIOError:
            return False
        except OSError as error:
            self.closed |= error.errno != errno.EMSGSIZE  # longer than any message may be here
            return False
        return True

    def tell(self, kind: bytes, **content: Any) -> bool:
        """Send a message that is a JSON object."""
        return self.send(kind, json.dumps(content).encode())

    def send_whole(self, kind: bytes, content: bytes) -> bool:
        """Send a message in pieces and wait for room; False if the other end takes none."""
        self._left += _pieces(kind + content)
        return self._drain(time.monotonic() + _PATIENCE)

    def finish(self, kind: bytes) -> None:
        """Send what is left of a long message, then an empty one of this kind."""
        end = time.monotonic() + _LAST
        while self._drain(end) and not self._put((kind,)):
            if not self._wait_for_room(end):
                return

    def _drain(self, end: float) -> bool:
        """Send what is left of a long message; False if that is not taken by a time [s]."""
        self._go_on()
        while self._left and self._wait_for_room(end):
            self._go_on()
        return not (self._left or self.closed)

    def _wait_for_room(self, end: float) -> bool:
        """Whether there is room again by a time [s], or the other end is gone."""
        left = end - time.monotonic()
        return not self.closed and left > 0 and bool(select.select((), (self,), (), left)[1])

    def receive(self) -> Iterator[tuple[bytes, bytes]]:
        """Kind and content of what has come; a long message is put together."""
        self._go_on()
        while self._come.poll(0):
            try:
                message = self._end.recv(_LONGEST)
            except BlockingIOError:
                return
            except OSError:
                message = b""
            if not message:
                self.closed = True
                return
            if message[:1] in (_BEGUN, _ENDED):
                self._pieces.append(message[1:])
                if message[:1] == _BEGUN:
                    continue
                message = b"".join(self._pieces)
                self._pieces.clear()
            yield from _messages(message)

    def close(self) -> None:
        """Close this end."""
        self._end.close()


def _pieces(message: bytes) -> list[tuple[bytes, bytes]]:
    """A message in pieces, each with its kind."""
    *pieces, last = (message[at : at + _PIECE] for at in range(0, len(message), _PIECE))
    return [*((_BEGUN, piece) for piece in pieces), (_ENDED, last)]


def _messages(message: bytes) -> Iterator[tuple[bytes, bytes]]:
    """The message, or those within one of the kind `_SEVERAL`."""
    if message[:1] != _SEVERAL:
        yield message[:1], message[1:]
        return
    at = len(_SEVERAL)
    while at < len(message):
        kind, length = _PART.unpack_from(message, at)
        at += _PART.size + length
        yield kind, message[at - length : at]


def read(content: bytes) -> Mapping[str, Any]:
    """The JSON object of a message; empty for anything else."""
    try:
        found = json.loads(content)
    except ValueError:
        return {}
    return found if isinstance(found, dict) else {}
