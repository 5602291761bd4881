"""Servers of twins: a robot on two wires, or servos alone on one; in real time, or in lock-step."""

from __future__ import annotations

import math
import select
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Self

from antennate.twin.bus import ServoBus
from antennate.twin.endpoints import Endpoint, Terminal
from antennate.twin.faults import Faults
from antennate.twin.orders import Orders
from antennate.twin.physics import Physics
from antennate.twin.robot import TwinRobot
from antennate.twin.servo_box import ServoBox

_LONGEST = 1.0
"""Longest wait before `go_on` is asked again [s]."""
_LUMP = 0.00025
"""Replies leave in lumps of this time [s]: two microframes of USB, as a fast adapter does."""
_PERIOD = 0.01
"""Servos without a robot move on at least so often [s]."""


class _Server:
    """Serves a bus in real time while it is entered and run; subclasses say what moves.

    Args:
        bus: The servos; only the server touches them.
        endpoints: By name; `bus` is the one of the servos. They are closed on leaving.
        orders: Where orders come from, if they do.
    """

    def __init__(
        self, bus: ServoBus, endpoints: Mapping[str, Endpoint], orders: Orders | None
    ) -> None:
        self._wire, self._endpoints, self._orders = bus, endpoints, orders
        self._bus = endpoints["bus"]

    @property
    def paths(self) -> dict[str, str]:
        """Addresses of the endpoints."""
        return {name: endpoint.path for name, endpoint in self._endpoints.items()}

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        for endpoint in self._endpoints.values():
            endpoint.close()

    def run(self, go_on: Callable[[float], bool]) -> None:
        """Serve until `go_on`, told the time since then [s], returns False."""
        begin = time.monotonic()
        while go_on(now := time.monotonic() - begin):
            ready = self._select(self._wait(now))
            now = time.monotonic() - begin
            self._move(ready, now)
            self._take_orders(ready, now)
            self._receive(ready, now)
            if replies := self._wire.transmit(time.monotonic() - begin):
                self._bus.write(replies)

    def _select(self, wait: float) -> Sequence[object]:
        """What is ready to be read within a time [s]."""
        orders = [] if self._orders is None else self._orders.files
        return select.select([*self._endpoints.values(), *self._bells(), *orders], [], [], wait)[0]

    def _receive(self, ready: Sequence[object], now: float) -> None:
        if self._bus in ready:
            self._wire.master_baud = self._bus.baud()
            self._wire.receive(now, self._bus.read())

    def _take_orders(self, ready: Sequence[object], now: float) -> None:
        if self._orders is not None and any(file in ready for file in self._orders.files):
            self._orders.take(lambda text: self._order(text, now))

    def _wait(self, now: float) -> float:
        """Time until something happens by itself [s]."""
        reply = self._wire.next_time()
        lump = math.inf if reply is None else max(reply - now, _LUMP)
        return max(min(self._next() - now, lump, _LONGEST), 0.0)

    def _bells(self) -> Sequence[int]:
        """Files that say that something has moved."""
        return ()

    def _next(self) -> float:
        """When something moves by itself [s]."""
        raise NotImplementedError

    def _move(self, ready: Sequence[object], now: float) -> None:
        """Let everything move until now [s], and send what that makes."""
        raise NotImplementedError

    def _order(self, text: str, now: float) -> None:
        """Carry out one order.

        Raises:
            BadInputError: It is none.
        """
        raise NotImplementedError


class ServoServer(_Server):
    """Serves servos without a robot.

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
        super().__init__(box.bus, {"bus": bus or Terminal()}, orders)
        self._box, self._faults, self._due = box, faults, 0.0

    def _next(self) -> float:
        return self._due

    def _move(self, ready: Sequence[object], now: float) -> None:
        if now >= self._due:
            self._faults.apply(self._box, now)
            self._box.advance(now)
            self._due = max(self._due + _PERIOD, now)

    def _order(self, text: str, now: float) -> None:
        self._box.advance(now)
        self._box.on_order(text)


class TwinServer(_Server):
    """Serves a robot: its board and its servos.

    Args:
        robot: The robot; only the server touches it.
        faults: What goes wrong, and when.
        board: Endpoint of the board, a pseudo-terminal by default; it is closed on leaving.
        bus: Endpoint of the servos, likewise.
        orders: Where orders come from, if they do.

    Attributes:
        late: Worst lateness of a control tick of the twin itself [s].
    """

    def __init__(
        self,
        robot: TwinRobot,
        faults: Faults,
        board: Endpoint | None = None,
        bus: Endpoint | None = None,
        orders: Orders | None = None,
    ) -> None:
        endpoints = {"esp32": board or Terminal(), "bus": bus or Terminal()}
        super().__init__(robot.bus, endpoints, orders)
        self._robot, self._faults = robot, faults
        self._board = endpoints["esp32"]
        robot.converter.radio = self._board.path.startswith("udp://")
        self._physics: Physics | None = None
        self.late = 0.0

    def run(self, go_on: Callable[[float], bool]) -> None:
        """Serve until `go_on`, told the twin's time [s], returns False."""
        with Physics(self._robot) as self._physics:
            super().run(go_on)

    def run_lockstep(self, go_on: Callable[[float], bool]) -> None:
        """Serve likewise, but let one control period pass with each sync write of all goals.

        No time passes otherwise, and the bus replies at once. Two runs of one client therefore get
        the same bytes, however fast it is.
        """
        robot, self._physics = self._robot, None
        self._wire.on_goals = self._step
        self._board.write(robot.take())
        while go_on(robot.t):
            ready = self._select(_LONGEST)
            self._take_orders(ready, robot.t)
            self._receive(ready, robot.t)
            if self._bus in ready:
                self._bus.write(self._wire.transmit(math.inf))
            self._read_board(ready)
            self._board.write(robot.take())

    def _step(self) -> None:
        self._faults.apply(self._robot, self._robot.due)
        self._robot.advance(self._robot.due)

    def _bells(self) -> Sequence[int]:
        return () if self._physics is None else (self._physics.bell,)

    def _next(self) -> float:
        busy = self._physics is not None and self._physics.busy
        return math.inf if busy else self._robot.due

    def _move(self, ready: Sequence[object], now: float) -> None:
        physics, robot = self._physics, self._robot
        if physics is None:
            return
        if physics.bell in ready:
            physics.end()
            self._board.write(robot.take())
        if not physics.busy and now >= robot.due:
            self.late = max(self.late, now - robot.due)
            self._faults.apply(robot, now)
            physics.begin()
        self._read_board(ready)

    def _read_board(self, ready: Sequence[object]) -> None:
        if self._board in ready:
            self._robot.receive(self._board.read())

    def _order(self, text: str, now: float) -> None:
        """Carry out one order: a touch of an antenna, a fault, or plugs and shafts."""
        word, _, rest = text.partition(" ")
        if word == "touch":
            self._robot.order_touch(rest)
        elif word == "fault":
            self._faults.order(rest)
        else:
            self._robot.plugging.order(text, now)
