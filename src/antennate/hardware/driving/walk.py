"""How long a robot walked, and what it did meanwhile."""

from __future__ import annotations

from collections import defaultdict

from antennate.hardware.driving.session import Session
from antennate.types import Maneuver


class Walk:
    """Adds up the time of the ticks in which a command was sent.

    Attributes:
        time: All of it [s].
    """

    def __init__(self) -> None:
        self.time = 0.0
        self._spent: dict[int, float] = defaultdict(float)
        self._sent = 0
        self._last: float | None = None

    def watch(self, session: Session) -> None:
        """Count a tick."""
        now = session.clock.now()
        if self._last is not None and session.tally.sent > self._sent:
            self.time += now - self._last
            self._spent[session.control.decision.maneuver] += now - self._last
        self._sent, self._last = session.tally.sent, now

    @property
    def shares(self) -> dict[str, float]:
        """Share of that time, by maneuver."""
        return {m.name: self._spent[m] / self.time for m in Maneuver} if self.time else {}
