"""Hardware code and twin in one invented time, which passes while the hardware code waits."""

from __future__ import annotations

from antennate.twin.faults import Faults
from antennate.twin.robot import ROUNDING, TwinRobot
from dynamixel_bus.simulated_wire import SimulatedWire


class LockstepClock(SimulatedWire):
    """The bus of a twin robot as a Port, and the clock of everything.

    Args:
        robot: The robot.
        faults: What goes wrong, and when; nothing by default.
    """

    def __init__(self, robot: TwinRobot, faults: Faults | None = None) -> None:
        super().__init__(robot.bus, t=robot.t)
        self.robot = robot
        self.faults = faults or Faults([], ())

    def move(self, t: float) -> None:
        """Servos move with the physics, not from one byte to the next."""
        while self.robot.due <= t + ROUNDING:
            self.faults.apply(self.robot, self.robot.due)
            self.robot.advance(self.robot.due)
        self.robot.advance(t)


class BoardPort:
    """The board's stream of a twin robot as a Port."""

    def __init__(self, robot: TwinRobot, clock: LockstepClock) -> None:
        self._robot = robot
        self._clock = clock
        self._came = b""

    def write(self, data: bytes) -> None:
        """Send to the board."""
        self._robot.receive(data)

    def read(self, most: int, timeout: float) -> bytes:
        """Bytes that have come by now, or come within `timeout` [s]."""
        if not self._came:
            self._came = self._robot.take()
        if not self._came and timeout > 0:
            self._clock.sleep(timeout)
            self._came = self._robot.take()
        came, self._came = self._came[:most], self._came[most:]
        return came

    def drain(self) -> int:
        """Throw away the bytes that have come; how many."""
        count = len(self._came) + len(self._robot.take())
        self._came = b""
        return count
