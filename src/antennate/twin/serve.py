"""A twin robot on two wires, in real time: no client can tell it from the real one.

Or in lock-step with a client that takes all the time it wants, and always gets the same.
"""

from __future__ import annotations

import math
import os
import select
import termios
import time
import tty
from collections.abc import Callable
from typing import Protocol

from antennate.hardware.dynamixel.tables import BAUD_RATES
from antennate.params import TwinParams
from antennate.twin.faults import Faults
from antennate.twin.physics import Physics
from antennate.twin.robot import TwinRobot

_CHUNK = 4096
_LONGEST = 1.0
_LUMP = TwinParams().lump
"""Answers leave in lumps of this time [s], as those of a fast USB adapter do."""
_SPEEDS: dict[int, int] = {
    getattr(termios, f"B{baud}"): baud for baud in BAUD_RATES if hasattr(termios, f"B{baud}")
}


class End(Protocol):
    """The twin's end of a wire; `select` takes it."""

    @property
    def path(self) -> str:
        """What a client opens."""
        ...

    def fileno(self) -> int:
        """Ready to be read when something has come."""
        ...

    def baud(self) -> int | None:
        """Bits per second that the client has set, None if there is no such thing."""
        ...

    def read(self) -> bytes:
        """What has come."""
        ...

    def write(self, data: bytes) -> None:
        """Say it; what finds no room is lost."""
        ...

    def close(self) -> None:
        """Let it go."""
        ...


class Terminal:
    """One pseudo-terminal; whoever opens `path` talks to us."""

    def __init__(self) -> None:
        self._master, self._slave = os.openpty()
        tty.setraw(self._slave, termios.TCSANOW)
        os.set_blocking(self._master, False)
        self.path = os.ttyname(self._slave)

    def baud(self) -> int | None:
        """Bits per second that the client has set, None if it is none of the usual ones."""
        return _SPEEDS.get(termios.tcgetattr(self._slave)[5])

    def fileno(self) -> int:
        """Of our end."""
        return self._master

    def read(self) -> bytes:
        """What has come."""
        try:
            return os.read(self._master, _CHUNK)
        except BlockingIOError:
            return b""

    def write(self, data: bytes) -> None:
        """Say it; what finds no room because nobody listens is lost, as on a real line."""
        try:
            os.write(self._master, data)
        except BlockingIOError:
            return

    def close(self) -> None:
        """Both ends."""
        os.close(self._master)
        os.close(self._slave)


class TwinServer:
    """Serves a robot while it is entered and run.

    Args:
        robot: The robot; only the server touches it.
        faults: What goes wrong, and when.
        board: The board's end, a pseudo-terminal by default; it is closed on leaving.
        bus: The servos' end, likewise.

    Attributes:
        late: Worst lateness of a control tick of the twin itself [s].
    """

    def __init__(
        self, robot: TwinRobot, faults: Faults, board: End | None = None, bus: End | None = None
    ) -> None:
        self._robot = robot
        self._faults = faults
        self._bus = bus or Terminal()
        self._board = board or Terminal()
        self.late = 0.0

    @property
    def paths(self) -> dict[str, str]:
        """Where the board and the bus are."""
        return {"esp32": self._board.path, "bus": self._bus.path}

    def __enter__(self) -> TwinServer:
        return self

    def __exit__(self, *_: object) -> None:
        self._bus.close()
        self._board.close()

    def run(self, go_on: Callable[[float], bool]) -> None:
        """Serve until `go_on`, told the twin's time [s], says no."""
        begin = time.monotonic()
        robot, bus = self._robot, self._robot.bus
        ends = [self._bus, self._board]
        with Physics(robot) as physics:
            while go_on(now := time.monotonic() - begin):
                ready, _, _ = select.select([*ends, physics.bell], [], [], self._wait(now, physics))
                if physics.bell in ready:
                    physics.end()
                    self._board.write(robot.take())
                now = time.monotonic() - begin
                if not physics.busy and now >= robot.due:
                    self.late = max(self.late, now - robot.due)
                    self._faults.apply(robot, now)
                    physics.begin()
                if self._bus in ready:
                    bus.heard_at = self._bus.baud()
                    bus.receive(now, self._bus.read())
                if self._board in ready:
                    robot.hear(self._board.read())
                if answers := bus.transmit(time.monotonic() - begin):
                    self._bus.write(answers)

    def run_lockstep(self, go_on: Callable[[float], bool]) -> None:
        """Serve likewise, but let one control period pass with each sync write of all goals.

        Nothing passes otherwise, and the bus answers at once.
        """
        robot, bus = self._robot, self._robot.bus
        bus.on_goals = self._step
        self._board.write(robot.take())
        while go_on(robot.t):
            ready, _, _ = select.select([self._bus, self._board], [], [], _LONGEST)
            if self._bus in ready:
                bus.heard_at = self._bus.baud()
                bus.receive(robot.t, self._bus.read())
                self._bus.write(bus.transmit(math.inf))
            if self._board in ready:
                robot.hear(self._board.read())
            self._board.write(robot.take())

    def _step(self) -> None:
        self._faults.apply(self._robot, self._robot.due)
        self._robot.advance(self._robot.due)

    def _wait(self, now: float, physics: Physics) -> float:
        """Time until something happens by itself [s]."""
        answer = self._robot.bus.next_time()
        tick = math.inf if physics.busy else self._robot.due - now
        lump = math.inf if answer is None else max(answer - now, _LUMP)
        return max(min(tick, lump, _LONGEST), 0.0)
