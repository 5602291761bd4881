"""From readings with a known flex level to a calibration: a sigmoid and its 95 % intervals.

Data that cannot be calibrated are refused.
"""

from __future__ import annotations

import hashlib
import math
from typing import Any, Literal

import numpy as np

from antennate import __version__, checks
from antennate.antenna.calibration import FEWEST, NARROWEST_SPAN, REACH, Calibration, Kind, SpeedFit
from antennate.antenna.curves import (
    BOUNDS,
    FEWEST_PUSHES,
    MODELS,
    MOST_GROUPS,
    PLATEAU_SHARE,
    Samples,
    curve,
    ends,
    fit_sigmoid,
    gain_of,
    knots,
    left_out,
    misfit,
    plateau_of,
    polarity,
    predict,
)
from antennate.antenna.sensor import FULL_SCALE
from antennate.control.conditioning import usable
from antennate.errors import CalibrationError
from antennate.jackknife import jackknife95
from antennate.types import Floats, Ints

REVERSAL = 0.15
"""Share of the span by which mean readings may fall back while the level rises."""
_BINS = 10
_FOLDS = 10
"""Folds of the cross-validation."""
_FARTHEST = 10.0
"""Largest level, which is 0 to 1 but for errors."""


def check(samples: Samples) -> None:
    """Refuse what cannot be calibrated."""
    counts, level = samples.counts, samples.level
    if len(counts) < FEWEST:
        raise CalibrationError(
            f"row {samples.row[-1] if len(counts) else 1}: expected at least {FEWEST} readings, "
            f"found {len(counts)}; record longer"
        )
    railed = ~usable(counts)
    if railed.mean() > PLATEAU_SHARE:
        first = int(np.argmax(railed))
        raise CalibrationError(
            f"row {samples.row[first]}: expected readings between the rails, found "
            f"{counts[first]:g} counts and {100 * railed.mean():.0f} % of all like it (saturated); "
            "choose another divider resistor"
        )
    plateau = plateau_of(counts, level)
    if plateau is not None and plateau.share > PLATEAU_SHARE:
        first = int(np.argmax(counts))
        raise CalibrationError(
            f"row {samples.row[first]}: expected readings that change with the bend, found "
            f"{plateau.counts:g} counts and {100 * plateau.share:.0f} % of all like it, the "
            "highest (saturated below the rail); set the attenuation of the converter, or choose "
            "another divider resistor"
        )
    if np.ptp(level) < 0.1:
        raise CalibrationError(
            f"row {samples.row[0]}: expected levels over at least a tenth of the full one, found "
            f"{level.min():.3g} to {level.max():.3g}; bend it farther or declare the full flex"
        )
    low, high = np.percentile(counts, [1, 99])
    if high - low < NARROWEST_SPAN:
        how = "constant" if low == high else f"a change of {high - low:.3g}"
        raise CalibrationError(
            f"row {samples.row[0]}: expected readings that change by {NARROWEST_SPAN:g} counts or "
            f"more, found {low:g} to {high:g} ({how}); check the wiring and the divider"
        )
    _check_monotonic(samples, high - low)


def _check_monotonic(samples: Samples, span: float) -> None:
    edges = np.linspace(samples.level.min(), samples.level.max(), _BINS + 1)
    place = np.clip(np.digitize(samples.level, edges) - 1, 0, _BINS - 1)
    bins = [b for b in range(_BINS) if (place == b).any()]
    means = np.array([samples.counts[place == b].mean() for b in bins])
    rising = polarity(samples) * means
    worst = rising - np.maximum.accumulate(rising)
    if worst.min() < -REVERSAL * span:
        bad = bins[int(np.argmin(worst))]
        row = samples.row[np.flatnonzero(place == bad)[0]]
        raise CalibrationError(
            f"row {row}: expected readings that go one way with the level, found them turning back "
            f"by {-worst.min():.0f} of {span:.0f} counts near a level of "
            f"{samples.level[place == bad].mean():.2f} (non-monotonic); check that the sensor is "
            "fixed and that time and flex belong together"
        )


