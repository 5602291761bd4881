"""A server of virtual servos in real time, on a pseudo-terminal or a TCP port."""

from __future__ import annotations

import math
import select
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Self

from dynamixel_bus.endpoints import Endpoint, Terminal
from dynamixel_bus.servo_bus import ServoBus

LONGEST_WAIT = 1.0
"""Longest wait before `go_on` is asked again [s]."""
_LUMP = 0.00025
"""Replies leave in lumps of this time [s]: two microframes of USB, as a fast adapter does."""
_PERIOD = 0.01
"""Servos move on at least so often [s]."""


class Server:
    """Serves virtual servos in real time while it is entered and run.

    A subclass may serve further endpoints, and move what hangs on the servos.

    Args:
        bus: The servos; only the server touches them.
        endpoint: The server's end of their wire, a pseudo-terminal by default. It is closed on
            leaving.
        others: Further endpoints by name, likewise.
    """

    def __init__(
        self,
        bus: ServoBus,
        endpoint: Endpoint | None = None,
        others: Mapping[str, Endpoint] | None = None,
    ) -> None:
        self._wire, self._bus = bus, endpoint or Terminal()
        self._endpoints = {**(others or {}), "bus": self._bus}
        self._due = 0.0

    @property
    def paths(self) -> dict[str, str]:
        """What clients open, by the names of the endpoints; `bus` is that of the servos."""
        return {name: endpoint.path for name, endpoint in self._endpoints.items()}

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        for endpoint in self._endpoints.values():
            endpoint.close()

    def run(self, go_on: Callable[[float], bool]) -> None:
        """Serve until `go_on`, told the time since then [s], returns False.

        It is asked with each packet, and at least once a second.
        """
        begin = time.monotonic()
        while go_on(now := time.monotonic() - begin):
            ready = self._select(self._wait(now))
            now = time.monotonic() - begin
            self._move(ready, now)
            self._receive(ready, now)
            if replies := self._wire.transmit(time.monotonic() - begin):
                self._bus.write(replies)

    def _select(self, wait: float) -> Sequence[object]:
        """What is ready to be read within a time [s]."""
        return select.select([*self._endpoints.values(), *self._files()], [], [], wait)[0]

    def _receive(self, ready: Sequence[object], now: float) -> None:
        if self._bus in ready:
            self._wire.master_baud = self._bus.baud()
            self._wire.receive(now, self._bus.read())

    def _wait(self, now: float) -> float:
        """Time until something happens by itself [s]."""
        reply = self._wire.next_time()
        lump = math.inf if reply is None else max(reply - now, _LUMP)
        return max(min(self._next() - now, lump, LONGEST_WAIT), 0.0)

    def _files(self) -> Sequence[int]:
        """Further files that `select` waits for."""
        return ()

    def _next(self) -> float:
        """When something moves by itself [s]."""
        return self._due

    def _move(self, ready: Sequence[object], now: float) -> None:
        """Let everything move until now [s], and send what that makes."""
        if now >= self._due:
            self._advance(now)
            self._due = max(self._due + _PERIOD, now)

    def _advance(self, now: float) -> None:
        """Let the servos move until now [s]."""
        self._wire.advance(now)
