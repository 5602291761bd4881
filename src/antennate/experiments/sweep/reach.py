"""Distances from active touch: what one outward sweep tells, and curves calibrated on it.

Every cue sees the sensor alone. A touch begins when the flex read back from the counts reaches the
threshold of a straight antenna, and peaks where that flex is largest. Sine of the base angle at the
touch, peak flex and base angle at the peak are the features of active touch; controls see less. A
polynomial of second degree in the features of a cue is fitted by least squares to calibration
trials. `closed_form` is fitted to nothing: it asks the statics for the wall that a frictionless tip
touches at each base angle and flex, and takes the median.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from itertools import combinations_with_replacement

import numpy as np

from antennate.antenna.statics import Chain, equilibrium, shape
from antennate.experiments import reading
from antennate.experiments.sweep.scan import Trace
from antennate.params import ConditioningParams
from antennate.robots.antenna import AntennaSpec
from antennate.robots.sensor import SensorParams
from antennate.types import Floats

CUES = ("flex_and_base", "flex", "first_contact", "blind", "closed_form")
"""Flex and base angle together; flex over time alone; the base angle at first contact alone; the
mean of the calibration; flex and base angle through the statics."""
_FEATURES: dict[str, tuple[str, ...]] = {
    "flex_and_base": ("first", "peak", "peak_base"),
    "flex": ("peak", "share"),
    "first_contact": ("first",),
    "blind": (),
}
_TIP_FEATURES: dict[str, tuple[str, ...]] = {
    "flex_and_base": ("peak", "peak_base"),
    "flex": ("peak",),
    "blind": (),
}


@dataclass(frozen=True, slots=True)
class Felt:
    """What one outward sweep told.

    Attributes:
        first: Sine of the base angle when the touch began.
        peak: Largest flex [rad].
        peak_base: Base angle there [rad].
        share: Share of the time with the flex above the threshold.
        closed_form: Distance to the wall by the statics [m]; NaN where they cannot tell.
        reach: True distance from base to tip at the peak [m], to be estimated.
    """

    first: float
    peak: float
    peak_base: float
    share: float
    closed_form: float
    reach: float


class Statics:
    """Distance to a wall that the tip touches without friction, from base angle and flex."""

    def __init__(self, antenna: AntennaSpec) -> None:
        self._table = _tip_curves(
            antenna.hinge_stiffness(), antenna.link_length, antenna.radius, antenna.sensed_hinges
        )

    def distance(self, base: Floats, flex: Floats) -> Floats:
        """Distance of the wall [m] for base angles and sizes of flex [rad], shape (n,)."""
        bases, curves = self._table
        each = np.array(
            [np.interp(flex, *curve, left=np.nan, right=np.nan) for curve in curves]
        ).reshape(len(bases), len(flex))
        below = np.clip(np.searchsorted(bases, base, "right") - 1, 0, len(bases) - 2)
        share = (base - bases[below]) / (bases[below + 1] - bases[below])
        column = np.arange(len(flex))
        found = (1.0 - share) * each[below, column] + share * each[below + 1, column]
        return np.where((share >= 0.0) & (share <= 1.0), found, np.nan)


@cache
def _tip_curves(
    stiffness: tuple[float, ...], link_length: float, radius: float, covered: int
) -> tuple[Floats, list[tuple[Floats, Floats]]]:
    """Base angles, and for each the flex with the distance it means, as long as the tip leads."""
    chain = Chain(np.full(len(stiffness), link_length), np.array(stiffness))
    bases = np.radians(np.arange(5.0, 100.0, 2.5))
    sizes = np.linspace(0.0, 1.0, 81) ** 2 * 4.0 * stiffness[0] / chain.length
    curves = []
    for base in bases:
        force = -sizes[:, None] * np.array([np.sin(base), np.cos(base)])
        rest = equilibrium(chain, np.full(len(sizes), chain.length), force)
        tip = shape(chain, rest.angles)[:, -1]
        distance = np.sin(base) * tip[:, 0] + np.cos(base) * tip[:, 1] + radius
        flex = -rest.angles[:, :covered].sum(axis=1)
        good = rest.solved & (base + rest.angles.sum(axis=1) > 0)
        good[1:] &= np.diff(flex) > 0
        count = len(good) if good.all() else int(np.argmin(good))
        curves.append((flex[:count], distance[:count]))
    return bases, curves


def feel(
    trace: Trace,
    outward: float,
    threshold: float,
    statics: Statics,
    sensor: SensorParams,
    conditioning: ConditioningParams,
    base_zero: float = 0.0,
    gain_error: float = 0.0,
    rng: np.random.Generator | None = None,
) -> Felt | None:
    """What the outward part of a sweep told, None if nothing was felt.

    Args:
        trace: The sweep.
        outward: Time at which the base turns back [s].
        threshold: Flex at which a touch begins [rad].
        statics: Of the antenna.
        sensor: The flex sensor; the sign is known, as on the way out the wall alone bends it.
        conditioning: T_avg; flex and base angle are averaged alike.
        base_zero: Error of the base's zero [rad].
        gain_error: Relative error of the flex sensor's gain in this trial.
        rng: Noise of the readings; without one, the exact flex and no averaging.
    """
    until = trace.t <= outward
    flex, base = np.maximum(-trace.flex, 0.0), trace.base + base_zero
    if rng is not None:
        noise = reading.noise(sensor, rng, len(trace.flex))
        counts = reading.recorded(sensor, (1.0 + gain_error) * trace.flex, noise)
        flex = reading.flex_of(sensor, reading.averaged(conditioning, counts, sensor.rate))
        base = reading.averaged(conditioning, base, sensor.rate)
    flex, base = flex[until], base[until]
    touched = np.flatnonzero(flex >= threshold)
    if len(touched) == 0:
        return None
    first, peak = int(touched[0]), int(flex.argmax())
    far = statics.distance(base[touched], flex[touched])
    return Felt(
        float(np.sin(base[first])),
        float(flex[peak]),
        float(base[peak]),
        len(touched) / len(flex),
        float(np.median(far[np.isfinite(far)])) if np.isfinite(far).any() else float("nan"),
        float(trace.reach[until][peak]),
    )


def calibrate_and_guess(
    cue: str, fit: list[Felt], truth: Floats, test: list[Felt], tip: bool = False
) -> Floats:
    """Fit a cue to calibration trials and estimate others.

    Args:
        cue: One of CUES.
        fit: Calibration trials, at least as many as coefficients.
        truth: Their distances [m], shape (n,).
        test: Trials to estimate.
        tip: Whether distances are those from base to tip.
    """
    if cue == "closed_form":
        return np.array([felt.closed_form for felt in test])
    names = (_TIP_FEATURES if tip else _FEATURES)[cue]
    known, asked = _matrix(fit, names), _matrix(test, names)
    return asked @ np.linalg.lstsq(known, truth, rcond=None)[0]


def cues(tip: bool) -> tuple[str, ...]:
    """The cues that estimate the distance from base to tip, or that to a wall."""
    return tuple(_TIP_FEATURES) if tip else CUES


def coefficients(cue: str) -> int:
    """Number of coefficients of a cue."""
    count = len(_FEATURES.get(cue, ()))
    return (count + 1) * (count + 2) // 2


def _matrix(felt: list[Felt], names: tuple[str, ...]) -> Floats:
    """One, the features and their products of two, shape (n, k)."""
    columns = [np.array([getattr(one, name) for one in felt]) for name in names]
    columns = [np.ones(len(felt)), *columns]
    pairs = combinations_with_replacement(range(len(columns)), 2)
    return np.stack([columns[i] * columns[j] for i, j in pairs], axis=1)
