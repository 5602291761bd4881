"""The real robot as a `Robot`: the newest reading of its board, commands to its actuators."""

from __future__ import annotations

import numpy as np

from antennate.hardware.actuators import Actuators
from antennate.hardware.esp32.board import Board, counts_of
from antennate.hardware.esp32.clock import Timed
from antennate.types import AntennaFrame, Clock, JointCommand


class HardwareRobot:
    """One robot. A reading that is missing or too old is NaN.

    Frames carry the board's own time since the first reading. So a delay on the way to the host, or
    a busy host, does not change it. It never goes back.

    Attributes:
        clock: The host's time, which never steps.
        used: Usable samples that the last reading found.
    """

    def __init__(self, board: Board, actuators: Actuators, clock: Clock) -> None:
        self.clock = clock
        self.used = 0
        self._board, self._actuators = board, actuators
        self._stamp: Timed | None = None
        self._stamp_now: float | None = None
        self._stamp_t = self._t = 0.0

    def read(self) -> AntennaFrame:
        """The newest reading of both antennae."""
        now = self.clock.now()
        self.used = self._board.poll(now)
        timed = self._board.newest(now)
        self._t = max(self._t, self._time(timed, now))
        return AntennaFrame(t=np.array([self._t]), counts=counts_of(timed))

    def _time(self, timed: Timed | None, now: float) -> float:
        """The board's time [s]; the host's clock where the board has none or restarts."""
        last = self._stamp
        if self._stamp_now is None:
            self._stamp_now = now
        since = now - self._stamp_now
        if timed is None:
            return self._stamp_t + since
        if last is None or timed.epoch != last.epoch:
            self._stamp_t += since
            self._stamp, self._stamp_now = timed, now
            return self._stamp_t
        return self._stamp_t + 1e-6 * (timed.elapsed_us - last.elapsed_us)

    def write(self, command: JointCommand) -> None:
        """Send a command to the actuators, which have torque; see `Actuators.command`."""
        self._actuators.command(command)
