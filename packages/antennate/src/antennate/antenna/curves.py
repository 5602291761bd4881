"""Curves from readings to the flex level, fitted to samples: a sigmoid and what may replace it.

    b = 1 / (1 + exp(-s k (x - x0))),   x = (counts - low) / (high - low)

b is the level, 0 straight and 1 full; s the polarity, found from the data; x0 the midpoint and k
the slope. The fit minimises the squared error of b. A straight line and an isotonic regression
stand beside it: how they do on pushes that served no fit, beyond noise or not. The steps of the
latter are joined by straight lines between their middles (Oron and Flournoy 2017, Statistics in
Biopharmaceutical Research 9, 258-267): so it rises throughout. Readings of one push
err together, so whole pushes are left out in turn. Readings that stand at their highest code, as of
a converter that saturates below its rail, are a plateau.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from antennate.antenna.calibration import FEWEST
from antennate.antenna.sensor import FULL_SCALE
from antennate.control.conditioning import sigmoid
from antennate.jackknife import student95
from antennate.types import Bools, Floats, Ints

MODELS = ("sigmoid", "line", "isotonic")


@dataclass(frozen=True)
class Samples:
    """Readings with known levels.

    Attributes:
        counts: Readings [counts], shape (n,).
        level: Level of each, 0 straight and 1 full, shape (n,).
        trial: Number of the push of each, shape (n,).
        speed: Pushing speed [m/s], NaN where unknown, shape (n,).
        row: Row of the file, for errors, shape (n,).
    """

    counts: Floats
    level: Floats
    trial: Ints
    speed: Floats
    row: Ints


def polarity(samples: Samples) -> Literal[-1, 1]:
    """1 if readings rise with the level, -1 if they fall."""
    return 1 if float((samples.level - samples.level.mean()) @ samples.counts) >= 0 else -1


def curve(z: Floats, slope: float, midpoint: float) -> Floats:
    """Level, 0 to 1, of signed normalised readings z = s x, same shape; midpoint is s x0."""
    return sigmoid(slope * (z - midpoint))


BOUNDS = ((-5.0, float(np.log(1000.0))), (-3.0, 3.0))
"""Where the logarithm of the slope is searched, and the midpoint."""


def fit_sigmoid(x: Floats, level: Floats, sign: int) -> tuple[float, float]:
    """Slope k and midpoint x0 that minimise the squared error of the level.

    Args:
        x: Normalised readings, shape (n,).
        level: Levels, shape (n,).
        sign: Polarity, 1 or -1.
    """
    from scipy.optimize import least_squares  # takes long; only where it is needed

    z = sign * x
    start = (np.log(8.0), float(np.interp(0.5, *_sorted(level, z))))

    def error(p: Floats) -> Floats:
        return curve(z, float(np.exp(p[0])), float(p[1])) - level

    fitted = least_squares(error, start, bounds=np.transpose(BOUNDS)).x
    return float(np.exp(fitted[0])), sign * float(fitted[1])


def _sorted(by: Floats, other: Floats) -> tuple[Floats, Floats]:
    order = np.argsort(by, kind="stable")
    return by[order], other[order]


def ends(samples: Samples) -> tuple[float, float]:
    """Readings that normalise to 0 and 1: the outermost ones, a few outliers apart."""
    low, high = np.percentile(samples.counts, [0.5, 99.5])
    return float(low), float(high)


def predict(model: str, x: Floats, level: Floats, at: Floats, sign: int) -> Floats:
    """Levels that one of MODELS, fitted to normalised readings x and levels (n,), gives at others.

    Args:
        model: Which.
        x: Readings of the fit, shape (n,).
        level: Their levels, shape (n,).
        at: Other readings, shape (m,).
        sign: Polarity, 1 or -1.
    """
    if model == "sigmoid":
        slope, midpoint = fit_sigmoid(x, level, sign)
        return curve(sign * at, slope, sign * midpoint)
    if model == "line":
        straight = np.polyval(np.polyfit(x, level, 1), at)
        return np.asarray(np.clip(straight, 0.0, 1.0), dtype=np.float64)
    return np.asarray(np.interp(sign * at, *_centred(sign * x, level)), dtype=np.float64)


def _centred(z: Floats, level: Floats) -> tuple[Floats, Floats]:
    """Centred isotonic regression: mean reading and level of each step, both rising."""
    from scipy.optimize import isotonic_regression  # takes long; only where it is needed

    readings, place, weights = np.unique(z, return_inverse=True, return_counts=True)
    steps = isotonic_regression(np.bincount(place, level) / weights, weights=weights)
    starts = steps.blocks[:-1]
    sizes = np.add.reduceat(weights, starts)
    return np.add.reduceat(readings * weights, starts) / sizes, steps.x[starts]


def knots(
    model: Literal["line", "isotonic"], counts: Floats, level: Floats, sign: int
) -> tuple[Floats, Floats]:
    """Rising readings and their levels, 0 to 1, between which a fitted line or isotonic curve runs.

    Args:
        model: Which.
        counts: Readings [counts], shape (n,).
        level: Their levels, shape (n,).
        sign: Polarity, 1 or -1.
    """
    if model == "line":
        slope, start = np.polyfit(counts, level, 1).tolist()
        ends = np.array([0.0, 1.0])[::sign]
        return (ends - start) / slope, ends
    z, b = _centred(sign * counts, level)
    picked = np.unique(np.linspace(0, len(z) - 1, MOST_KNOTS).round().astype(np.int64))[::sign]
    return sign * z[picked], np.clip(b[picked], 0.0, 1.0)


MOST_KNOTS = 256
"""Knots of an isotonic curve: one a count of the simulated sensor's range."""
FEWEST_PUSHES = 3
"""Fewest pushes for intervals of slope and midpoint, and for telling a misfit from noise."""
_PARTS, _CHANCE, _LEAST = 10, 0.01, 0.005
"""Parts of the readings in which errors are averaged, chance that noise alone is called a misfit,
and the least mean error that is one [b], about a count of the simulated sensor."""


