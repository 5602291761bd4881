"""How well active touch tells the distance to a wall and the width of a gap.

Every trial is a gap: a left and a right antenna, each beside its own wall, sweep outwards once. The
distance of the left wall and the width of the whole are estimated by curves calibrated on one set
of trials and tested on a fresh one.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from antennate.antenna.statics import with_profile
from antennate.experiments.sweep.config import SweepConfig
from antennate.experiments.sweep.reach import (
    CUES,
    TIP_CUES,
    Felt,
    calibrate_and_guess,
    coefficients,
    feel,
)
from antennate.experiments.sweep.scan import Wall, record
from antennate.params.bench import SweepParams
from antennate.studies.statistics import mean95
from antennate.types import Floats

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
        config.solver,
    )
    if trace.reason:
        return Trial(condition, split, number, side, distance, sweep, None, None, trace.reason)
    exact = feel(config, antenna, trace, zero)
    noisy = feel(config, antenna, trace, zero, gain, rng)
    return Trial(condition, split, number, side, distance, sweep, exact, noisy)


def summarise(trials: list[Trial], spacing: float) -> dict[str, Any]:
    """Errors of every condition, with and without sensor noise, by quantity and cue."""
    return {
        condition: {
            noise: _errors([t for t in trials if t.condition == condition], noise, spacing)
            for noise in ("noisy", "exact")
        }
        for condition in CONDITIONS
    }


def _errors(trials: list[Trial], noise: str, spacing: float) -> dict[str, Any]:
    by_split = {split: [t for t in trials if t.split == split] for split in SPLITS}
    felt = {
        split: [(t, getattr(t, noise)) for t in some if getattr(t, noise) is not None]
        for split, some in by_split.items()
    }
    found: dict[str, Any] = {
        "sweeps": len(by_split["test"]),
        "missed": sum(not t.reason for t in by_split["test"]) - len(felt["test"]),
        "invalid": sum(bool(t.reason) for t in trials),
        "distance": {},
        "gap": {},
        "base_to_tip": {},
    }
    known, asked = ([f for _, f in felt[split]] for split in SPLITS)
    test = [t for t, _ in felt["test"]]
    truth, real = (np.array([t.distance for t, _ in felt[split]]) for split in SPLITS)
    left = np.array([t.side == "l" for t in test], bool)
    enough = [cue for cue in CUES if len(known) >= coefficients(cue)]
    for cue in enough:
        guess = calibrate_and_guess(cue, known, truth, asked)
        found["distance"][cue] = errors(guess[left], real[left])
        found["gap"][cue] = errors(*gaps(test, guess, spacing))
    truth, real = (np.array([f.reach for f in group]) for group in (known, asked))
    for cue in [cue for cue in TIP_CUES if cue in enough]:
        guess = calibrate_and_guess(cue, known, truth, asked, tip=True)
        found["base_to_tip"][cue] = errors(guess, real)
    return found


def gaps(test: list[Trial], guess: Floats, spacing: float) -> tuple[Floats, Floats]:
    """Estimated and true widths of the gaps that both antennae felt."""
    values = {(trial.number, trial.side): k for k, trial in enumerate(test)}
    left = np.array([k for (n, side), k in values.items() if side == "l" and (n, "r") in values])
    left = left.astype(np.int64)
    right = np.array([values[test[k].number, "r"] for k in left], np.int64)
    truth = np.array([trial.distance for trial in test])
    return guess[left] + guess[right] + spacing, truth[left] + truth[right] + spacing


def errors(guess: Floats, truth: Floats) -> dict[str, Any]:
    """Errors of estimates, in % of the truth; what cannot be told (NaN) is counted apart.

    Returns:
        `n`, `untold`, mean absolute percentage error `mape_percent`, root mean square
        `rmse_percent`, and the mean `bias_percent`; the first two with 95 % intervals (Student),
        which begin at 0 at the least; None of few estimates.
    """
    told = np.isfinite(guess)
    share = 100.0 * (guess[told] / truth[told] - 1.0)
    mean, ends = mean95(abs(share), least=0.0)
    square, square_ends = mean95(share**2, least=0.0)
    return {
        "n": int(told.sum()),
        "untold": int((~told).sum()),
        "mape_percent": mean,
        "mape_95": ends,
        "rmse_percent": math.sqrt(square) if told.any() else float("nan"),
        "rmse_95": square_ends and tuple(map(math.sqrt, square_ends)),
        "bias_percent": float(share.mean()) if told.any() else float("nan"),
    }
