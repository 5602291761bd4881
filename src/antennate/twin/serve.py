"""A twin robot on two wires, in real time: no client can tell it from the real one.

Or in lock-step with a client that takes all the time it wants, and always gets the same.
"""

from __future__ import annotations

import math
import select
import time
from collections.abc import Callable

from antennate.hardware.ports.clock_words import Wire
from antennate.params import TwinParams
from antennate.twin.clock import ClockServer
from antennate.twin.ends import End, Terminal
from antennate.twin.faults import Faults
from antennate.twin.physics import Physics
from antennate.twin.robot import TwinRobot

_LONGEST = 1.0
_LUMP = TwinParams().lump
"""Answers leave in lumps of this time [s], as those of a fast USB adapter do."""


class TwinServer:
    """Serves a robot while it is entered and run.

    Args:
        robot: The robot; only the server touches it.
        faults: What goes wrong, and when.
        board: The board's end, a pseudo-terminal by default; it is closed on leaving.
        bus: The servos' end, likewise.
        clock: The clock's end for `run_lockstep`, likewise; none is served if not given.

    Attributes:
        late: Worst lateness of a control tick of the twin itself [s].
    """

    def __init__(
        self,
        robot: TwinRobot,
        faults: Faults,
        board: End | None = None,
        bus: End | None = None,
        clock: End | None = None,
    ) -> None:
        self._robot = robot
        self._faults = faults
        self._bus = bus or Terminal()
        self._board = board or Terminal()
        self._clock = clock
        self.late = 0.0

    @property
    def paths(self) -> dict[str, str]:
        """Where the board, the bus and the clock, if there is one, are."""
        clock = {} if self._clock is None else {"clock": self._clock.path}
        return {"esp32": self._board.path, "bus": self._bus.path} | clock

    def __enter__(self) -> TwinServer:
        return self

    def __exit__(self, *_: object) -> None:
        for end in (self._bus, self._board, self._clock):
            if end is not None:
                end.close()

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

        Nothing passes otherwise, and the bus answers at once. A client that takes the clock is the
        only one to let time pass from then on.
        """
        robot, bus, first = self._robot, self._robot.bus, self._robot.take()
        bus.on_goals = self._step
        self._board.write(first)
        clock = None
        if self._clock is not None:
            wires: dict[Wire, End] = {"esp32": self._board, "bus": self._bus}
            clock = ClockServer(robot, self._faults, wires, self._clock, first)
        while go_on(robot.t):
            if clock is None or not clock.held:
                self._serve_goals(clock)
            elif select.select([clock], [], [], _LONGEST)[0]:
                clock.hear()

    def _serve_goals(self, clock: ClockServer | None) -> None:
        """Wait for a client, and do what it asks for."""
        robot, bus = self._robot, self._robot.bus
        ends = [self._bus, self._board, *([] if clock is None else [clock])]
        ready, _, _ = select.select(ends, [], [], _LONGEST)
        if clock in ready and clock is not None:
            clock.hear()
            return
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
