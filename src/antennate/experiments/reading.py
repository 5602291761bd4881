"""Records of the sensor as the studies of the bench use them: to counts and b, and back to flex."""

from __future__ import annotations

import numpy as np

from antennate.antenna import sensor as flex_sensor
from antennate.control.conditioning import bending_level
from antennate.params import ConditioningParams
from antennate.robots.sensor import SensorParams
from antennate.types import Floats


def noise(sensor: SensorParams, rng: np.random.Generator, count: int) -> Floats:
    """Noise of one record [counts], shape (count,)."""
    return flex_sensor.reading_noise(sensor, rng, (count,))


def recorded(sensor: SensorParams, flex: Floats, noise: Floats) -> Floats:
    """Readings [counts] of flex sensors that remember, for their flex over time [rad].

    Args:
        sensor: The chain; its rate is that of the rows.
        flex: Shape (n,) or (n, B).
        noise: Added before rounding [counts], same shape.
    """
    chain = flex_sensor.SensorChain(sensor, flex.shape[1:], 1.0 / sensor.rate)
    found = [chain.step(f, n) for f, n in zip(flex, noise, strict=True)]
    return np.array(found).reshape(flex.shape)


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
    volts, readings = flex_sensor.transfer_curve(sensor)
    voltage = np.interp(counts, readings, volts)
    resistance = sensor.divider_resistance * (sensor.supply / voltage - 1.0)
    return np.maximum((resistance / sensor.flat_resistance - 1.0) / sensor.bend_gain, 0.0)
