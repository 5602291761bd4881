"""Messages between a program and the process that shows it; sending never waits.

Both ends of a pair of sockets keep the borders of messages. What does not fit is dropped and
counted; the next message is newer anyway. A long one, as a picture of very many parts, goes in
pieces: those for which there is no room follow with the next calls, and until then further long
ones are dropped. Only for the shapes of a scene, which come once, one waits.
"""

from __future__ import annotations

import errno
import json
import math
import select
import socket
import struct
import time
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from antennate.errors import BadInputError
from antennate.telemetry.ticks import Tick
from antennate.types import Contact

SCENE, MORE, POSES, TICK = b"S", b"M", b"P", b"T"
"""Kinds of messages: the scene and a piece of it, poses with forces, a tick."""
SNAPSHOT, STEP = b"G", b"t"
"""The same of a simulation, with less work for it: a snapshot of the engine, a `Step`."""
HEADER, TEXT, STATE, END = b"H", b"X", b"Z", b"E"
"""The header of a log, a line of text, the state of the controls, the end in order."""
READY, FAILED = b"R", b"F"
"""What the other process says at first: it serves, or why it cannot."""
_SEVERAL = b"+"
"""A kind that holds messages, each behind its kind and length."""
_BEGUN, _ENDED = b"b", b"e"
"""Kinds that hold a piece of a long message, and its last one."""
_PART = struct.Struct("<cI")
_STEP = struct.Struct("<qd2dq2d2qd")
ORDER = b"O"
"""The kind that the page sends: what a person wants, as JSON."""
_PIECE = 1 << 16
_LONGEST = 1 << 17
"""Most bytes of a message that goes at once."""
_ROOM = 1 << 20
"""Bytes that may wait to be taken; the system may allow less."""
_PATIENCE = 5.0
"""Longest wait for room for a piece of the scene [s]; assumed: the other end is starting."""
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
        """It as bytes."""
        head = np.array([self.t, len(self.poses)], np.float64).tobytes()
        return head + self.poses.tobytes() + self.forces.tobytes()

    @classmethod
    def unpack(cls, content: bytes) -> Poses:
        """Back from `pack`.

        Raises:
            BadInputError: It is something else.
        """
        try:
            t, count = np.frombuffer(content, np.float64, 2)
            numbers = np.frombuffer(content, np.float32, offset=16)
            end = 12 * int(count)
            return cls(float(t), numbers[:end].reshape(-1, 12), numbers[end:].reshape(-1, 6))
        except ValueError as error:
            raise BadInputError(f"expected poses, found {error}") from None


class Step(NamedTuple):
    """What a simulation knows of a tick; as of `Tick`."""

    number: int
    t: float
    counts: Sequence[float] = (math.nan, math.nan)
    maneuver: int = 0
    level: Sequence[float] = (math.nan, math.nan)
    contact: Sequence[int] = (Contact.UNKNOWN, Contact.UNKNOWN)
    phase: float = math.nan

    def pack(self) -> bytes:
        """It as bytes."""
        number, t, counts, maneuver, level, contact, phase = self
        return _STEP.pack(number, t, *counts, maneuver, *level, *contact, phase)

    @staticmethod
    def unpack(content: bytes) -> Tick:
        """The tick of what `pack` gave.

        Raises:
            BadInputError: They are something else.
        """
        try:
            number, t, left, right, maneuver, *more = _STEP.unpack(content)
        except struct.error as error:
            raise BadInputError(f"expected a step, found {error}") from None
        *level, one, other, phase = more
        counts = left, right
        return Tick(
            *(number, t, t, counts, counts, (level[0], level[1]), (one, other), maneuver, phase),
            angles=(),
        )


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
        """Its file, to wait for."""
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
            taken = self._put(parts)  # before what is left: it may pass
            self._go_on()
        else:
            self._go_on()
            if taken := not self._left:
                *pieces, last = _pieces(b"".join(parts))
                self._left += [*((_BEGUN, piece) for piece in pieces), (_ENDED, last)]
                self._go_on()
        self.dropped += not taken and not self.closed
        return taken and not self.closed

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
        """Send a long message in pieces; False if the other end takes none."""
        end = time.monotonic() + _PATIENCE
        pieces = _pieces(content) or [b""]
        kinds = [MORE] * (len(pieces) - 1) + [kind]
        for each, piece in zip(kinds, pieces, strict=True):
            while not self.send(each, piece):
                self.dropped -= not self.closed
                left = end - time.monotonic()
                if self.closed or left <= 0 or not select.select((), (self._end,), (), left)[1]:
                    return False
        return True

    def finish(self, kind: bytes) -> None:
        """Send what is left of a long message, then an empty one of this kind."""
        end = time.monotonic() + _LAST
        while not self.closed and (self._left or not self._put((kind,))):
            left = end - time.monotonic()
            if left <= 0 or not select.select((), (self._end,), (), left)[1]:
                return
            self._go_on()

    def receive(self) -> Iterator[tuple[bytes, bytes]]:
        """Kind and content of what has come; a long message is put together."""
        self._go_on()
        held = b""
        while held or self._come.poll(0):
            try:
                message = self._end.recv(_LONGEST)
            except BlockingIOError:
                if not held:
                    return
                select.select((self._end,), (), (), _PATIENCE)
                continue
            except OSError:
                message = b""
            if not message:
                self.closed = True
                return
            kind = message[:1]
            if kind == MORE:
                held += message[1:]
            elif kind in (_BEGUN, _ENDED):
                self._pieces.append(message[1:])
                if kind == _ENDED:
                    message = b"".join(self._pieces)
                    self._pieces.clear()
                    yield from _messages(message)
            elif kind == _SEVERAL:
                yield from _messages(message)
            else:
                content, held = held + message[1:], b""
                yield kind, content

    def close(self) -> None:
        """Close this end."""
        self._end.close()


def _pieces(content: bytes) -> list[bytes]:
    return [content[at : at + _PIECE] for at in range(0, len(content), _PIECE)]


def _messages(message: bytes) -> Iterator[tuple[bytes, bytes]]:
    """Itself, or the messages in one of the kind `_SEVERAL`."""
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
