"""Readings of the flex sensor that experiments with one antenna on the bench share."""

from __future__ import annotations

import numpy as np

from antennate.antenna import sensor as flex_sensor
from antennate.params.control import ConditioningParams
from antennate.robots.antenna import SensorParams
from antennate.types import Floats, Ints


def recorded(sensor: SensorParams, flex: Floats, noise: Floats) -> Floats:
    """Readings [counts] of flex sensors that remember, for their flex over time [rad].

    Args:
        sensor: The chain; its rate is that of the rows.
        flex: Shape (n,) or (n, B).
        noise: Added before rounding [counts], same shape.
    """
    chain = flex_sensor.SensorChain(sensor, flex.shape[1:], 1.0 / sensor.rate)
    readings = [chain.step(f, n) for f, n in zip(flex, noise, strict=True)]
    return np.array(readings).reshape(flex.shape)


def mean_since(first: Ints, values: Floats) -> Floats:
    """Mean along the last axis (n,) from the index `first` (n,) of each to itself, same shape."""
    total = np.cumsum(np.pad(values, [(0, 0)] * (values.ndim - 1) + [(1, 0)]), axis=-1)
    end = np.arange(1, values.shape[-1] + 1)
    return (total[..., end] - total[..., first]) / (end - first)


def running_mean(values: Floats, length: int) -> Floats:
    """Mean of the last values along the last axis, same shape; fewer where there are fewer."""
    return mean_since(np.maximum(np.arange(1, values.shape[-1] + 1) - length, 0), values)


def averaged(conditioning: ConditioningParams, values: Floats, rate: float) -> Floats:
    """Running mean over the last T_avg of one record, shape (n,), at `rate` [Hz].

    While the window fills it is the mean of what there is.
    """
    return running_mean(values, max(1, round(conditioning.averaging_time * rate)))


def flex_of(sensor: SensorParams, counts: Floats) -> Floats:
    """Size of the flex [rad] that gives these readings without noise, same shape, never below 0.

    The reading does not tell the side of the bend: its sign has to be known from elsewhere.
    """
    volts, readings = flex_sensor.transfer_curve(sensor)
    voltage = np.interp(counts, readings, volts)
    odds = sensor.supply / voltage - 1.0  # upper half of the divider over the lower one
    resistance = sensor.divider_resistance * odds ** (
        1 if sensor.fixed_resistor == "ground" else -1
    )
    return np.maximum((resistance / sensor.flat_resistance - 1.0) / sensor.bend_gain, 0.0)


def between(grid: Floats, table: Floats, at: Floats) -> Floats:
    """Values between the rows of a table, straight from row to row.

    Args:
        grid: What each row stands for, rising, shape (r,).
        table: Shape (r, n).
        at: Where to look in each column, within the grid, shape (n,).
    """
    below = np.clip(np.searchsorted(grid, at, "right") - 1, 0, len(grid) - 2)
    share = (at - grid[below]) / (grid[below + 1] - grid[below])
    column = np.arange(len(at))
    return (1.0 - share) * table[below, column] + share * table[below + 1, column]
