"""The host's time for the loop: monotonic, and never stepped by anybody."""

from __future__ import annotations

import time


class HostClock:
    """Seconds since it was made."""

    def __init__(self) -> None:
        self._begin = time.monotonic()

    def now(self) -> float:
        """Time [s]."""
        return time.monotonic() - self._begin

    def sleep_until(self, t: float) -> None:
        """Return at time t [s], at once if it has passed."""
        left = t - self.now()
        if left > 0:
            time.sleep(left)