def fit(
    samples: Samples,
    sensor_id: str,
    data_sha256: str,
    threshold: float = 0.5,
    full_scale: bool = False,
    least_r2: float = 0.5,
    noise_counts: float | None = None,
    kind: Kind = "sigmoid",
    way: Ints | int = 0,
) -> Calibration:
    """Calibrate recorded samples.

    Args:
        samples: The data.
        sensor_id: Name of the flex sensor: letters, digits, dots, hyphens and underscores.
        data_sha256: Hash of the recording.
        threshold: Flex level that counts as contact.
        full_scale: Normalise readings by 0 to 4095 and not by the recording's extremes.
        least_r2: A fit that explains a smaller share of the variance is refused.
        noise_counts: Noise of the readings as they came [counts], None if it is not known.
        kind: Which curve.
        way: -1 where the antenna is released, shape (n,); 0 if that is not known.
    """
    check(samples)
    sign = polarity(samples)
    low, high = (0.0, float(FULL_SCALE)) if full_scale else ends(samples)
    x = (samples.counts - low) / (high - low)
    slope, midpoint = fit_sigmoid(x, samples.level, sign)
    predicted, ends_of = curve(sign * x, slope, sign * midpoint), (np.zeros(0), np.zeros(0))
    if kind != "sigmoid":
        ends_of = knots(kind, samples.counts, samples.level, sign)
        predicted = np.interp(samples.counts, *ends_of)
    r2 = _r2(predicted, samples.level)
    if r2 < least_r2 or (kind == "sigmoid" and not (-1 < midpoint < 2 and slope < 999)):
        how = f" with slope {slope:.3g} and midpoint {midpoint:.3g}" if kind == "sigmoid" else ""
        raise CalibrationError(
            f"expected a curve ({kind}) that explains at least {100 * least_r2:.0f} % of the "
            f"level, found {100 * r2:.0f} %{how}; check that time and flex belong together"
        )
    slopes, midpoints = _intervals(samples, x, sign, slope, midpoint)
    errors = cross_validate(samples, x, sign)
    rmse = {model: float(np.sqrt(np.mean(e**2))) for model, e in errors.items()}
    return Calibration(
        made_by=f"antennate {__version__}",
        sensor_id=sensor_id,
        data_sha256=data_sha256,
        polarity=sign,
        slope=slope,
        slope_95=slopes,
        midpoint=midpoint,
        midpoint_95=midpoints,
        counts_low=low,
        counts_high=high,
        threshold=threshold,
        valid_counts=(float(samples.counts.min()), float(samples.counts.max())),
        valid_bend=(float(samples.level.min()), float(samples.level.max())),
        samples=len(x),
        trials=len(np.unique(samples.trial)),
        r2=r2,
        rmse=_rmse(predicted, samples.level),
        speeds=tuple(_per_speed(samples, predicted)),
        cross_validated_rmse=rmse,  # pyright: ignore[reportArgumentType]
        better_than_sigmoid=_better(samples, full_scale),
        reach=_reach(low, high, sign),
        noise_counts=noise_counts,
        kind=kind,
        knots=tuple(ends_of[0].tolist()),
        knot_levels=tuple(ends_of[1].tolist()),
        misfit=misfit(samples, predicted - samples.level, way),
    )


def _reach(low: float, high: float, sign: int) -> float:
    """How far readings may lie beyond the bent end [spans]: half of its way to the rail.

    Behind two equal resistors a reading halves when the resistance becomes three times as large; a
    flex sensor's becomes twice as large or a little more at 180 deg (datasheet FS-L-0095-103).
    """
    way = low if sign < 0 else FULL_SCALE - high
    return max(REACH, round(way / 2 / (high - low), 2))


def fit_calibration(
    counts: Floats,
    level: Floats,
    trial: Ints | None = None,
    speed: Floats | None = None,
    sensor_id: str = "unnamed",
    threshold: float = 0.5,
    kind: Kind = "sigmoid",
) -> Calibration:
    """Calibrate a flex sensor from arrays: the curve of `Calibration`, by least squares.

    Args:
        counts: Readings [counts], shape (n,), at least 20.
        level: How far the antenna was bent at each, 0 straight and 1 full, shape (n,).
        trial: Number of the push of each, shape (n,); None if it was one: that has no intervals.
        speed: Pushing speed of each [m/s], shape (n,); None if unknown.
        sensor_id: Name of the flex sensor: letters, digits, dots, hyphens and underscores.
        threshold: Flex level that counts as contact.
        kind: Which curve: the sigmoid, a line, or isotonic.

    Raises:
        CalibrationError: Shapes differ, a value is not finite (only a speed may be NaN), a level is
            far from 0 to 1, a trial is no whole number, a speed is below 0, the name or the
            threshold cannot be one, or the data cannot be calibrated.
    """
    counts = _column("counts", counts, "n")
    n = len(counts)
    level = _column("level", level, n)
    if (bad := level[np.abs(level) > _FARTHEST]).size:
        raise CalibrationError(f"level: expected 0 straight and 1 full, found {bad[0]:g}")
    given = np.zeros(n) if trial is None else trial
    trials = checks.whole_array("trial", given, (n,), CalibrationError)
    speeds = _column("speed", np.full(n, np.nan) if speed is None else speed, n, finite=False)
    if (bad := speeds[(speeds < 0) | np.isinf(speeds)]).size:
        raise CalibrationError(f"speed: expected finite speeds of at least 0, found {bad[0]:g}")
    threshold = checks.real("threshold", threshold, error=CalibrationError)
    samples = Samples(counts, level, trials, speeds, np.arange(1, n + 1))
    digest = hashlib.sha256(np.stack([counts, level]).tobytes()).hexdigest()
    return fit(samples, sensor_id, digest, threshold, kind=kind)


