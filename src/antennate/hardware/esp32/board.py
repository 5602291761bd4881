"""The antenna board behind its port, for a loop that never waits: its newest reading."""

from __future__ import annotations

import math

import numpy as np

from antennate.hardware.esp32.clock import Timed
from antennate.hardware.esp32.frame import SAMPLE_FRAME_SIZE, encode_request
from antennate.hardware.esp32.listener import CHUNK, Listener
from antennate.hardware.ports.port import Port, PortError
from antennate.types import Floats

BOARD_BAUD = 115_200
"""Bits per second of the board's port: MicroPython on an ESP32, UART 0."""
KEPT = 64 * SAMPLE_FRAME_SIZE
"""Most bytes of a backlog that are looked at: 0.64 s; what is older is not acted upon (assumed)."""
_CHUNKS = 64
"""Most chunks read at once: more than Linux keeps for a line."""


class Board(Listener):
    """Reads what has come from a board. If its port is gone, it is merely silent.

    Args:
        port: Its wire.
        age_limit: Readings older than this are not to be acted upon [s].

    Attributes:
        skipped: Bytes of backlogs that were not looked at.
        trouble: What is wrong with its port, empty if nothing is.
    """

    def __init__(self, port: Port, age_limit: float) -> None:
        super().__init__()
        self.skipped = 0
        self.trouble = ""
        self._port = port
        self._limit = age_limit
        self._lost_before = 0

    @property
    def lost(self) -> int:
        """Samples that never came since `count_anew`; 0 at least, though some may come late."""
        return max(0, self.clock.lost - self._lost_before)

    def count_anew(self, now: float) -> None:
        """Forget what was lost by now [s], as while servos were looked for and nobody read."""
        self.poll(now)
        self._lost_before = self.clock.lost

    def poll(self, now: float) -> int:
        """Take the newest of what has come by now [s]; how many usable samples that were."""
        return len(self.hear(self._read(), now))

    def _read(self) -> bytes:
        """What has come, of a backlog the end; a board that is back is asked to greet."""
        came = b""
        try:
            for _ in range(_CHUNKS):
                part = self._port.read(CHUNK, 0.0)
                if self.trouble:
                    self._port.write(encode_request())
                    self.trouble = ""
                if not part:
                    break
                came += part
                self.skipped += max(len(came) - KEPT, 0)
                came = came[-KEPT:]
        except PortError as error:
            self.trouble = str(error)
        return came

    def newest(self, now: float) -> Timed | None:
        """The newest usable sample, or None if it is too old or its age is not known."""
        return self.clock.newest if self.clock.age(now) <= self._limit else None


def counts_of(timed: Timed | None) -> Floats:
    """Readings of a sample as they came [counts], shape (1, 2); NaN where there is none."""
    if timed is None:
        return np.full((1, 2), math.nan)
    return np.array([[timed.sample.left, timed.sample.right]], float)
