"""Curves that rival the sigmoid: how they do on pushes that served no fit, beyond noise or not.

Readings of one push err together, so whole pushes are left out in turn.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from antennate.antenna.calibration import FEWEST
from antennate.antenna.curves import MODELS, Samples, ends, polarity, predict
from antennate.antenna.sensor import FULL_SCALE
from antennate.jackknife import student95
from antennate.types import Bools, Floats, Ints

MOST_GROUPS = 30
"""More pushes than this are left out in so many groups of whole pushes."""
OTHER_DIVIDERS = {"half the divider": 0.5, "twice the divider": 2.0}
"""Fixed resistors under which a rival is tried again, over the one in use."""


@dataclass(frozen=True, slots=True)
class Gain:
    """How much smaller a rival's error of b is than the sigmoid's, over pushes left out.

    Attributes:
        mean: Mean over pushes; `interval_95` its 95 % interval.
        pushes: How many.
    """

    mean: float
    interval_95: tuple[float, float]
    pushes: int

    @property
    def wins(self) -> bool:
        """Whether the rival is better beyond noise."""
        return self.interval_95[0] > 0


def with_divider(samples: Samples, factor: float) -> Samples:
    """The readings that another fixed resistor would have given, by the ideal divider.

    A reading's share u of the full scale has odds u / (1 - u) in proportion to that resistor.
    """
    share = np.clip(samples.counts / FULL_SCALE, 0.0, 1.0)
    counts = FULL_SCALE * share * factor / (1.0 + share * (factor - 1.0))
    return Samples(counts, samples.level, samples.trial, samples.speed, samples.row)


def left_out(
    samples: Samples, number: Ints, used: Bools, full_scale: bool = False
) -> dict[str, list[Floats]]:
    """Errors of b of each model on every push that served no fit.

    Args:
        samples: The readings.
        number: Number of the push of each, shape (n,).
        used: Readings that take part, shape (n,).
        full_scale: Whether readings are normalised by 0 to 4095.

    Returns:
        For each of MODELS a list over pushes of errors, curve minus bend; empty with one push.
    """
    errors: dict[str, list[Floats]] = {model: [] for model in MODELS}
    rows = np.flatnonzero(used)
    numbers = [n for n in np.unique(number[rows]) if (number[rows] == n).sum() > 1]
    low, high = (0.0, float(FULL_SCALE)) if full_scale else ends(samples)
    x, level, sign = (samples.counts - low) / (high - low), samples.level, polarity(samples)
    for group in range(min(MOST_GROUPS, len(numbers))):
        held = numbers[group::MOST_GROUPS]
        rest = rows[~np.isin(number[rows], held)]
        if len(rest) < FEWEST:
            continue
        parts = [rows[number[rows] == one] for one in held]
        at = np.concatenate(parts)
        cuts = np.cumsum([len(part) for part in parts])[:-1]
        for model in MODELS:
            wrong = predict(model, x[rest], level[rest], x[at], sign) - level[at]
            errors[model] += np.split(wrong, cuts)
    return errors


def rms(errors: list[Floats]) -> Floats:
    """Root mean squared error of each push, shape (pushes,)."""
    return np.array([float(np.sqrt(np.mean(error**2))) for error in errors])


def gain_of(errors: dict[str, list[Floats]], rival: str) -> Gain:
    """How much a rival gains, from `left_out` of two pushes or more."""
    gain = rms(errors["sigmoid"]) - rms(errors[rival])
    half = student95(len(gain) - 1) * gain.std(ddof=1) / np.sqrt(len(gain))
    mean = float(gain.mean())
    return Gain(mean, (mean - float(half), mean + float(half)), len(gain))
