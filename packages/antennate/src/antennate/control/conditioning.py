"""From counts to what is felt: bending level, contact, and whether readings repeat.

A running mean over T_avg, then one curve give the level b in [0, 1]: the paper's sigmoid, or
straight lines between knots. A sample that cannot be used, one that is missing or at a rail of the
converter, makes the level of its side NaN as long as it is in the window of the mean, and its
contact UNKNOWN. So a broken wire is UNKNOWN in simulation, too; on a robot the diagnosis of each
channel finds more.

Is the robot stuck? It is if its readings repeat from one gait cycle to the next. A robot that
advances touches new things in every cycle, so its readings change. A robot that walks on the spot
gets the same readings in every cycle. The measure is the mean over a window of |y(t) - y(t - T)|, T
the gait period and y the flex of an antenna as a fraction of its calibrated range (0 straight, 1
fully bent). Where it stays small while an antenna is pressed, the robot is stuck. In free air it is
small too, but nothing is pressed. Only the antennae and the gait's own phase enter.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from antennate.params.control import (
    ConditioningParams,
    ControlParams,
    CurveParams,
    RepetitionParams,
    RuleParams,
)
from antennate.types import Bools, Contact, Floats, Ints

LOW_RAIL = 5.0
"""Readings up to this are at the lower rail [counts]: two sigma of the noise above 0 (assumed)."""
HIGH_RAIL = 4090.0
"""Readings from this on are at the upper rail [counts]: two sigma below full scale (assumed)."""


def usable(counts: Floats) -> Bools:
    """Whether readings [counts] are finite and between the rails, same shape.

    A wire that is open at the flex sensor or shorted reads a rail, whatever the antenna does.
    """
    return (counts > LOW_RAIL) & (counts < HIGH_RAIL)


def sigmoid(z: Floats) -> Floats:
    """1 / (1 + exp(-z)), same shape; NaN stays NaN."""
    return 1.0 / (1.0 + np.exp(-np.minimum(np.maximum(z, -700.0), 700.0)))


@dataclass(frozen=True, slots=True)
class Curves:
    """The curves of both antennae, left before right: what `CurveParams` has, shapes (2,).

    `knotted` has both where one of them has knots.
    """

    midpoint: Floats
    slope: Floats
    polarity: Floats
    counts_low: Floats
    counts_high: Floats
    knotted: tuple[CurveParams, ...] = ()


def curves(control: ControlParams) -> CurveParams | Curves:
    """What makes levels of counts (..., 2): one curve for both antennae, or one for each."""
    left, right = control.conditioning, control.conditioning_right
    if right is None:
        return left
    both = (left, right)
    names = (field.name for field in fields(Curves)[:-1])
    pairs = {name: np.array([getattr(one, name) for one in both], float) for name in names}
    return Curves(**pairs, knotted=both if left.knots or right.knots else ())


def bending_level(params: CurveParams | Curves, counts: Floats) -> Floats:
    """Calibration, b = 1 / (1 + exp(-s k (x - x0))), s the polarity of the reading x; or by knots.

    Args:
        params: Slope k, midpoint x0, polarity and normalisation, or knots and their levels.
        counts: Readings [counts], any shape, (..., 2) for two curves; NaN passes through.

    Returns:
        b in [0, 1], same shape.
    """
    return _level(params, counts, _share(params, counts))


def level_and_fraction(params: CurveParams | Curves, counts: Floats) -> tuple[Floats, Floats]:
    """`bending_level`, and flex as a fraction of the calibrated range: 0 straight, 1 fully bent."""
    x = _share(params, counts)
    if isinstance(params, Curves):
        return _level(params, counts, x), np.where(params.polarity > 0, x, 1.0 - x)
    return _level(params, counts, x), x if params.polarity > 0 else 1.0 - x


def _share(params: CurveParams | Curves, counts: Floats) -> Floats:
    """Readings as shares of the range between both ends of the curve."""
    return (counts - params.counts_low) / (params.counts_high - params.counts_low)


def _level(params: CurveParams | Curves, counts: Floats, x: Floats) -> Floats:
    """Level of readings [counts], and as shares x; the one place where a curve is evaluated."""
    if not isinstance(params, Curves):
        knots, levels = params.knots, params.knot_levels
        if knots:
            return np.asarray(np.interp(counts, knots, levels), np.float64)
    elif params.knotted:
        sides = (bending_level(one, counts[..., i]) for i, one in enumerate(params.knotted))
        return np.stack([*sides], axis=-1)
    return sigmoid(params.polarity * params.slope * (x - params.midpoint))


class RunningMean:
    """Mean of the counts of the last T_avg, per row and side; of all samples so far before that."""

    def __init__(self, params: ConditioningParams, batch: int, period: float) -> None:
        self.length = max(1, round(params.averaging_time / period))
        self._ring: Floats = np.zeros((self.length, batch, 2))
        self._seen: Ints = np.zeros(batch, dtype=np.int64)  # not counted beyond the length
        self._next = 0
        self._short = self.length  # ticks until all rows have seen so many

    def reset(self, rows: Ints | Bools) -> None:
        """Forget what some rows have seen."""
        self._seen[rows] = 0
        self._short = self.length
        self._ring[:, rows] = 0.0

    def step(self, counts: Floats) -> Floats:
        """Take one reading, shape (B, 2) [counts], and return the mean, same shape."""
        self._ring[self._next] = np.where(usable(counts), counts, np.nan)
        self._next = (self._next + 1) % self.length
        total = np.add.reduce(self._ring, axis=0)
        if not self._short:
            return total / self.length
        self._short -= 1
        self._seen = np.minimum(self._seen + 1, self.length)
        return total / self._seen[:, None]

    def begin(self, counts: Floats, rows: Bools) -> Floats:
        """Take the first reading of some rows in the tick that the others have had.

        Args:
            counts: Readings [counts], shape (B, 2); those of other rows are not looked at.
            rows: Rows that were reset since, shape (B,).

        Returns:
            Their means, shape (B, 2), NaN in other rows.
        """
        first = np.where(usable(counts), counts, np.nan)
        self._ring[self._next - 1, rows] = first[rows]
        self._seen[rows] = 1
        return np.where(rows[:, None], first, np.nan)


_FREE, _CONTACT, _UNKNOWN = int(Contact.FREE), int(Contact.CONTACT), int(Contact.UNKNOWN)
"""As plain integers: comparing an array with an enum costs four times as much."""


def contact_of(params: RuleParams, level: Floats, before: Ints) -> Ints:
    """Contact of each side.

    Args:
        params: Threshold and hysteresis.
        level: Bending levels, shape (B, 2); NaN where it is unknown.
        before: Contact at the tick before, shape (B, 2).

    Returns:
        One `Contact` a side, shape (B, 2).
    """
    touching = before == _CONTACT
    bound = params.threshold - params.hysteresis * touching
    state = np.where(level >= bound, _CONTACT, _FREE)
    return np.where(np.isnan(level), _UNKNOWN, state)


class ContactState:
    """Contact with its memory of the tick before."""

    def __init__(self, params: RuleParams, batch: int) -> None:
        self._params = params
        self._state: Ints = np.full((batch, 2), int(Contact.FREE))

    def reset(self, rows: Ints | Bools) -> None:
        """Start rows without contact."""
        self._state[rows] = Contact.FREE

    def step(self, level: Floats) -> Ints:
        """Contact for bending levels, shape (B, 2)."""
        self._state = contact_of(self._params, level, self._state)
        return self._state


class RepetitionDetector:
    """Compares every sample with the one a gait cycle before, per row and side."""

    def __init__(
        self, params: RepetitionParams, batch: int, period: float, frequency: float
    ) -> None:
        self._params = params
        cycle = max(1, round(1.0 / (frequency * period)))
        window = max(1, round(params.window_cycles * cycle))
        self._needed = cycle + window
        self._last: Floats = np.zeros((cycle, batch, 2))
        self._change: Floats = np.zeros((window, batch, 2))
        self._press: Floats = np.zeros((window, batch, 2))
        self._ticks = 0
        self._walked: Ints = np.zeros(batch, dtype=np.int64)

    def reset(self, rows: Ints | Bools) -> None:
        """Forget the samples of rows."""
        for memory in (self._last, self._change, self._press):
            memory[:, rows] = 0.0
        self._walked[rows] = 0

    def step(self, flex: Floats, walking: Bools) -> Bools:
        """Take one sample and say which rows are stuck.

        Args:
            flex: 0 straight, 1 fully bent, shape (B, 2); NaN counts as straight.
            walking: Rows whose gait runs forward undisturbed, shape (B,).

        Returns:
            Rows that walk, are pressed, and whose readings repeat, shape (B,). Only samples taken
            while walking are compared, so nothing repeats before a cycle and a window are over.
        """
        sample = np.where(np.isnan(flex), 0.0, flex)
        in_cycle, in_window = self._ticks % len(self._last), self._ticks % len(self._change)
        self._change[in_window] = np.abs(sample - self._last[in_cycle])
        self._press[in_window] = np.abs(sample)
        self._last[in_cycle] = sample
        self._ticks += 1
        self._walked = np.where(walking, self._walked + 1, 0)
        ready = self._walked >= self._needed
        if not np.count_nonzero(ready):
            return ready
        pressed = ready & (_largest_mean(self._press) > self._params.pressure)
        if not np.count_nonzero(pressed):  # the other mean costs as much as the rest of a step
            return pressed
        return pressed & (_largest_mean(self._change) < self._params.change)


def _largest_mean(memory: Floats) -> Floats:
    """Mean over the window (ticks, B, 2) of the side where it is larger, shape (B,)."""
    left, right = (np.add.reduce(memory, axis=0) / len(memory)).T
    return np.maximum(left, right)