def misfit(samples: Samples, error: Floats, way: Ints | int = 0) -> float | None:
    """Root mean square of the errors of b that all pushes share; None if noise explains them.

    Readings of one push err together. So its errors are averaged in tenths of all readings, loading
    and unloading apart, and the means are compared over pushes: by Student's t, with the level of
    all tenths together (Bonferroni).

    Args:
        samples: The readings.
        error: Errors of b, shape (n,).
        way: -1 where the antenna is released, shape (n,); 0 if that is not known.
    """
    from scipy.special import stdtrit  # scipy.stats takes half a second longer

    edges = np.quantile(samples.counts, np.arange(1, _PARTS) / _PARTS)
    part = np.digitize(samples.counts, edges) + _PARTS * (np.asarray(way) < 0)
    names, push = np.unique(samples.trial, return_inverse=True)
    shape, place = (2 * _PARTS, len(names)), part * len(names) + push
    size = np.bincount(place, minlength=math.prod(shape)).reshape(shape)
    total = np.bincount(place, error, math.prod(shape)).reshape(shape)
    shared, beyond = list[float](), False
    for sums, counted in zip(total, size, strict=True):
        means = sums[counted > 0] / counted[counted > 0]
        if len(means) < FEWEST_PUSHES:
            continue
        mean, square = float(means.mean()), float(means.var(ddof=1)) / len(means)
        half = float(stdtrit(len(means) - 1, 1 - _CHANCE / len(total) / 2)) * math.sqrt(square)
        beyond |= abs(mean) > max(half, _LEAST)
        shared.append(max(0.0, mean**2 - square))
    return math.sqrt(float(np.mean(shared))) if beyond else None


