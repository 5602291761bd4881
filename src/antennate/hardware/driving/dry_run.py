"""When the dry run is over, and whether torque may come on then."""

from __future__ import annotations

import math

from antennate.hardware.safety.trust import Trust


class DryRun:
    """Lasts its time, and longer until the antennae are trusted.

    Args:
        trust: What is known of the antennae.
        length: Its time [s].
        patience: By how much it is extended at most [s].
        arm: Whether torque is wanted afterwards.
        duration: Time from torque on to off [s].

    Attributes:
        over: When torque may come on [s], inf while it may not.
        end: When all is over [s], inf if not known yet.
        refusal: Why it has ended without torque although that was wanted.
    """

    def __init__(
        self, trust: Trust, length: float, patience: float, arm: bool, duration: float
    ) -> None:
        self._trust, self._length, self._patience = trust, length, patience
        self._arm, self._duration = arm, duration
        self.over = math.inf
        self.end = math.inf if arm else length
        self.refusal = ""

    def step(self, t: float) -> None:
        """Look at the antennae at a time [s] since the beginning."""
        if not self._arm or self.over < math.inf or self.refusal:
            return
        late = t >= self._length + self._patience
        if self._trust.refused or (late and self._trust.objections):
            self.refusal, self.end = "; ".join(self._trust.objections), t
        elif t >= self._length and not self._trust.objections:
            self.over, self.end = t, t + self._duration
