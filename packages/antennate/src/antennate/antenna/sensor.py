"""Flex of the antenna [rad] to 12-bit counts: flex sensor, voltage divider, ESP32 converter.

`counts` is the static curve. A real sensor also has a memory: `SensorChain` adds hysteresis and
creep, both with the static curve as their mean.

- Flex sensor: `flex`, resistance R0 (1 + a |flex|); or `fsr`, a pressure strip whose conductance
  rises in proportion to the flex. It is the upper half of a voltage divider, so counts fall with
  the flex for `flex` and rise for `fsr`; or the lower half, if `fixed_resistor` is `supply`.
- Hysteresis: play operators (Prandtl-Ishlinskii). A play operator of half width r keeps its output
  until the input is more than r away, then follows at that distance. Operators of weights w and
  half widths r make a loop of the width 2 sum(w r).
- Creep: a share c of the response follows with a time constant (Prony series).
- Converter: the manufacturer's line fit at 11 dB up to 2880 counts and its table above; voltages
  below the line's offset read zero.
"""

from __future__ import annotations

import math

import numpy as np

from antennate.robots.antenna import (
    CONVERTER_AT_1_0_V,
    CONVERTER_AT_1_2_V,
    CONVERTER_LINE_END,
    CONVERTER_OFFSET,
    CONVERTER_SLOPE,
    CONVERTER_STEP,
    SensorParams,
)
from antennate.types import Bools, Floats, Ints

FULL_SCALE = 4095
RIGHT_ANGLE = math.pi / 2
"""The flex to which hysteresis and the pressed resistance refer [rad]."""

_PLAY_SHARES = (0.25, 0.6, 1.0)
"""Half widths of the play operators, relative to the widest one."""
_PLAY_WEIGHT = 0.2
"""Weight of each play operator; the rest of the response has no memory."""


def sensed_flex(params: SensorParams, flex: Floats) -> Floats:
    """The part of the flex [rad] that changes the resistance [rad], at least 0, same shape."""
    return np.abs(flex) if params.directions == "both" else np.maximum(flex, 0.0)


def resistance(params: SensorParams, sensed: Floats) -> Floats:
    """Resistance of the flex sensor [Ohm] at a sensed flex of at least 0 [rad], same shape."""
    if params.kind == "flex":
        return params.flat_resistance * (1.0 + params.bend_gain * sensed)
    idle, pressed = 1.0 / params.unloaded_resistance, 1.0 / params.pressed_resistance
    return 1.0 / (idle + (pressed - idle) * sensed / RIGHT_ANGLE)


def divider(params: SensorParams, sensed: Floats) -> Floats:
    """Voltage [V] over the lower half of a divider with a flex sensor of `sensed` [Ohm]."""
    lower = params.divider_resistance if params.fixed_resistor == "ground" else sensed
    return params.supply * lower / (sensed + params.divider_resistance)


def transfer_curve(params: SensorParams) -> tuple[Floats, Floats]:
    """Corners of the converter's curve: voltages [V] and readings [counts], both rising, (n,)."""
    share = (params.reference - 1.0) / 0.2
    low, high = np.array(CONVERTER_AT_1_0_V), np.array(CONVERTER_AT_1_2_V)
    table = 1e-3 * (low + share * (high - low))
    line_end = CONVERTER_OFFSET + CONVERTER_SLOPE * params.reference * CONVERTER_LINE_END
    volts = np.concatenate([[CONVERTER_OFFSET, line_end], table[1:]])
    readings = CONVERTER_LINE_END + CONVERTER_STEP * np.arange(len(table))
    return volts, np.concatenate([[0.0], readings])


def counts(params: SensorParams, flex: Floats, noise: Floats | float = 0.0) -> Floats:
    """Static reading [counts] at flex [rad]; noise [counts] comes before rounding and clipping."""
    return _read(params, sensed_flex(params, flex), noise, transfer_curve(params))