MOST_GROUPS = 30
"""More pushes than this are left out in so many groups of whole pushes."""
OTHER_DIVIDERS = {"half the divider": 0.5, "twice the divider": 2.0}
"""Fixed resistors under which a rival is tried again, over the one in use."""


@dataclass(frozen=True, slots=True)
class Gain:
    """How much smaller a rival's error of b is than the sigmoid's, over pushes left out."""

    mean: float
    """Mean over pushes."""
    interval_95: tuple[float, float]
    """95 % interval of that mean."""
    pushes: int
    """Pushes that were left out in turn."""

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
        group_numbers = numbers[group::MOST_GROUPS]
        rest = rows[~np.isin(number[rows], group_numbers)]
        if len(rest) < FEWEST:
            continue
        parts = [rows[number[rows] == one] for one in group_numbers]
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


PLATEAU_FEWEST = 150
"""Fewest readings from which a plateau is told. The noise of the quietest real sensor, 1.7 counts,
puts a fifth of them within a count of the highest once in 50,000 times (computed)."""
PLATEAU_SHARE = 0.2
"""Share of the readings that stand at their highest from which on they say nothing (assumed)."""
PLATEAU_SHOWN = 0.05
"""Share of the readings over different bends from which on a plateau is told: noise alone does 1 %
(assumed)."""
_COVERED = 0.1
"""Share of all bends that a plateau covers at least; a quiet antenna that is held covers none."""
_NEAR = 1.0
"""Distance from the highest reading that is the same [counts]."""

_STILL = 2.0
"""Farthest apart that readings are which stand still [counts], as of a converter that is stuck."""
_SIGMA = 1.0 / (0.6745 * 6.0**0.5)
"""From the median of what normal noise does to second differences to its standard deviation."""


@dataclass(frozen=True, slots=True)
class Plateau:
    """Readings that stand at the highest one."""

    counts: float
    """Highest reading [counts]."""
    share: float
    """Share of all readings that stand at the highest one."""
    still: bool = False
    """Whether no reading lies below it by more than a converter that is stuck toggles."""

    def text(self, whose: str) -> str:
        """The plateau in words, with what may be wrong."""
        if self.still:
            return (
                f"all of {whose} stand at {self.counts:.0f} counts or at most {_STILL:.0f} below: "
                "the converter is stuck there"
            )
        return (
            f"{100 * self.share:.0f} % of {whose} stand at {self.counts:.0f} counts, the highest: "
            "the converter saturates there; check its attenuation and the divider"
        )


def plateau_of(counts: Floats, bend: Floats | None = None) -> Plateau | None:
    """The plateau of readings [counts], shape (n,); None without one, or of too few readings.

    Args:
        counts: The readings.
        bend: How far the antenna was bent at each, same shape; None if that is not known.
    """
    if len(counts) < PLATEAU_FEWEST:
        return None
    most = float(counts.max())
    there, least = counts >= most - _NEAR, PLATEAU_SHARE
    if bend is not None:
        ends = np.percentile(bend[there], [5, 95])
        if np.ptp(ends) < _COVERED * np.ptp(bend):
            return None
        least = PLATEAU_SHOWN
    share = float(there.mean())
    still = bool(most - counts.min() <= _STILL)
    return Plateau(most, share, still) if share >= least else None


def white_noise(counts: Floats, part: Ints) -> float:
    """Standard deviation [counts] of the noise of readings in order, shape (n,).

    From the median of second differences, so that bends and single spikes do not count.

    Args:
        counts: The readings.
        part: Which push or hold each belongs to.

    Returns:
        NaN of fewer than three readings in a row.
    """
    second = np.abs(counts[:-2] - 2.0 * counts[1:-1] + counts[2:])
    inside = (part[:-2] == part[1:-1]) & (part[1:-1] == part[2:])
    return _SIGMA * float(np.median(second[inside])) if inside.any() else float("nan")
