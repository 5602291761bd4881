"""When a client begins to use the servo bus: with the first packet after a pause."""

from __future__ import annotations

import math
from collections.abc import Sequence

from antennate.twin.registers import Servo

QUIET = 0.5
"""Silence of the bus after which a packet is the first of another client, or of its next step [s]:
five times what the watchdogs of servos with torque allow, less than a program takes to start."""


class Visit:
    """The present client.

    Attributes:
        begun: When it began [s], inf before the first.
    """

    def __init__(self) -> None:
        self.begun = math.inf
        self._last = -math.inf

    def step(self, t: float, servos: Sequence[Servo]) -> bool:
        """Look at the bus at the time t [s], at least ten times a second; True if one has begun."""
        newest = max(servo.last_fed for servo in servos)
        if newest <= max(self._last, 0.0):  # 0 where no packet has come
            return False
        begins = newest - self._last > QUIET
        self._last = newest
        if begins:
            self.begun = t
        return begins
