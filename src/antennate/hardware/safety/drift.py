"""How far the resting reading of an antenna has drifted from the calibrated one.

Readings without contact include light touches, but most of the time nothing bends the flex sensor.
So their low quantile is followed in small steps, up by `speed` and down by more, such that the
share `quantile` of the readings lies nearer to straight. A touch of some seconds hardly moves it.

That is slow, and ends where drift looks like contact. Two things no touch does are known sooner:
readings that stay beyond the straight end, and both antennae that stay bent together for long.
"""

from __future__ import annotations

import math

from antennate.hardware.safety.diagnosis import Band
from antennate.params.safety import DriftParams

_LONGEST = 0.1
"""Longest time that one reading stands for [s]."""
_SECOND = 1.0


class Drift:
    """Follows one antenna, which is at rest at the straight end of its calibrated range.

    Attributes:
        share: Drift in spans, positive towards the bent end.
        beyond: Whether it is more than the band allows.
        bent_for: Time for which it has been bent beyond the band [s].
    """

    def __init__(self, params: DriftParams, band: Band) -> None:
        self._params, self._band = params, band
        self._down = params.speed * (1.0 - params.quantile) / params.quantile
        self._t = math.nan
        self._begin_second()
        self.share, self.bent_for, self._nearest = 0.0, 0.0, math.inf
        self.beyond = False

    def step(self, t: float, counts: float, free: bool) -> None:
        """Take a reading.

        Args:
            t: Time at which it was taken [s]; one not newer than the last is not counted again.
            counts: The reading as it came [counts]; NaN if it cannot be used.
            free: Whether the antenna touches nothing, as its contact detector says.
        """
        elapsed = t - self._t
        self._t = t
        if not elapsed > 0.0 or not math.isfinite(counts):
            return
        elapsed, level = min(elapsed, _LONGEST), self._band.level(counts)
        if free:
            rises = level > self.share
            self.share += elapsed * (self._params.speed if rises else -self._down)
        self._follow_second(elapsed, level)
        bound = self._params.band - (self._params.rise if self.beyond else 0.0)
        self.beyond = abs(self.share) > bound

    def follow_bent(self) -> None:
        """What both antennae showed together was drift."""
        self.share = max(self.share, self._nearest)

    def _begin_second(self) -> None:
        self._elapsed, self._least, self._most = 0.0, math.inf, -math.inf

    def _follow_second(self, elapsed: float, level: float) -> None:
        """Look at the readings of each second together."""
        self._elapsed += elapsed
        self._least, self._most = min(self._least, level), max(self._most, level)
        if self._elapsed < _SECOND:
            return
        if self._most < -self._params.band:
            self.share = min(self.share, self._most)
        if self._least > self._params.band:
            self.bent_for += _SECOND
            self._nearest = min(self._nearest, self._least)
        else:
            self.bent_for, self._nearest = 0.0, math.inf
        self._begin_second()