def _column(name: str, values: Any, n: int | str, finite: bool = True) -> Floats:
    return checks.array(name, values, (n,), finite=finite, error=CalibrationError)


def _r2(predicted: Floats, level: Floats) -> float:
    spread = ((level - level.mean()) ** 2).sum()
    return float(1.0 - ((predicted - level) ** 2).sum() / spread) if spread > 0 else 0.0


def _rmse(predicted: Floats, level: Floats) -> float:
    return float(np.sqrt(np.mean((predicted - level) ** 2)))


def _per_speed(samples: Samples, predicted: Floats) -> list[SpeedFit]:
    keys = np.where(np.isnan(samples.speed), -1.0, samples.speed)
    fits = []
    for speed in np.unique(keys).tolist():
        rows = keys == speed
        fits.append(
            SpeedFit(
                speed_m_s=None if speed < 0 else speed,
                samples=int(rows.sum()),
                r2=_r2(predicted[rows], samples.level[rows]),
                rmse=_rmse(predicted[rows], samples.level[rows]),
            )
        )
    return fits


def _intervals(
    samples: Samples, x: Floats, sign: int, slope: float, midpoint: float
) -> tuple[tuple[float, float] | None, tuple[float, float] | None]:
    """95 % intervals of slope, by its logarithm, and midpoint, as readings of a push err together.

    None with few pushes, or where it does not matter which one is left out.
    """
    pushes = np.unique(samples.trial)
    if len(pushes) < FEWEST_PUSHES:
        return None, None
    left: list[tuple[float, float]] = []
    for i in range(min(MOST_GROUPS, len(pushes))):
        rest = ~np.isin(samples.trial, pushes[i::MOST_GROUPS])
        part = fit_sigmoid(x[rest], samples.level[rest], sign)
        left.append((math.log(part[0]), part[1]))
    ends = jackknife95(np.array([math.log(slope), midpoint]), np.array(left))
    (low, first), (high, last) = np.clip(ends, *np.transpose(BOUNDS)).tolist()
    return (
        None if math.isnan(low) else (math.exp(low), math.exp(high)),
        None if math.isnan(first) else (first, last),
    )


def _folds(samples: Samples) -> list[Ints]:
    """Rows of each fold: whole pushes, or a part of the recording where there are few of these."""
    pushes = np.unique(samples.trial)
    if len(pushes) < FEWEST_PUSHES:
        return np.array_split(np.arange(len(samples.counts)), _FOLDS)
    rows = [np.flatnonzero(samples.trial == push) for push in pushes]
    return [np.concatenate(rows[i::_FOLDS]) for i in range(min(_FOLDS, len(rows)))]


def cross_validate(samples: Samples, x: Floats, sign: int) -> dict[str, Floats]:
    """Root mean squared error of each model on folds it has not seen, shape (folds,)."""
    errors: dict[str, list[float]] = {model: [] for model in MODELS}
    for fold in _folds(samples):
        rest = np.setdiff1d(np.arange(len(x)), fold)
        for model in MODELS:
            predicted = predict(model, x[rest], samples.level[rest], x[fold], sign)
            errors[model].append(_rmse(predicted, samples.level[fold]))
    return {model: np.array(e) for model, e in errors.items()}


def _better(samples: Samples, full_scale: bool) -> tuple[Literal["line", "isotonic"], ...]:
    """Models that beat the sigmoid beyond noise on trials left out; none with a single trial."""
    errors = left_out(samples, samples.trial, np.ones(len(samples.counts), bool), full_scale)
    if len(errors["sigmoid"]) < 2:
        return ()
    rivals: tuple[Literal["line", "isotonic"], ...] = ("line", "isotonic")
    return tuple(rival for rival in rivals if gain_of(errors, rival).wins)
