"""How far the resting reading of an antenna has drifted from the calibrated one.

Readings without contact include light touches, but most of the time nothing bends the flex sensor.
So their low quantile is followed in small steps, up by `speed` and down by more, such that the
share `quantile` of the readings lies nearer to straight. A touch of some seconds hardly moves it.
"""

from __future__ import annotations

import math

from antennate.hardware.safety.diagnosis import Band
from antennate.params.endurance import DriftParams

_LONGEST = 0.1
"""Longest time that one reading stands for [s]."""


class Drift:
    """Follows one antenna, which is at rest at the straight end of its calibrated range.

    Attributes:
        share: Drift in spans, positive towards the bent end.
        beyond: Whether it is more than the band allows.
    """

    def __init__(self, params: DriftParams, band: Band) -> None:
        self._params, self._band = params, band
        self._down = params.speed * (1.0 - params.quantile) / params.quantile
        self._t = math.nan
        self.share = 0.0
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
        if not elapsed > 0.0 or not free or not math.isfinite(counts):
            return
        elapsed = min(elapsed, _LONGEST)
        rises = self._band.level(counts) > self.share
        self.share += elapsed * (self._params.speed if rises else -self._down)
        bound = self._params.band - (self._params.rise if self.beyond else 0.0)
        self.beyond = abs(self.share) > bound
