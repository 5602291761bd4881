"""Servers of twins: a robot on two wires, or servos alone on one; in real time, or in lock-step."""

from __future__ import annotations

import math
import os
import sys
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor

from antennate.errors import BadInputError
from antennate.host import claim
from antennate.twin.faults import Faults
from antennate.twin.orders import Orders
from antennate.twin.robot import TwinRobot
from antennate.twin.servos import ServoBox
from antennate.types import Floats
from dynamixel_bus.endpoints import Endpoint, Terminal
from dynamixel_bus.server import LONGEST_WAIT, Server
from dynamixel_bus.servo_bus import ServoBus

_SWITCH = 0.00005
"""Longest time that one thread keeps the other from Python [s]; the physics itself does not."""


class _OrderedServer(Server):
    """A server that also takes orders.

    Args:
        bus: The servos; only the server touches them.
        endpoint: Of the servos; it is closed on leaving.
        others: Further endpoints by name, likewise.
        orders: Where orders come from, if they do.
    """

    def __init__(
        self,
        bus: ServoBus,
        endpoint: Endpoint | None,
        others: Mapping[str, Endpoint],
        orders: Orders | None,
    ) -> None:
        super().__init__(bus, endpoint, others)
        self._orders = orders

    def _files(self) -> Sequence[int]:
        return () if self._orders is None else self._orders.files

    def _take_orders(self, ready: Sequence[object], now: float) -> None:
        if self._orders is not None and any(file in ready for file in self._orders.files):
            self._orders.take(lambda text: self._order(text, now))

    def _order(self, text: str, now: float) -> None:
        """Carry out one order."""
        raise NotImplementedError


class Physics:
    """Runs the ticks of a robot while it is entered.

    Attributes:
        bell: Handle that can be read when a tick is over.
    """

    def __init__(self, robot: TwinRobot) -> None:
        self._robot = robot
        self._thread = ThreadPoolExecutor(1, "twin-physics", initializer=claim)
        self._tick: Future[Floats | None] | None = None
        self.bell, self._ring = os.pipe()
        self._switch = sys.getswitchinterval()

    def __enter__(self) -> Physics:
        sys.setswitchinterval(_SWITCH)
        return self

    def __exit__(self, *_: object) -> None:
        self._thread.shutdown()
        sys.setswitchinterval(self._switch)
        os.close(self.bell)
        os.close(self._ring)

    @property
    def busy(self) -> bool:
        """A tick has begun and not ended."""
        return self._tick is not None

    def begin(self) -> None:
        """Begin the next tick; the bell rings when `end` may be called."""
        pulls = self._robot.begin_tick()
        self._tick = self._thread.submit(self._robot.move, pulls)
        self._tick.add_done_callback(lambda _: os.write(self._ring, b"x"))

    def end(self) -> None:
        """Take what the physics gave; raises what it raised."""
        os.read(self.bell, 1)
        tick, self._tick = self._tick, None
        if tick is not None:
            self._robot.end_tick(tick.result())


class ServoServer(_OrderedServer):
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
        super().__init__(box.bus, bus, {}, orders)
        self._box, self._faults = box, faults

    def _move(self, ready: Sequence[object], now: float) -> None:
        super()._move(ready, now)
        self._take_orders(ready, now)

    def _advance(self, now: float) -> None:
        self._faults.apply(self._box, now)
        self._box.advance(now)

    def _order(self, text: str, now: float) -> None:
        self._box.advance(now)
        self._box.on_order(text)


class TwinServer(_OrderedServer):
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
        self._board = board or Terminal()
        super().__init__(robot.bus, bus, {"esp32": self._board}, orders)
        self._robot, self._faults = robot, faults
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
            ready = self._select(LONGEST_WAIT)
            self._take_orders(ready, robot.t)
            self._receive(ready, robot.t)
            if self._bus in ready:
                self._bus.write(self._wire.transmit(math.inf))
            self._read_board(ready)
            self._board.write(robot.take())

    def _step(self) -> None:
        self._faults.apply(self._robot, self._robot.due)
        self._robot.advance(self._robot.due)

    def _files(self) -> Sequence[int]:
        bells = () if self._physics is None else (self._physics.bell,)
        return (*bells, *super()._files())

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
        self._take_orders(ready, now)

    def _read_board(self, ready: Sequence[object]) -> None:
        if self._board in ready:
            self._robot.receive(self._board.read())

    def _order(self, text: str, now: float) -> None:
        """Carry out one order: a touch of an antenna, a fault, or plugs and shafts."""
        word, _, rest = text.partition(" ")
        if word == "touch":
            self._robot.order_touch(rest)
        elif text in ("hang", "floor"):
            if not len(self._robot.world.places.legs):
                raise BadInputError("expected a robot with legs, found a bench on its clamp")
            self._robot.hands.hanging = text == "hang"
        elif word == "fault":
            self._faults.order(rest)
        else:
            self._robot.plugging.order(text, now)
