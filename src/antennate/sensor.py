"""Flex of the antenna to 12-bit counts: film resistance, voltage divider, ESP32 converter.

The film's resistance rises linearly with the bend it sees, R = R0 (1 + a |flex|), or with bending
towards the tail alone. It is the upper half of a divider, so the voltage, and with it the count,
falls when the antenna bends. The converter follows the manufacturer's line fit at 11 dB.
"""

from __future__ import annotations

import numpy as np

from antennate.params import SensorParams
from antennate.records import Floats

FULL_SCALE = 4095


def voltage(params: SensorParams, flex: Floats) -> Floats:
    """Divider voltage [V] for flex [rad], any shape; positive flex bends towards the tail."""
    bend = np.abs(flex) if params.directions == "both" else np.maximum(flex, 0.0)
    film = params.flat_resistance * (1.0 + params.bend_gain * bend)
    return params.supply * params.divider_resistance / (film + params.divider_resistance)


def counts(params: SensorParams, flex: Floats, noise: Floats | float = 0.0) -> Floats:
    """ADC reading [counts] for flex [rad]; noise [counts] is added before rounding and clipping."""
    exact = (voltage(params, flex) - params.adc_offset) / params.adc_gain
    return np.minimum(np.maximum(np.rint(exact + noise), 0.0), FULL_SCALE)
