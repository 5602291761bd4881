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

from antennate.antenna.sensor import reading_noise
from antennate.antenna.statics import Chain, equilibrium, shape
from antennate.experiments.bench import averaged, between, flex_of, recorded
from antennate.experiments.sweep.config import SweepConfig
from antennate.experiments.sweep.scan import Trace
from antennate.robots.antenna import AntennaSpec
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
TIP_CUES = ("flex_and_base", "flex", "blind")
"""Those that also estimate the distance from base to tip."""
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


def wall_distance(antenna: AntennaSpec, base: Floats, flex: Floats) -> Floats:
    """Distance to a wall that the tip touches without friction [m].

    Args:
        antenna: The antenna.
        base: Base angles [rad], shape (n,).
        flex: Sizes of the flex [rad], shape (n,).

    Returns:
        Distances, shape (n,); NaN where the statics cannot tell.
    """
    bases, curves = _tip_curves(
        antenna.hinge_stiffness(), antenna.link_length, antenna.radius, antenna.sensed_hinges
    )
    table = [np.interp(flex, *curve, left=np.nan, right=np.nan) for curve in curves]
    found = between(bases, np.array(table).reshape(len(bases), len(flex)), base)
    return np.where((base >= bases[0]) & (base <= bases[-1]), found, np.nan)


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
    config: SweepConfig,
    antenna: AntennaSpec,
    trace: Trace,
    base_zero: float,
    gain_error: float = 0.0,
    rng: np.random.Generator | None = None,
) -> Felt | None:
    """What the outward part of a sweep told, None if nothing was felt.

    The sign of the flex is known, as on the way out the wall alone bends the antenna.

    Args:
        config: Threshold of a touch, and T_avg, over which flex and base angle are averaged alike.
        antenna: The antenna as the statics know it.
        trace: The sweep.
        base_zero: Error of the base's zero [rad].
        gain_error: Relative error of the flex sensor's gain in this trial.
        rng: Noise of the readings; without one, the exact flex and no averaging.
    """
    until = trace.t <= 0.5 / config.sweep.frequency
    flex, base = np.maximum(-trace.flex, 0.0), trace.base + base_zero
    if rng is not None:
        sensor, conditioning = antenna.sensor, config.conditioning
        noise = reading_noise(sensor, rng, (len(trace.flex),))
        counts = recorded(sensor, (1.0 + gain_error) * trace.flex, noise)
        flex = flex_of(sensor, averaged(conditioning, counts, sensor.rate))
        base = averaged(conditioning, base, sensor.rate)
    flex, base = flex[until], base[until]
    touched = np.flatnonzero(flex >= config.shape.flex)
    if len(touched) == 0:
        return None
    first, peak = int(touched[0]), int(flex.argmax())
    far = wall_distance(antenna, base[touched], flex[touched])
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


def coefficients(cue: str) -> int:
    """Number of coefficients of a cue."""
    count = len(_FEATURES.get(cue, ()))
    return (count + 1) * (count + 2) // 2


def _matrix(felt: list[Felt], names: tuple[str, ...]) -> Floats:
    """One, the features and their products of two, shape (n, k)."""
    columns = [np.ones(len(felt)), *(np.array([getattr(f, n) for f in felt]) for n in names)]
    return np.stack([a * b for a, b in combinations_with_replacement(columns, 2)], axis=1)
