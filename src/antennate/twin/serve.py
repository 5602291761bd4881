"""A twin robot on two wires: in real time, or one control period with each set of goals."""

from __future__ import annotations

import math
import select
import time
from collections.abc import Callable, Sequence

from antennate.twin.endpoints import Endpoint, Terminal
from antennate.twin.faults import Faults
from antennate.twin.orders import Orders
from antennate.twin.physics import Physics
from antennate.twin.robot import TwinRobot

_LONGEST = 1.0
"""Longest wait before `go_on` is asked again [s]."""
_LUMP = 0.00025
"""Replies leave in lumps of this time [s]: two microframes of USB, as a fast adapter does."""


class TwinServer:
    """Serves a robot while it is entered and run.

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
        self._robot = robot
        self._orders = orders
        self._faults = faults
        self._bus = bus or Terminal()
        self._board = board or Terminal()
        self.late = 0.0

    @property
    def paths(self) -> dict[str, str]:
        """Addresses of the board and the bus."""
        return {"esp32": self._board.path, "bus": self._bus.path}

    def __enter__(self) -> TwinServer:
        return self

    def __exit__(self, *_: object) -> None:
        self._bus.close()
        self._board.close()

    def run(self, go_on: Callable[[float], bool]) -> None:
        """Serve until `go_on`, told the twin's time [s], returns False."""
        begin = time.monotonic()
        robot, bus = self._robot, self._robot.bus
        endpoints = [self._bus, self._board]
        with Physics(robot) as physics:
            while go_on(now := time.monotonic() - begin):
                wait = self._wait(now, physics)
                ready, _, _ = select.select([*endpoints, physics.bell, *self._files], [], [], wait)
                if physics.bell in ready:
                    physics.end()
                    self._board.write(robot.take())
                now = time.monotonic() - begin
                if not physics.busy and now >= robot.due:
                    self.late = max(self.late, now - robot.due)
                    self._faults.apply(robot, now)
                    physics.begin()
                self._take_orders(ready, now)
                if self._bus in ready:
                    self._receive(now)
                if self._board in ready:
                    robot.receive(self._board.read())
                if replies := bus.transmit(time.monotonic() - begin):
                    self._bus.write(replies)

    def run_lockstep(self, go_on: Callable[[float], bool]) -> None:
        """Serve likewise, but let one control period pass with each sync write of all goals.

        No time passes otherwise, and the bus replies at once. Two runs of one client therefore get
        the same bytes, however fast it is.
        """
        robot, bus = self._robot, self._robot.bus
        bus.on_goals = self._step
        self._board.write(robot.take())
        while go_on(robot.t):
            files = [self._bus, self._board, *self._files]
            ready, _, _ = select.select(files, [], [], _LONGEST)
            self._take_orders(ready, robot.t)
            if self._bus in ready:
                self._receive(robot.t)
                self._bus.write(bus.transmit(math.inf))
            if self._board in ready:
                robot.receive(self._board.read())
            self._board.write(robot.take())

    def _receive(self, now: float) -> None:
        self._robot.bus.master_baud = self._bus.baud()
        self._robot.bus.receive(now, self._bus.read())

    @property
    def _files(self) -> list[int]:
        return [] if self._orders is None else self._orders.files

    def _take_orders(self, ready: Sequence[object], now: float) -> None:
        if self._orders is not None and any(file in ready for file in self._files):
            self._orders.take(lambda text: self._order(text, now))

    def _order(self, text: str, now: float) -> None:
        """Carry out one order: a touch of an antenna, a fault, or plugs and shafts.

        Raises:
            BadInputError: It is none.
        """
        word, _, rest = text.partition(" ")
        if word == "touch":
            self._robot.touch.order(rest)
        elif word == "fault":
            self._faults.order(rest)
        else:
            self._robot.plugging.order(text, now)

    def _step(self) -> None:
        self._faults.apply(self._robot, self._robot.due)
        self._robot.advance(self._robot.due)

    def _wait(self, now: float, physics: Physics) -> float:
        """Time until something happens by itself [s]."""
        reply = self._robot.bus.next_time()
        tick = math.inf if physics.busy else self._robot.due - now
        lump = math.inf if reply is None else max(reply - now, _LUMP)
        return max(min(tick, lump, _LONGEST), 0.0)
