"""How well active touch tells the distance to a wall and the width of a gap.

Every trial is a gap: a left and a right antenna, each beside its own wall, sweep outwards once. The
distance of the left wall and the width of the whole are estimated by curves calibrated on one set
of trials and tested on a fresh one.

Every cue sees the sensor alone. A touch begins when the flex read back from the counts reaches the
threshold of a straight antenna, and peaks where that flex is largest. Sine of the base angle at the
touch, peak flex and base angle at the peak are the features of active touch; controls see less. A
polynomial of second degree in the features of a cue is fitted by least squares to calibration
trials. `closed_form` is fitted to nothing: it asks the statics for the wall that a frictionless tip
touches at each base angle and flex, and takes the median.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from itertools import combinations_with_replacement, product

import numpy as np

from antennate.antenna.sensor import reading_noise
from antennate.antenna.statics import Chain, equilibrium, shape, with_profile
from antennate.experiments.bench import averaged, between, flex_of, recorded
from antennate.experiments.sweep.physics import SweepConfig, Trace, Wall, record
from antennate.experiments.sweep.result import ByNoise, CueErrors, Estimates
from antennate.params.bench import SweepParams
from antennate.robots.antenna import AntennaSpec
from antennate.studies.statistics import mean95
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
"""Cues that also estimate the distance from base to tip."""
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
    distance = between(bases, np.array(table).reshape(len(bases), len(flex)), base)
    return np.where((base >= bases[0]) & (base <= bases[-1]), distance, np.nan)


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


CONDITIONS = ("same", "varied", "tilted", "moving")
"""Every trial sweeps alike; centre and amplitude differ from trial to trial; the sweep is the same
and walls are not parallel to the heading; the sweep is the same and the base moves along."""
SPLITS, SIDES = ("calibration", "test"), ("l", "r")


@dataclass(frozen=True, slots=True)
class Trial:
    """One antenna beside one wall.

    Attributes:
        distance: From the base to the wall [m].
        exact: What was felt without sensor noise, and `noisy` with it; None if nothing was felt.
        reason: Why the trial is invalid, or empty.
    """

    condition: str
    split: str
    number: int
    side: str
    distance: float
    sweep: SweepParams
    exact: Felt | None
    noisy: Felt | None
    reason: str = ""


def plan(config: SweepConfig) -> list[tuple[SweepConfig, str, str, int, str]]:
    """Arguments of `run_trial` for every trial."""
    trials = range(config.estimate.trials)
    return list(product([config], CONDITIONS, SPLITS, trials, SIDES))


def run_trial(config: SweepConfig, condition: str, split: str, number: int, side: str) -> Trial:
    """Draw one trial and sweep outwards once; chance does not depend on the condition."""
    params, antenna = config.estimate, with_profile(config.antenna, config.profile)
    key = [config.seed, SPLITS.index(split), number, SIDES.index(side)]
    rng = np.random.default_rng(key)
    distance = float(rng.uniform(*params.distance)) * antenna.length
    rub, lean = rng.uniform(-1.0, 1.0, 2)
    zero = float(rng.normal(0.0, params.base_zero))
    gain = float(rng.normal(0.0, params.gain))
    # One sweep for both antennae. A key without its last number would be that of side 0: NumPy pads
    # keys with zeros.
    both = np.random.default_rng([*key[:3], len(SIDES)]).uniform(-1.0, 1.0, 2)
    sweep = config.sweep
    if condition == "varied":
        sweep = SweepParams(
            centre=sweep.centre + params.centre_range * float(both[0]),
            amplitude=sweep.amplitude + params.amplitude_range * float(both[1]),
            frequency=sweep.frequency,
        )
    friction = antenna.friction * (1.0 + params.friction * float(rub))
    trace = record(
        config.physics,
        antenna.model_copy(update={"friction": friction}),
        sweep,
        Wall(distance, params.tilt_range * float(lean) if condition == "tilted" else 0.0),
        0.5,
        config.speed if condition == "moving" else 0.0,
        config.shape.gap,
    )
    if trace.reason:
        return Trial(condition, split, number, side, distance, sweep, None, None, trace.reason)
    exact = feel(config, antenna, trace, zero)
    noisy = feel(config, antenna, trace, zero, gain, rng)
    return Trial(condition, split, number, side, distance, sweep, exact, noisy)


def errors_by_condition(trials: list[Trial], spacing: float) -> dict[str, ByNoise]:
    """Errors of every condition, with and without sensor noise, by quantity and cue."""
    some = {name: [t for t in trials if t.condition == name] for name in CONDITIONS}
    return {
        name: ByNoise(
            noisy=_estimates(of, [t.noisy for t in of], spacing),
            exact=_estimates(of, [t.exact for t in of], spacing),
        )
        for name, of in some.items()
    }


def _estimates(trials: list[Trial], told: Sequence[Felt | None], spacing: float) -> Estimates:
    felt: dict[str, list[tuple[Trial, Felt]]] = {split: [] for split in SPLITS}
    for trial, of in zip(trials, told, strict=True):
        if of is not None:
            felt[trial.split].append((trial, of))
    sweeps = [trial for trial in trials if trial.split == "test"]
    known, asked = ([f for _, f in felt[split]] for split in SPLITS)
    test = [t for t, _ in felt["test"]]
    truth, real = (np.array([t.distance for t, _ in felt[split]]) for split in SPLITS)
    left = np.array([t.side == "l" for t in test], bool)
    enough = [cue for cue in CUES if len(known) >= coefficients(cue)]
    guesses = {cue: calibrate_and_guess(cue, known, truth, asked) for cue in enough}
    reached, reach = (np.array([f.reach for f in group]) for group in (known, asked))
    tips = {
        cue: calibrate_and_guess(cue, known, reached, asked, tip=True)
        for cue in TIP_CUES
        if cue in enough
    }
    return Estimates(
        sweeps=len(sweeps),
        missed=sum(not trial.reason for trial in sweeps) - len(test),
        invalid=sum(bool(trial.reason) for trial in trials),
        distance={cue: errors(guess[left], real[left]) for cue, guess in guesses.items()},
        gap={cue: errors(*gaps(test, guess, spacing)) for cue, guess in guesses.items()},
        base_to_tip={cue: errors(guess, reach) for cue, guess in tips.items()},
    )


def gaps(test: list[Trial], guess: Floats, spacing: float) -> tuple[Floats, Floats]:
    """Estimated and true widths of the gaps that both antennae felt."""
    values = {(trial.number, trial.side): k for k, trial in enumerate(test)}
    left = np.array([k for (n, side), k in values.items() if side == "l" and (n, "r") in values])
    left = left.astype(np.int64)
    right = np.array([values[test[k].number, "r"] for k in left], np.int64)
    truth = np.array([trial.distance for trial in test])
    return guess[left] + guess[right] + spacing, truth[left] + truth[right] + spacing


def errors(guess: Floats, truth: Floats) -> CueErrors:
    """Errors of estimates, in % of the truth; what cannot be told (NaN) is counted apart."""
    known = np.isfinite(guess)
    share = 100.0 * (guess[known] / truth[known] - 1.0)
    mean, ends = mean95(abs(share), least=0.0)
    square, square_ends = mean95(share**2, least=0.0)
    some = bool(known.any())
    return CueErrors(
        n=int(known.sum()),
        untold=int((~known).sum()),
        mape_percent=mean if some else None,
        mape_95=ends,
        rmse_percent=math.sqrt(square) if some else None,
        rmse_95=square_ends and (math.sqrt(square_ends[0]), math.sqrt(square_ends[1])),
        bias_percent=float(share.mean()) if some else None,
    )
