"""Hardware code and twin in one invented time: waiting is what makes the twin go on."""

from __future__ import annotations

from antennate.twin.link import Link
from antennate.twin.robot import TwinRobot


class LockstepClock(Link):
    """The bus of a twin robot as a Port, and the clock of everything."""

    def __init__(self, robot: TwinRobot) -> None:
        super().__init__(robot.bus)
        self._robot, self._t = robot, robot.t

    def sleep_until(self, t: float) -> None:
        """Let time pass until t [s], if it has not yet."""
        if t > self.now():
            self._until(t)

    def _until(self, t: float) -> None:
        self._robot.advance(t)
        super()._until(t)


class BoardPort:
    """The board's stream of a twin robot as a Port."""

    def __init__(self, robot: TwinRobot, clock: LockstepClock) -> None:
        self._robot = robot
        self._clock = clock
        self._came = b""

    def write(self, data: bytes) -> None:
        """Send to the board."""
        self._robot.hear(data)

    def read(self, most: int, timeout: float) -> bytes:
        """What has come by now, or comes within `timeout` [s]."""
        if not self._came:
            self._came = self._robot.take()
        if not self._came and timeout > 0:
            self._clock.sleep(timeout)
            self._came = self._robot.take()
        came, self._came = self._came[:most], self._came[most:]
        return came

    def drain(self) -> int:
        """Throw away what has come; how many bytes that was."""
        count = len(self._came) + len(self._robot.take())
        self._came = b""
        return count
