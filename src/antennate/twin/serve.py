"""A twin robot on two pseudo-terminals, in real time: no client can tell it from the real one."""

from __future__ import annotations

import os
import select
import termios
import time
import tty
from collections.abc import Callable
from types import TracebackType

from antennate.twin.faults import Faults
from antennate.twin.robot import TwinRobot

_CHUNK = 4096


class _Terminal:
    """One pseudo-terminal; whoever opens `path` talks to us."""

    def __init__(self) -> None:
        self.master, self._slave = os.openpty()
        tty.setraw(self._slave, termios.TCSANOW)
        os.set_blocking(self.master, False)
        self.path = os.ttyname(self._slave)

    def read(self) -> bytes:
        """What has come."""
        try:
            return os.read(self.master, _CHUNK)
        except BlockingIOError:
            return b""

    def write(self, data: bytes) -> None:
        """Say it; what finds no room because nobody listens is lost, as on a real line."""
        try:
            os.write(self.master, data)
        except BlockingIOError:
            return

    def close(self) -> None:
        """Both ends."""
        os.close(self.master)
        os.close(self._slave)


class TwinServer:
    """Serves a robot while it is entered and run.

    Args:
        robot: The robot; only the server touches it.
        faults: What goes wrong, and when.

    Attributes:
        late: Worst lateness of a control tick of the twin itself [s].
    """

    def __init__(self, robot: TwinRobot, faults: Faults) -> None:
        self._robot = robot
        self._faults = faults
        self._bus = _Terminal()
        self._board = _Terminal()
        self.late = 0.0

    @property
    def paths(self) -> dict[str, str]:
        """Where the board and the bus are."""
        return {"esp32": self._board.path, "bus": self._bus.path}

    def __enter__(self) -> TwinServer:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._bus.close()
        self._board.close()

    def run(self, go_on: Callable[[float], bool]) -> None:
        """Serve until `go_on`, told the twin's time [s], says no."""
        begin = time.monotonic()
        robot = self._robot
        ends = [self._bus.master, self._board.master]
        while go_on(now := time.monotonic() - begin):
            wait = robot.next_time() - now
            ready, _, _ = select.select(ends, [], [], max(wait, 0.0))
            now = time.monotonic() - begin
            self.late = max(self.late, now - robot.next_time())
            self._faults.apply(robot, now)
            robot.advance(now)
            if self._bus.master in ready:
                robot.bus.receive(now, self._bus.read())
            if self._board.master in ready:
                robot.hear(self._board.read())
            if answers := robot.bus.transmit(now):
                self._bus.write(answers)
            if stream := robot.take():
                self._board.write(stream)
