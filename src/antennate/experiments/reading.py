"""The sensor chain as the studies of the bench use it: flex to counts and b, and back to flex.

The only place where those studies meet the sensor, so that a fuller chain is swapped in here.
"""

from __future__ import annotations

import numpy as np

from antennate import sensor as film
from antennate.conditioning import bending_level
from antennate.params import ConditioningParams, SensorParams
from antennate.records import Floats


def counts(sensor: SensorParams, flex: Floats, rng: np.random.Generator | None) -> Floats:
    """One reading [counts] for each flex [rad], same shape; without a generator, without noise."""
    noise = rng.normal(0.0, sensor.noise_counts, np.shape(flex)) if rng is not None else 0.0
    return film.counts(sensor, flex, noise)


def averaged(conditioning: ConditioningParams, values: Floats, rate: float) -> Floats:
    """Running mean over the last T_avg of one record, shape (n,), at `rate` [Hz].

    While the window fills it is the mean of what there is.
    """
    length = max(1, round(conditioning.averaging_time * rate))
    total = np.concatenate([[0.0], np.cumsum(values)])
    end = np.arange(1, len(values) + 1)
    start = np.maximum(end - length, 0)
    return (total[end] - total[start]) / (end - start)


def level(conditioning: ConditioningParams, counts: Floats) -> Floats:
    """Bending level b in [0, 1] of averaged readings [counts], same shape."""
    return bending_level(conditioning, counts)


def flex_of(sensor: SensorParams, counts: Floats) -> Floats:
    """Size of the flex [rad] that gives these readings without noise, same shape, never below 0.

    The reading does not tell the side of the bend: its sign has to be known from elsewhere.
    """
    voltage = np.maximum(counts * sensor.adc_gain + sensor.adc_offset, 1e-3)
    resistance = sensor.divider_resistance * (sensor.supply / voltage - 1.0)
    return np.maximum((resistance / sensor.flat_resistance - 1.0) / sensor.bend_gain, 0.0)
