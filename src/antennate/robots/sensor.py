"""The flex sensor, its voltage divider, and the converter of an ESP32."""

from __future__ import annotations

import math
from typing import Literal

from pydantic import model_validator

from antennate.params.base import Params, number
from antennate.params.control import CurveParams

CONVERTER_SLOPE = 196602 / 65536 / 4096
"""Volts per count and volt of reference: line fit at 11 dB, ESP-IDF adc_cali_line_fitting.c."""
CONVERTER_OFFSET = 0.142
"""Voltage up to which the converter reads zero [V]; same source."""
CONVERTER_LINE_END = 2880
"""Reading from which the converter compresses [counts]; same source."""
CONVERTER_STEP = 64
"""Counts from one entry of the tables below to the next; the first one is at CONVERTER_LINE_END."""
# fmt: off
CONVERTER_AT_1_0_V = (
    2240, 2297, 2352, 2405, 2457, 2512, 2564, 2616, 2664, 2709,
    2754, 2795, 2832, 2868, 2903, 2937, 2969, 3000, 3030, 3060,
)
"""Voltage of a compressed reading, ADC1, reference 1.0 V [mV]; same source."""
CONVERTER_AT_1_2_V = (
    2667, 2706, 2745, 2780, 2813, 2844, 2873, 2901, 2928, 2956,
    2982, 3006, 3032, 3059, 3084, 3110, 3135, 3160, 3184, 3209,
)
"""The same with a reference of 1.2 V [mV]."""
# fmt: on


class SensorParams(Params):
    """Flex sensor, voltage divider and the ESP32's converter."""

    active_length: float = number(0.0953, "m", "datasheet: Spectra Symbol FS-L-0095-103", gt=0)
    """Sensed length."""
    kind: Literal["flex", "fsr"] = number(
        "flex", "1", "assumed: the paper's ZD10-100, a pressure strip, is used as flex sensor"
    )
    """Flex sensor whose resistance rises with bending (flex) or falls with it (fsr)."""
    flat_resistance: float = number(10e3, "Ohm", "datasheet: Spectra Symbol FS-L-0095-103", gt=0)
    """Resistance unbent."""
    bend_gain: float = number(
        1.2 / math.pi,
        "1/rad",
        "datasheet: at least 2 at 180 deg (FS-L-0095-103); 2.2 assumed",
        gt=0,
    )
    """Relative rise of resistance per radian of flex."""
    unloaded_resistance: float = number(10e6, "Ohm", "datasheet: ZD10-100, above 10 MOhm", gt=0)
    """Resistance of an unbent fsr sensor."""
    pressed_resistance: float = number(5e3, "Ohm", "assumed: a few kOhm at full load", gt=0)
    """Resistance of an fsr sensor at a right angle."""
    hysteresis: float = number(0.10, "1", "datasheet: ZD10-100, +10 %", ge=0, le=0.25)
    """Widest gap between loading and unloading, in bends of a right angle."""
    creep: tuple[float, float] = number((0.025, 0.025), "1", "assumed: 5 %, as flex sensors show")
    """Shares of the response that come late."""
    creep_time: tuple[float, float] = number((0.3, 10.0), "s", "assumed: a fast and a slow part")
    """How late they come."""
    directions: Literal["both", "one"] = number(
        "both", "1", "assumed: a pressure strip, as the paper's ZD10-100, answers both ways"
    )
    """Whether the flex sensor sees bending towards the tail only (one) or either way."""
    divider_resistance: float = number(10e3, "Ohm", "assumed: what makers pair with it", gt=0)
    """Fixed resistor to ground."""
    supply: float = number(3.3, "V", "datasheet: ESP32 supply", gt=0)
    """Voltage over the divider."""
    reference: float = number(1.1, "V", "datasheet: ESP32, nominal; 1.0 to 1.2 V", ge=1.0, le=1.2)
    """Reference voltage of the converter."""
    oversampling: int = number(
        16,
        "1",
        "assumed: 100 readings a second of two sensors leave time for 16 samples each",
        ge=1,
        le=1024,
    )
    """Samples averaged to one reading."""
    sample_noise_counts: float = number(
        8.0, "counts", "assumed: reports of 25 counts peak to peak", ge=0
    )
    """Standard deviation of one sample on its own."""
    common_noise_counts: float = number(
        1.5, "counts", "assumed: 16 samples leave 2 to 3 counts, so a part is common", ge=0
    )
    """Standard deviation that all samples of a reading share."""
    outlier_share: float = number(0.01, "1", "assumed: reported spikes", ge=0, le=1)
    """Share of samples that are spikes."""
    outlier_counts: float = number(40.0, "counts", "assumed: reported spikes", ge=0)
    """Height of a spike, up or down."""
    rate: float = number(100.0, "Hz", "paper: about 100 Hz over serial", gt=0, le=1000)
    """Readings per second."""

    @property
    def noise_counts(self) -> float:
        """Standard deviation of one reading without spikes [counts]."""
        return math.hypot(
            self.common_noise_counts, self.sample_noise_counts / self.oversampling**0.5
        )

    @model_validator(mode="after")
    def _creep_is_a_part(self) -> SensorParams:
        if min(self.creep) < 0 or sum(self.creep) >= 1 or min(self.creep_time) <= 0:
            raise ValueError(
                f"creep must be at least 0 and below 1 in all with creep_time above 0, found "
                f"{self.creep} and {self.creep_time}"
            )
        return self

    @property
    def polarity(self) -> Literal[-1, 1]:
        """1 if readings rise with bending, -1 if they fall."""
        return 1 if self.kind == "fsr" else -1


def require_own_curve(sensor: SensorParams, name: str, curve: CurveParams | None) -> None:
    """Check that a curve, if there is one, can belong to a simulated flex sensor.

    Args:
        sensor: The flex sensor.
        name: The parameter that is the curve.
        curve: The curve from its counts to the level.

    Raises:
        ValueError: Its level would fall as the antenna bends.
    """
    if curve is not None and curve.polarity != sensor.polarity:
        way = "rise" if sensor.polarity > 0 else "fall"
        raise ValueError(
            f"{name}.polarity must be {sensor.polarity} for a {sensor.kind} sensor, whose readings "
            f"{way} with bending, found {curve.polarity}, the curve of another one; give "
            f"conditioning.toml of `antennate calibrate --antenna.sensor.kind {sensor.kind}`"
        )
