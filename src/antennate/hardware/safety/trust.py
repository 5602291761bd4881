"""Whether what the antennae say can be trusted: by touch before walking, by drift while walking."""

from __future__ import annotations

import math
from collections.abc import Sequence

from antennate.hardware.safety.diagnosis import Band, Finding, Reading
from antennate.hardware.safety.drift import Drift
from antennate.hardware.safety.touch_check import Ask, TouchCheck
from antennate.params import ConditioningParams, DriftParams, TouchCheckParams
from antennate.types import Contact

_SIDES = ("left", "right")
_RESTING = {Finding.OK, Finding.OUT_OF_CAL}


class Trust:
    """Follows both antennae of one robot.

    Args:
        conditioning: Their calibrated range.
        drift: How drift is followed.
        touch: What counts as a touch, None if they are not checked by touch.

    Attributes:
        check: The check by touch, None if it is skipped.
        drifts: Of the left and the right antenna.
    """

    def __init__(
        self,
        conditioning: ConditioningParams,
        drift: DriftParams | None = None,
        touch: TouchCheckParams | None = None,
    ) -> None:
        band = Band(conditioning.counts_low, conditioning.counts_high, conditioning.polarity)
        self.check = None if touch is None else TouchCheck(touch, (band, band))
        self.drifts = [Drift(drift or DriftParams(), band) for _ in _SIDES]
        self._t = -math.inf

    def step(
        self,
        t: float,
        counts: Sequence[float],
        readings: Sequence[Reading],
        contact: Sequence[int],
    ) -> None:
        """Take the newest readings, as they came and as they were diagnosed.

        Args:
            t: Time at which they were taken [s].
            counts: Left and right [counts]; NaN if unknown.
            readings: What the diagnosis made of them.
            contact: `Contact` that the controller saw in the tick before, left and right.
        """
        fresh, self._t = t > self._t, t
        if self.check is not None and fresh:
            self.check.step(*counts)
        for drift, count, reading, seen in zip(self.drifts, counts, readings, contact, strict=True):
            usable = count if reading.finding in _RESTING else math.nan
            drift.step(t, usable, seen == Contact.FREE)

    @property
    def objections(self) -> tuple[str, ...]:
        """Why not to arm, empty if nothing speaks against it."""
        return () if self.check is None or not self.check.objection else (self.check.objection,)

    @property
    def refused(self) -> bool:
        """Whether the check has failed: to go on with it is of no use."""
        return self.check is not None and self.check.ask is Ask.NOTHING and bool(self.objections)

    @property
    def drifted(self) -> str:
        """Sides beyond the band and by how much, empty if none is."""
        return ", ".join(
            f"{side} by {100 * drift.share:+.0f} % of the span"
            for side, drift in zip(_SIDES, self.drifts, strict=True)
            if drift.beyond
        )

    @property
    def said(self) -> str:
        """For the status line: the check, or what the person is to do, and the drift."""
        touch = "skipped" if self.check is None else "passed"
        if self.objections and self.check is not None:
            touch = f"({self.check.objection if self.refused else self.check.ask.value})"
        left, right = (100 * drift.share for drift in self.drifts)
        return f"touch={touch} drift={left:+.0f},{right:+.0f}%"
