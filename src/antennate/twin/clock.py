"""The clock of a twin in lock-step: a client says until when time passes, and is told when it has.

What is on the other wires is taken, and counted, so that nothing depends on how fast they are.
"""

from __future__ import annotations

import select
import time
from collections.abc import Mapping

from antennate.errors import BadInputError
from antennate.hardware.ports import clock_words as words
from antennate.hardware.ports.clock_words import WIRES, GoOn, Hello, Sent, Wire
from antennate.params import ClockParams
from antennate.twin.ends import End
from antennate.twin.faults import Faults
from antennate.twin.lockstep import LockstepClock
from antennate.twin.robot import TwinRobot

_ROUNDING = 1e-9


class FaultyClock(LockstepClock):
    """Invented time in which things break when they are due."""

    def __init__(self, robot: TwinRobot, faults: Faults) -> None:
        super().__init__(robot)
        self._faults = faults

    def _until(self, t: float) -> None:
        while self._robot.due <= t + _ROUNDING:
            self._faults.apply(self._robot, self._robot.due)
            self._robot.advance(self._robot.due)
        super()._until(t)


class ClockServer:
    """Serves the clock of one robot; `select` takes it.

    Args:
        robot: The robot.
        faults: What goes wrong, and when.
        wires: Where its board and its bus are.
        end: Where the clock is.
        first: What the board has said at time 0, for a client that greets then.
        params: How long it waits.

    Attributes:
        held: A client has greeted: nothing else lets time pass any more.
    """

    def __init__(
        self,
        robot: TwinRobot,
        faults: Faults,
        wires: Mapping[Wire, End],
        end: End,
        first: bytes = b"",
        params: ClockParams | None = None,
    ) -> None:
        self._robot, self._wires, self._end = robot, wires, end
        self._faults, self._first = faults, first
        self._params = params or ClockParams()
        self._clock = FaultyClock(robot, faults)
        self._line = b""
        self._greeted = False
        self._came: dict[Wire, bytes] = {}
        self._left: dict[Wire, int] = {}
        self.held = False

    def fileno(self) -> int:
        """Ready to be read when a client has said something."""
        return self._end.fileno()

    def hear(self) -> None:
        """Do what has been asked for, and say so."""
        *lines, self._line = (self._line + self._end.read()).split(b"\n")
        if len(self._line) > words.LONGEST:
            lines, self._line = [*lines, self._line], b""
        for line in filter(None, lines):
            try:
                said = self._obey(words.request(line))
            except BadInputError as error:
                self._greeted, said = False, f"error {error}"
            if said:
                self._end.write(said.encode("ascii", "replace") + b"\n")

    def _obey(self, request: Hello | Sent | GoOn) -> str:
        places = ""
        if isinstance(request, Hello):
            self._begin()
            places = "".join(f" {words.place(self._wires[wire].path)}" for wire in WIRES)
        elif not self._greeted:
            raise BadInputError(f"expected `{words.HELLO}` first, found another word")
        elif isinstance(request, Sent):
            self._take(request)
            return ""
        else:
            self._go_on(request)
        self._say("esp32", self._robot.take())
        self._say("bus", self._clock.read(words.MOST, 0.0))
        counts = " ".join(str(self._left[wire]) for wire in WIRES)
        return f"at {self._clock.now()!r} {counts}{places}"

    def _begin(self) -> None:
        """Time is the client's from here on; what was on the wires before is gone."""
        end = time.monotonic() + self._params.arrival
        for name in WIRES:
            wire = self._wires[name]
            wire.clear()
            while wire.read() or (not wire.taken and self._ready(wire, end)):
                if time.monotonic() > end:
                    raise BadInputError(
                        f"expected silence on the wire {name} before the greeting is answered, "
                        f"found bytes for {self._params.arrival:g} s; does another program use it?"
                    )
            if not wire.taken:
                raise BadInputError(f"expected a client on the wire {name}, found none")
        self._came, self._left = dict.fromkeys(WIRES, b""), dict.fromkeys(WIRES, 0)
        if not self.held:
            self._robot.bus.on_goals = lambda: None
            self._clock = FaultyClock(self._robot, self._faults)
        self.held = self._greeted = True
        if self._robot.t == 0.0:
            self._say("esp32", self._first)

    def _take(self, sent: Sent) -> None:
        """Give the robot what the client has sent, once all of it has come."""
        wire, bus = self._wires[sent.wire], self._robot.bus
        end = time.monotonic() + self._params.arrival
        while len(self._came[sent.wire]) < sent.count and self._ready(wire, end):
            self._came[sent.wire] += wire.read()
        came = self._came[sent.wire]
        if len(came) < sent.count:
            raise BadInputError(
                f"expected {sent.count} bytes on the wire {sent.wire}, found {len(came)}; use the "
                "wires that this twin has named"
            )
        piece, self._came[sent.wire] = came[: sent.count], came[sent.count :]
        if sent.wire == "bus":
            bus.heard_at = wire.baud()
            self._clock.write(piece)
        else:
            self._robot.hear(piece)

    def _go_on(self, asked: GoOn) -> None:
        now, longest = self._clock.now(), self._params.stride
        if not now <= asked.t <= now + longest + _ROUNDING:
            raise BadInputError(
                f"expected a time of {now!r} to {longest:g} s later, found {asked.t!r}"
            )
        if asked.listens:
            self._clock.listen(asked.t)
        else:
            self._clock.sleep_until(asked.t)

    def _say(self, wire: Wire, data: bytes) -> None:
        if data and (sent := self._wires[wire].write(data)) != len(data):
            raise BadInputError(
                f"expected room for {len(data)} bytes on the wire {wire}, found {sent}; read it"
            )
        self._left[wire] += len(data)

    def _ready(self, wire: End, end: float) -> bool:
        """Something can be read from it before a time [s] has come."""
        return bool(select.select([wire], [], [], max(end - time.monotonic(), 0.0))[0])