def _read(
    params: SensorParams, sensed: Floats, noise: Floats | float, curve: tuple[Floats, Floats]
) -> Floats:
    exact = np.interp(divider(params, resistance(params, sensed)), *curve)
    return np.minimum(np.maximum(np.rint(exact + noise), 0.0), FULL_SCALE)


def reading_noise(params: SensorParams, rng: np.random.Generator, shape: tuple[int, ...]) -> Floats:
    """Noise of readings [counts] of a given shape: each is a mean of samples, some with spikes."""
    noise = rng.normal(0.0, params.noise_counts, shape)
    spikes = rng.binomial(params.oversampling, params.outlier_share, shape)
    up = rng.binomial(spikes, 0.5)
    return noise + params.outlier_counts * (2 * up - spikes) / params.oversampling


class SensorChain:
    """Flex sensors with hysteresis and creep, sampled at a steady rate.

    Args:
        params: Sensor, divider and converter.
        shape: Shape of the sensors, such as (B, 2).
        period: Time between samples [s].
    """

    def __init__(self, params: SensorParams, shape: tuple[int, ...], period: float) -> None:
        self._params = params
        widest = params.hysteresis * RIGHT_ANGLE / (2.0 * _PLAY_WEIGHT * sum(_PLAY_SHARES))
        tail = (1,) * len(shape)
        self._slack: Floats = widest * np.array(_PLAY_SHARES).reshape(-1, *tail)
        late = np.array(params.creep).reshape(-1, *tail)
        self._late: Floats = late
        self._prompt = 1.0 - float(late.sum())
        self._pace: Floats = -np.expm1(-period / np.array(params.creep_time)).reshape(-1, *tail)
        self._play: Floats = np.zeros((len(_PLAY_SHARES), *shape))
        self._crept: Floats = np.zeros((len(params.creep), *shape))
        self._curve = transfer_curve(params)

    def reset(self, rows: int | Ints | Bools) -> None:
        """Let the sensors of some rows forget, as if they had been straight for long."""
        self._play[:, rows] = 0.0
        self._crept[:, rows] = 0.0

    def step(self, flex: Floats, noise: Floats | float = 0.0, rows: Bools | None = None) -> Floats:
        """Sample all sensors once.

        Args:
            flex: Summed hinge angles under each sensor [rad], of the shape given.
            noise: Added before rounding and clipping [counts].
            rows: Rows whose sensors remember this sample, shape (B,); all if not given.

        Returns:
            Readings [counts], same shape.
        """
        play, crept = self._play, self._crept.copy() if rows is not None else self._crept
        sensed = self.with_memory(sensed_flex(self._params, flex))
        if rows is not None:
            self._play[:, ~rows], self._crept[:, ~rows] = play[:, ~rows], crept[:, ~rows]
        return _read(self._params, sensed, noise, self._curve)

    def with_memory(self, sensed: Floats) -> Floats:
        """Sensed flex [rad], at least 0, with hysteresis and creep after one more sample."""
        self._play = np.maximum(sensed - self._slack, np.minimum(sensed + self._slack, self._play))
        share = 1.0 - _PLAY_WEIGHT * len(_PLAY_SHARES)
        slack = share * sensed + _PLAY_WEIGHT * self._play.sum(axis=0)
        self._crept += self._pace * (slack - self._crept)
        return np.maximum(self._prompt * slack + (self._late * self._crept).sum(axis=0), 0.0)


def best_divider(
    params: SensorParams, largest_flex: float, candidates: Floats
) -> tuple[float, Floats]:
    """The fixed resistor that spreads readings farthest between straight and bent.

    Args:
        params: Sensor and converter; its own divider is ignored.
        largest_flex: The flex to be told apart from none [rad].
        candidates: Resistors to choose from [Ohm], shape (n,).

    Returns:
        The best of them [Ohm] and the spread of each [counts], shape (n,).
    """
    ends = np.array([0.0, largest_flex])
    spread = np.array(
        [
            abs(np.diff(counts(params.model_copy(update={"divider_resistance": r}), ends))[0])
            for r in candidates.tolist()
        ]
    )
    return float(candidates[int(np.argmax(spread))]), spread
