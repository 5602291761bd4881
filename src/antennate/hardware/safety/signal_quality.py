"""Quality of the readings of both antennae, from the counts as they came.

A channel may be broken, beyond its calibration or at a rail (`diagnosis`), its resting reading may
have drifted (`drift`), and before walking each antenna is touched once (`touch_check`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from antennate.hardware.safety.diagnosis import Band, ChannelDiagnosis, Finding
from antennate.hardware.safety.drift import Drift
from antennate.hardware.safety.touch_check import Ask, TouchCheck
from antennate.params.control import ConditioningParams, CurveParams
from antennate.params.safety import DriftParams, SupervisorParams, TouchCheckParams
from antennate.types import Contact

_SIDES = ("left", "right")
_RESTING = {Finding.OK, Finding.OUT_OF_CAL}


class SignalQuality:
    """Checks the readings of both antennae of one robot, also by touch if `touch` is given.

    Attributes:
        channels: Diagnosis of the left and the right antenna.
        drifts: Of the left and the right antenna.
    """

    def __init__(
        self,
        conditioning: ConditioningParams,
        drift: DriftParams | None = None,
        touch: TouchCheckParams | None = None,
        reaches: tuple[float | None, float | None] = (None, None),
        right: CurveParams | None = None,
        limits: SupervisorParams | None = None,
    ) -> None:
        bands = Band.of(conditioning, reaches[0]), Band.of(right or conditioning, reaches[1])
        hum_time = (limits or SupervisorParams()).hum_time
        self.channels = [ChannelDiagnosis(band, hum_time) for band in bands]
        self.check = None if touch is None else TouchCheck(touch, bands)
        self._together = (drift or DriftParams()).together
        self.drifts = [Drift(drift or DriftParams(), band) for band in bands]
        self._t = -math.inf

    def step(self, t: float, counts: Sequence[float], contact: Sequence[int]) -> None:
        """Take the newest readings.

        Args:
            t: Time at which they were taken [s].
            counts: Left and right as they came, rails included [counts]; NaN if there is none.
            contact: `Contact` that the controller saw in the tick before, left and right.
        """
        fresh, self._t = t > self._t, t
        found = [channel.step(t, c) for channel, c in zip(self.channels, counts, strict=True)]
        if self.check is not None and fresh:
            self.check.step(*(math.nan if r.finding.broken else r.taken for r in found))
        for drift, reading, seen in zip(self.drifts, found, contact, strict=True):
            resting = reading.taken if reading.finding in _RESTING else math.nan
            drift.step(t, resting, seen == Contact.FREE)
        if min(drift.bent_for for drift in self.drifts) >= self._together:
            for drift in self.drifts:
                drift.follow_bent()

    @property
    def counts(self) -> list[float]:
        """Readings for the contact decision, left and right [counts]; NaN where there is none."""
        return [channel.reading.counts for channel in self.channels]

    @property
    def findings(self) -> tuple[Finding, Finding]:
        """State of the left and the right channel."""
        left, right = (channel.reading.finding for channel in self.channels)
        return left, right

    @property
    def objections(self) -> tuple[str, ...]:
        """Reasons not to arm, empty if there is none."""
        if self.check is None or not self.check.objection:
            return ()
        return (self.check.objection if self.refused else self.broken or self.check.objection,)

    @property
    def broken(self) -> str:
        """Which antennae are broken and what to do, empty if none is."""
        return "; ".join(
            f"mend wire, plug or sensor of the {side} antenna, it is {finding.name}: "
            f"{finding.value}{f', {noise}' if noise else ''}"
            for side, finding, noise in zip(_SIDES, self.findings, self.noise, strict=True)
            if finding.broken
        )

    @property
    def noise(self) -> tuple[str, str]:
        """Size and frequency of the noise of the left and the right channel, empty if not NOISE."""
        left, right = (channel.noise_text for channel in self.channels)
        return left, right

    @property
    def refused(self) -> bool:
        """Whether the check has failed for good."""
        check = self.check
        return check is not None and check.ask is Ask.NOTHING and bool(check.objection)

    @property
    def drifted(self) -> str:
        """Sides beyond the band and by how much, empty if none is."""
        return ", ".join(
            f"{side} by {100 * drift.share:+.0f} % of the span"
            for side, drift in zip(_SIDES, self.drifts, strict=True)
            if drift.beyond
        )

    @property
    def status(self) -> str:
        """For the status line: the check, or what the person is to do, and the drift."""
        touch = "skipped" if self.check is None else "passed"
        if self.objections and self.check is not None:
            asked = self.broken or self.check.ask.value
            touch = f"({self.check.objection if self.refused else asked})"
        left, right = (100 * drift.share for drift in self.drifts)
        return f"touch={touch} drift={left:+.0f},{right:+.0f}%"
