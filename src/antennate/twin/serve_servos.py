"""Servos without a robot on one wire, in real time."""

from __future__ import annotations

import select
import time
from collections.abc import Callable

from antennate.twin.endpoints import Endpoint, Terminal
from antennate.twin.faults import Faults
from antennate.twin.orders import Orders
from antennate.twin.servo_box import ServoBox

_PERIOD = 0.01
"""Servos move on at least so often [s]."""


class ServoServer:
    """Serves servos while it is entered and run.

    Args:
        box: The servos; only the server touches them.
        faults: What goes wrong, and when.
        bus: Endpoint of the wire, a pseudo-terminal by default; it is closed on leaving.
        orders: Where orders come from, if they do.
    """

    def __init__(
        self,
        box: ServoBox,
        faults: Faults,
        bus: Endpoint | None = None,
        orders: Orders | None = None,
    ) -> None:
        self._box = box
        self._faults = faults
        self._bus = bus or Terminal()
        self._orders = orders

    @property
    def paths(self) -> dict[str, str]:
        """Address of the bus."""
        return {"bus": self._bus.path}

    def __enter__(self) -> ServoServer:
        return self

    def __exit__(self, *_: object) -> None:
        self._bus.close()

    def run(self, go_on: Callable[[float], bool]) -> None:
        """Serve until `go_on`, told the time since then [s], returns False."""
        begin = time.monotonic()
        box, bus = self._box, self._box.bus
        due = 0.0
        while go_on(now := time.monotonic() - begin):
            if now >= due:
                self._faults.apply(box, now)
                box.advance(now)
                due = max(due + _PERIOD, now)
            reply = bus.next_time()
            wait = min(due, due if reply is None else reply) - now
            files = [] if self._orders is None else self._orders.files
            ready, _, _ = select.select([self._bus, *files], [], [], max(wait, 0.0))
            now = time.monotonic() - begin
            if self._orders is not None and any(file in ready for file in files):
                box.advance(now)
                self._orders.take(box.on_order)
            if self._bus in ready:
                bus.master_baud = self._bus.baud()
                bus.receive(now, self._bus.read())
            if replies := bus.transmit(time.monotonic() - begin):
                self._bus.write(replies)
