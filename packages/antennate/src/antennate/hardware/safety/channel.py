"""One channel: the only judge of whether a reading may be used, and what is wrong where not.

Nothing here reads a clock. A reading that jumps, or lies far outside the calibrated range, is bad.
The last good one replaces it for a few readings, so a spike changes nothing. A jump is accepted
once three readings in a row agree on it. Without a reading to use, the counts are NaN.

The flex sensor is the upper half of a divider, so one torn off its wire reads 0 like a short to
ground, and both are SHORT_LO. OPEN is a pin of the converter that is connected to nothing: its
readings wander over the whole range. NOISE is narrower than that, or a hum. A hum stays for a time
in which it is not seen: near half the rate of the readings it beats with them and seems to stop.

A hum is a sine far faster than an antenna bends. Any sine y satisfies y[n] + y[n-2] = c y[n-1]
with c = 2 cos(2 pi f / rate), so c is fitted to ten readings, and what it leaves says how much of
them is one sine (Prony's method). Sampling hides the true frequency: f, rate - f and so on give the
same readings, which is what the words say.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from itertools import pairwise
from statistics import median

import numpy as np

from antennate.antenna.calibration import REACH
from antennate.antenna.sensor import FULL_SCALE
from antennate.control.conditioning import HIGH_RAIL, LOW_RAIL
from antennate.errors import CalibrationError
from antennate.params.control import CurveParams
from antennate.params.safety import SupervisorParams

_REST = 0.01
"""Share of the energy that a hum leaves; white noise leaves less once in 30,000 (computed)."""
_SLOWEST = 0.25
"""Slowest hum [samples^-1]: 25 Hz at 100 Hz. Antennae ring at 2.4 Hz and bend fully in 30 ms."""
_SAME = 0.025
"""Frequencies nearer than this to half the rate are written as one [samples^-1]; ten readings, some
from before the hum, tell no finer."""
WINDOW = 10
"""Readings from which a hum or a broken wire is told: 100 ms at 100 Hz, as long as it may take."""


@dataclass(frozen=True, slots=True)
class Noise:
    """Noise of some readings.

    Attributes:
        size: Half of what lies between the lowest and the highest [counts].
        frequency: Of a hum [samples^-1], 0.25 to 0.5; NaN if it is none.
    """

    size: float
    frequency: float = math.nan

    @property
    def hums(self) -> bool:
        """Whether it is one sine."""
        return math.isfinite(self.frequency)

    def text(self, rate: float) -> str:
        """Size and frequency in words, at so many samples a second [Hz]."""
        size = f"±{self.size:.0f} counts"
        if not self.hums:
            return f"{size} of no one frequency"
        slow, fast = self.frequency * rate, (1.0 - self.frequency) * rate
        if fast - slow < 2.0 * _SAME * rate:
            return f"{size} at {0.5 * rate:.0f} Hz or an alias of it"
        return f"{size} at {slow:.0f} or {fast:.0f} Hz or an alias of them"


def noise_of(readings: Sequence[float]) -> Noise:
    """Noise of ten readings in a row [counts], which are finite."""
    y = np.array(readings)
    size = 0.5 * float(np.ptp(y))
    outer, middle = y[2:] + y[:-2], y[1:-1]
    outer, middle = outer - outer.mean(), middle - middle.mean()
    energy = float(middle @ middle)
    if energy == 0.0:
        return Noise(size)
    c = float(outer @ middle) / energy
    rest = outer - c * middle
    y = y - y.mean()
    whole = float(y[2:] @ y[2:] + y[:-2] @ y[:-2]) + c * c * energy
    frequency = math.acos(min(max(0.5 * c, -1.0), 1.0)) / (2.0 * math.pi)
    half = len(y) // 2
    steady = min(float(np.ptp(y[:half])), float(np.ptp(y[half:]))) > size
    hums = steady and float(rest @ rest) < _REST * whole and frequency > _SLOWEST
    return Noise(size, frequency if hums else math.nan)


OPEN_BAD = 6
"""Bad readings in the window that mean an open wire: a floating input fails one window in 10^4, and
20 % of spikes pass 99 in 100 (assumed)."""
SATURATED = 3
"""Readings in the window at the rail of a bent sensor that mean saturation: more than 1 % of spikes
brings (assumed)."""
STUCK = 100
"""Equal readings in a row that mean a stuck converter: 1 s; a sensor at rest has noise of 2 to 3
counts, so they do not happen (assumed)."""
NEARLY_STUCK = 150
"""Readings in a row within two counts that mean the same, for a converter whose last bit toggles:
1.5 s; with noise of 0.9 counts they come once in four days, and the quietest of real sensors, 12
bits, 3.3 V, had 1.7 counts (computed, measured)."""
_NEAR = 2.0
"""Farthest apart that such readings are [counts]."""
HIDDEN = 0.15
"""Amplitude of a noise that hides the flex sensor [spans]: from there on the check by touch sees no
rest, and readings are doubted as jumps (assumed)."""
_FLOATING = FULL_SCALE / 3
"""Least that the readings of a floating wire differ in the window [counts]: one window of white
noise over the whole range in 3000 differs less (computed)."""
_MEMORY = 1.0
"""Time for which wide readings are still a hum where some that were skipped break its sine [s]."""
JUMP = 1 / 3
"""Change between readings that is doubted [spans]: a flex sensor bends fully in three or more
(assumed)."""
AGREE = 3
"""Doubted readings in a row that agree and are believed: three spikes that do are rarer than one in
10^7 readings at 1 % (assumed). At most one more than LONGEST_HOLD."""
LONGEST_HOLD = 4
"""Bad readings in a row that the last good one stands in for: 40 ms, below the age at which data
are stale (assumed)."""
SHARE_WINDOW = 100
"""Readings over which bad ones are counted: 1 s (assumed)."""
SHARE = 0.2
"""Share of bad readings above which a side is degraded; averages are no longer worth much then
(assumed)."""
MARGIN = 20.0
"""Reading beyond the calibrated range still taken for noise [counts]: eight sigma (assumed)."""
BEYOND = REACH
"""Distance from the calibrated range up to which a reading is believed [spans]; to the bent side a
calibration may reach farther."""
GAP = 0.1
"""Time without a reading after which nothing before it is remembered [s]: twice the age at which
data are stale (assumed)."""


class Finding(Enum):
    """What one channel is found to be."""

    OK = "ok"
    OUT_OF_CAL = "beyond the calibrated range"
    SPIKY = "too many bad readings"
    SATURATED = "at the rail of a bent flex sensor"
    LOST = "no good reading for too long"
    STUCK = "always the same reading"
    NOISE = "noise that hides the flex sensor"
    OPEN = "floating, wire open"
    SHORT_LO = "short to ground, or flex sensor torn off"
    SHORT_HI = "short to supply"

    @property
    def usable(self) -> bool:
        """Whether contact may be decided on such a channel."""
        return self in _USABLE

    @property
    def broken(self) -> bool:
        """Whether wire, plug or sensor has to be mended."""
        return self in _BROKEN


_BROKEN = {Finding.STUCK, Finding.NOISE, Finding.OPEN, Finding.SHORT_LO, Finding.SHORT_HI}
_USABLE = {Finding.OK, Finding.OUT_OF_CAL, Finding.SPIKY, Finding.SATURATED}


@dataclass(frozen=True, slots=True)
class Band:
    """Calibrated range of a channel [counts]; polarity is 1 if readings rise with flex, else -1.

    Readings are believed up to BEYOND outside it, to the bent side up to `reach` if given [spans].
    The curve holds up to `covered` beyond its bent end [spans].
    """

    low: float
    high: float
    polarity: int
    reach: float | None = None
    covered: float = 0.0

    @classmethod
    def of(
        cls, conditioning: CurveParams, reach: float | None = None, covered: float = 0.0
    ) -> Band:
        """The range of a calibration."""
        low, high = conditioning.counts_low, conditioning.counts_high
        return cls(low, high, conditioning.polarity, reach, covered)

    def covers(self, counts: float) -> bool:
        """Whether a reading [counts] is within the range, but for noise."""
        bent = MARGIN + self.covered * self.span
        below, above = (bent, MARGIN) if self.polarity < 0 else (MARGIN, bent)
        return self.low - below <= counts <= self.high + above

    def believes(self, counts: float) -> bool:
        """Whether a flex sensor can give a reading [counts], as far as is known."""
        reach = BEYOND if self.reach is None else self.reach
        below, above = (reach, BEYOND) if self.polarity < 0 else (BEYOND, reach)
        return self.low - below * self.span <= counts <= self.high + above * self.span

    @property
    def span(self) -> float:
        """Distance from the lowest to the highest reading [counts]."""
        return self.high - self.low

    def level(self, counts: float) -> float:
        """Change from the straight end on, in spans; negative is the wrong way."""
        straight = self.low if self.polarity > 0 else self.high
        return self.polarity * (counts - straight) / self.span


@dataclass(frozen=True, slots=True)
class Reading:
    """A reading after diagnosis.

    Attributes:
        counts: Reading to use [counts]; NaN where there is none.
        taken: Reading as it came [counts]; NaN if it is beyond what a flex sensor can give.
    """

    counts: float
    finding: Finding
    taken: float = math.nan


class ChannelDiagnosis:
    """Diagnoses the readings of one antenna by its calibrated range.

    A hum that was seen stays in force for `hum_time` [s].

    Attributes:
        reading: The newest result; LOST before the first.
        counted: Readings by the finding they got.
        bad: Readings not believed.
        outside: Readings beyond the band that were believed.
        noise: The noise of a channel that is NOISE: of a hum the largest while it is in force.
    """

    def __init__(self, band: Band, hum_time: float = SupervisorParams().hum_time) -> None:
        if not LOW_RAIL < band.low < band.high < HIGH_RAIL:
            raise CalibrationError(
                f"a calibrated range must lie within {LOW_RAIL:g} and {HIGH_RAIL:g} "
                f"counts, so that a broken wire can be told from a flex sensor; found {band.low:g} "
                f"to {band.high:g}; choose another divider resistor"
            )
        self._band, self._hum_time = band, hum_time
        self.noise, self._hummed, self._usual = Noise(0.0), -math.inf, math.nan
        self.counted = dict.fromkeys(Finding, 0)
        self.bad = 0
        self.outside = 0
        self.reset()

    def reset(self) -> None:
        """Forget all readings, but neither the counters nor a hum."""
        self.reading = Reading(math.nan, Finding.LOST)
        self._t = -math.inf
        self._raw: deque[float] = deque(maxlen=WINDOW)
        self._times: deque[float] = deque(maxlen=WINDOW)
        self._bad: deque[bool] = deque(maxlen=WINDOW)
        self._share: deque[bool] = deque(maxlen=SHARE_WINDOW)
        self._outside: deque[bool] = deque(maxlen=WINDOW)
        self._good = math.nan
        self._bad_run = LONGEST_HOLD + 1
        self._doubted: list[float] = []
        self._equal = self._near_equal = 0
        self._least = self._most = math.nan

    def step(self, t: float, counts: float) -> Reading:
        """Take a reading.

        Args:
            t: Time at which it was taken [s]; one not newer than the last is not counted again.
            counts: The reading [counts]; NaN where one is known to be missing.
        """
        if not t > self._t:
            return self.reading
        if t - self._t > GAP:
            self.reset()
        self._t = t
        self._equal = self._equal + 1 if self._raw and counts == self._raw[-1] else 1
        self._raw.append(counts)
        self._times.append(t)
        self._count_near(counts)
        self._believe(counts)
        finding, good, band = self._find(), self._good, self._band
        if finding is Finding.SATURATED:  # how far a flex sensor at the rail is bent is not known
            good = min(max(good, band.low), band.high)
        self.counted[finding] += 1
        self.reading = Reading(
            good if finding.usable else math.nan,
            finding,
            counts if band.believes(counts) else math.nan,
        )
        return self.reading

    @property
    def noise_text(self) -> str:
        """Size and frequency of the noise of a channel that is NOISE, empty for others."""
        if self.reading.finding is not Finding.NOISE:
            return ""
        return self.noise.text(1.0 / self._usual)

    def _count_near(self, counts: float) -> None:
        """Count readings in a row that lie within two counts."""
        self._least, self._most = min(self._least, counts), max(self._most, counts)
        if self._most - self._least <= _NEAR and not math.isnan(counts):
            self._near_equal += 1
        else:
            self._least = self._most = counts
            self._near_equal = 1

    def _near(self, counts: float, other: float) -> bool:
        return abs(counts - other) <= JUMP * self._band.span

    def _believe(self, counts: float) -> None:
        """Accept a reading as the good one, or count it as bad."""
        band, doubted = self._band, self._doubted
        good = band.believes(counts)
        if good and not self._near(counts, self._good):
            follows = doubted and self._near(counts, doubted[-1])
            self._doubted = [*doubted, counts] if follows else [counts]
            good = len(self._doubted) >= AGREE
        elif not good:
            self._doubted = []
        if good:
            self._good = counts
            self._doubted = []
        self._bad_run = 0 if good else self._bad_run + 1
        outside = good and not band.covers(counts)
        self._outside.append(outside)
        self.outside += outside
        self.bad += not good
        self._share.append(not good)
        self._bad.append(not good and not math.isnan(counts))

    def _find(self) -> Finding:
        broken = self._broken()
        if broken is not None:
            return broken
        if self._t - self._hummed < self._hum_time:
            return Finding.NOISE
        if self._bad_run > LONGEST_HOLD:
            return Finding.LOST
        if self._at_rail(low=self._band.polarity < 0) >= SATURATED:
            return Finding.SATURATED
        if sum(self._share) > SHARE * SHARE_WINDOW:
            return Finding.SPIKY
        return Finding.OUT_OF_CAL if any(self._outside) else Finding.OK

    def _broken(self) -> Finding | None:
        """A channel that says nothing about the flex sensor, as far as known."""
        full = len(self._raw) == WINDOW
        if full and self._pinned(low=True):
            return Finding.SHORT_LO
        if full and self._pinned(low=False):
            return Finding.SHORT_HI
        if self._equal >= STUCK or self._near_equal >= NEARLY_STUCK:
            return Finding.STUCK
        if not full:
            return None
        if min(self._at_rail(low=True), self._at_rail(low=False)) >= 2:  # no flex sensor can
            return Finding.OPEN
        return self._noise_or_open(spoiled=sum(self._bad) >= OPEN_BAD)

    def _noise_or_open(self, spoiled: bool) -> Finding | None:
        """Noise is a hum, or narrower than what a floating wire gives; a step is wide only once."""
        raw, least = list(self._raw), 2.0 * HIDDEN * self._band.span
        width = max(raw) - min(raw)
        if any(map(math.isnan, raw)) or not least <= width <= FULL_SCALE:
            return Finding.OPEN if spoiled else None
        noise = noise_of(raw)
        quiet = self._t - self._hummed
        if noise.hums:
            self._hummed = self._t
        if quiet >= self._hum_time or (noise.hums and noise.size > self.noise.size):
            self.noise = noise  # of a hum in force the largest
            self._usual = median(after - before for before, after in pairwise(self._times))
        if noise.hums or (quiet < _MEMORY and sum(self._bad) >= SATURATED):
            return Finding.NOISE
        older, newer = raw[: WINDOW // 2], raw[WINDOW // 2 :]
        if not spoiled:
            return None
        if width >= _FLOATING or max(newer) - min(newer) < least:
            return Finding.OPEN
        return Finding.NOISE if max(older) - min(older) >= least else None

    def _pinned(self, low: bool) -> bool:
        """Whether the whole window is at one rail; that of a bent sensor there has noise."""
        bent_low = self._band.polarity < 0
        if low:
            bound = 0.0 if bent_low and self._band.believes(LOW_RAIL) else LOW_RAIL
            return all(counts <= bound for counts in self._raw)
        bent = not bent_low and self._band.believes(HIGH_RAIL)
        bound = FULL_SCALE if bent else HIGH_RAIL
        return all(counts >= bound for counts in self._raw)

    def _at_rail(self, low: bool) -> int:
        """Readings of the window there."""
        return sum(counts <= LOW_RAIL if low else counts >= HIGH_RAIL for counts in self._raw)
