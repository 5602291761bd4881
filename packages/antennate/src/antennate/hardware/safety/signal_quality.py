"""Quality of the readings of both antennae: their channels, their drift, and the check by touch.

Drift: readings without contact include light touches, but most of the time nothing bends the flex
sensor. So their low quantile is followed in small steps, up by `speed` and down by more, such that
the share `quantile` of the readings lies nearer to straight. A touch of some seconds hardly moves
it. That is slow, and ends where drift looks like contact. Two things no touch does are known
sooner: readings that stay beyond the straight end, and both antennae that stay bent together.

Check by touch, before arming: bend the left antenna, let go, bend the right one, let go. It finds
channels that are swapped and flex sensors whose reading runs the wrong way.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from enum import Enum

from antennate.hardware.safety.channel import Band, ChannelDiagnosis, Finding
from antennate.params.control import ConditioningParams, CurveParams
from antennate.params.safety import DriftParams, SupervisorParams, TouchCheckParams
from antennate.types import Contact

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


_NAMES = ("left", "right")


class Ask(Enum):
    """What the person is asked to do next."""

    REST = "let go of both antennae"
    LEFT = "bend the left antenna towards the tail"
    RIGHT = "bend the right antenna towards the tail"
    NOTHING = "the check is over"


class TouchCheck:
    """Follows the check, one pair of readings after the other.

    Args:
        params: What counts as a touch and as rest.
        bands: Calibrated ranges of the left and the right channel.
    """

    def __init__(self, params: TouchCheckParams, bands: tuple[Band, Band]) -> None:
        self._params, self._bands = params, bands
        self.ask = Ask.REST
        self._against = ""
        self._side = 0
        self._run: tuple[str, int] = ("", 0)

    @property
    def objection(self) -> str:
        """Why not to arm, empty once the check has passed."""
        if self.ask is Ask.NOTHING:
            return self._against
        felt = "not seen at rest" if self.ask is Ask.REST else "no bend felt"
        return f"the antennae were not yet checked by touch, {felt}: {self.ask.value}"

    def step(self, left: float, right: float) -> Ask:
        """Take the newest readings [counts], NaN if unknown; returns what to do next."""
        if self.ask is Ask.NOTHING:
            return self.ask
        seen = self._see([b.level(c) for b, c in zip(self._bands, (left, right), strict=True)])
        count = self._run[1] + 1 if seen == self._run[0] else 1
        self._run = (seen, count)
        if seen and count >= self._params.readings:
            self._follow(seen)
        return self.ask

    def _see(self, levels: list[float]) -> str:
        """What the readings show: rest, right, swapped or reversed; empty if unclear."""
        if not all(map(math.isfinite, levels)):
            return ""
        still = [abs(level) < self._params.still for level in levels]
        if all(still):
            return "rest"
        bent = [abs(level) >= self._params.level for level in levels]
        if sum(bent) != 1 or sum(still) != 1:
            return ""
        if not bent[self._side]:
            return "swapped"
        return "right" if levels[self._side] > 0 else "reversed"

    def _follow(self, seen: str) -> None:
        if self.ask is Ask.REST:
            if seen == "rest":
                self.ask = (Ask.LEFT, Ask.RIGHT)[self._side]
        elif seen == "right" and self._side == 0:
            self.ask, self._side = Ask.REST, 1
        elif seen == "right":
            self.ask = Ask.NOTHING
        elif seen in ("swapped", "reversed"):
            self._against = self._why(seen)
            self.ask = Ask.NOTHING

    def _why(self, seen: str) -> str:
        name, other = _NAMES[self._side], _NAMES[1 - self._side]
        if seen == "swapped":
            return f"the {name} antenna was asked for and the {other} channel answered: swap them"
        return (
            f"the reading of the {name} antenna runs against its calibration: check the divider "
            "or calibrate this flex sensor"
        )


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
        limits = limits or SupervisorParams()
        covered, hum_time = limits.covered, limits.hum_time
        left = Band.of(conditioning, reaches[0], covered)
        bands = left, Band.of(right or conditioning, reaches[1], covered)
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
        readings = [channel.step(t, c) for channel, c in zip(self.channels, counts, strict=True)]
        if self.check is not None and fresh:
            self.check.step(*(math.nan if r.finding.broken else r.taken for r in readings))
        for drift, reading, seen in zip(self.drifts, readings, contact, strict=True):
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
