"""One antenna: a chain of springs, and along its base a flex sensor with divider and converter."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Any, Literal

from pydantic import Field, SerializerFunctionWrapHandler, model_serializer, model_validator

from antennate import checks
from antennate.params.base import Params, number
from antennate.params.control import CurveParams
from antennate.robots.servos import ServoParams, XL330Params

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
"""Voltage of a compressed reading, ADC1, reference 1.2 V [mV]; same source."""
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
    """Fixed resistor to ground (or supply)."""
    fixed_resistor: Literal["ground", "supply"] = number(
        "ground", "1", "assumed: as makers wire it; the paper does not say"
    )
    """Where the fixed resistor leads to; the flex sensor leads to the other end of the divider."""
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
        return 1 if (self.kind == "fsr") == (self.fixed_resistor == "ground") else -1


def require_own_curve(sensor: SensorParams, name: str, curve: CurveParams | None) -> None:
    """Check that a curve, if there is one, can belong to a simulated flex sensor.

    Args:
        sensor: The flex sensor.
        name: The parameter that is the curve.
        curve: The curve from its counts to the level.
    """
    if curve is not None and curve.polarity != sensor.polarity:
        way = "rise" if sensor.polarity > 0 else "fall"
        raise ValueError(
            f"{name}.polarity must be {sensor.polarity} for a {sensor.kind} sensor, whose readings "
            f"{way} with bending, found {curve.polarity}, the curve of another one; give "
            f"conditioning.toml of `antennate calibrate --antenna.sensor.kind {sensor.kind}"
            f"{' --antenna.sensor.fixed-resistor supply' * (sensor.fixed_resistor == 'supply')}`"
        )


_Coils = Annotated[float, Field(ge=0.25, le=1000)]
"""Less than a quarter of a turn is no coil spring."""

_Range = Annotated[float, Field(gt=0, lt=3.1)]

N_MM_PER_DEG = 1e-3 * 180.0 / math.pi
"""One N·mm/deg in N·m/rad."""
MOST_HINGES = 100
"""More hinges than this are no chain of springs any more."""
BASE = "base"
"""Name of the joint that the base servo turns."""


_LEAST_INERTIA = 2e-15
"""Least moment of inertia of a body about its axis [kg·m²]: MuJoCo takes none below 1e-15."""


@dataclass(frozen=True, slots=True)
class BaseDrive:
    """How the base of an antenna is held: a position servo on its torque-speed line.

    Attributes:
        stiffness: Torque per angle off its target [N·m/rad].
        damping: Torque that speed takes [N·m·s/rad].
        armature: Inertia of the servo at its output [kg·m²].
        torque: Largest torque of the drive [N·m].
    """

    stiffness: float
    damping: float
    armature: float
    torque: float


class AntennaSpec(Params):
    """One antenna: a chain of torsion springs with a flex sensor along its base.

    It has as many hinges, and links of equal length, as `active_coils` has entries.

    Raises:
        ConfigError: A value is unknown or out of bounds, or values do not go together.
    """

    active_coils: tuple[_Coils, ...] = number(
        (3.0, 6.0, 6.0, 9.0, 9.0, 9.0),
        "1",
        "paper: one spring of 3, two of 6 and three of 9 active coils, stiff base to soft tip",
        min_length=1,
        max_length=MOST_HINGES,
    )
    """Active coils of each spring, base to tip; as many entries as the antenna has hinges."""
    three_coil_stiffness_n_mm_per_deg: float = number(
        0.274, "N·mm/deg", "paper: table of springs; 1/coils gives 0.137 and 0.091", gt=0
    )
    """Stiffness of a spring of three active coils."""
    sensor_stiffness_n_mm_per_deg: float = number(
        0.048, "N·mm/deg", "assumed: PET strip of 10 x 0.25 mm, E 3.5 GPa, 16.7 mm a hinge", ge=0
    )
    """Stiffness the flex sensor adds to each hinge it covers."""
    length: float = number(0.12, "m", "assumed: springs under a sensor of 0.1 m", gt=0.02, le=0.4)
    """Length from base to tip."""
    radius: float = number(0.003, "m", "assumed: coils of 5 mm, and the wire", gt=0, le=0.02)
    """Outer radius."""
    link_mass: float = number(0.0008, "kg", "assumed: steel coil and printed holder", gt=0)
    """Mass of one link."""
    base_mass: float = number(0.001, "kg", "assumed: printed horn", gt=0)
    """Mass that turns with the base servo."""
    damping_time: float = number(0.04, "s", "assumed: with less, the gait swings it", ge=0)
    """Relaxation time of a hinge."""
    armature: float = number(3e-6, "kg·m²", "assumed: keeps the light chain well conditioned", gt=0)
    """Inertia added per hinge."""
    range: float = number(1.4, "rad", "assumed: neighbouring holders meet", gt=0, lt=3.1)
    """Largest angle of one hinge."""
    ranges: tuple[_Range, ...] = number((), "rad", "assumed: all `range`, which empty means")
    """Largest angle of each hinge, base to tip, where they differ; at most `range`."""
    stop_time: float = number(
        0.02, "s", "assumed: that of the engine; a soft stop", gt=1e-5, le=0.1
    )
    """Time in which the stop of a hinge pushes back: the shorter, the stiffer. The engine takes at
    least two of its timesteps."""
    base_angle: float = number(
        math.radians(47.0), "rad", "assumed: tips lead and span the width", ge=0, lt=math.pi / 2
    )
    """Mounting angle from the heading, outwards."""
    roll: float = number(
        0.0, "rad", "paper: it bends in the plane of the robot", ge=0, le=0.5 * math.pi
    )
    """Turn of the plane in which it bends, about its own axis: 0 bends outwards, a right angle
    upwards, between them both at once."""
    base_spacing: float = number(0.04, "m", "assumed: two XL330 (20 mm) side by side", gt=0)
    """Distance of the two bases."""
    friction: float = number(0.3, "1", "assumed: printed plastic on paper", ge=0, le=2)
    """Friction against obstacles."""

    base_stiffness: float | None = number(
        None, "N·m/rad", "measured: that of its servo; 0.598 with an XL330-M288", gt=0
    )
    """Stiffness of the base; of the base servo if not given."""
    base_damping: float | None = number(
        None, "N·m·s/rad", "datasheet: that of its servo; 0.0482 with an XL330-M288", ge=0
    )
    """Damping of the base; of the base servo if not given."""
    base_armature: float | None = number(
        None, "kg·m²", "fitted: that of its servo; 0.0019 with an XL330-M288", ge=0
    )
    """Inertia of the base servo; of its model if not given."""
    base_torque: float | None = number(
        None, "N·m", "datasheet: that of its servo; 0.52 with an XL330-M288", gt=0
    )
    """Largest torque of the base servo's drive; of its model if not given."""
    sensor: SensorParams = SensorParams()

    @model_serializer(mode="wrap")
    def _without_what_is_absent(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """An antenna whose hinges have one range is written as before there were more."""
        table = handler(self)
        if not table.get("ranges", True):
            del table["ranges"]
        return table

    @model_validator(mode="after")
    def _sensor_fits(self) -> AntennaSpec:
        sensed = self.sensor.active_length
        usual = SensorParams.model_fields[
            "active_length"
        ].default  # its end lies idle on a short one
        if sensed > self.length and sensed != usual:
            raise ValueError(
                f"sensor.active_length must be at most the length of {self.length:g} m, found "
                f"{sensed:g} m"
            )
        return self

    @model_validator(mode="after")
    def _has_a_range_each(self) -> AntennaSpec:
        if self.ranges and len(self.ranges) != self.hinges:
            raise ValueError(
                f"ranges: expected {self.hinges} angles, one a hinge, found {len(self.ranges)}"
            )
        if max(self.hinge_ranges) > self.range:
            raise ValueError(
                f"ranges: expected at most range, {self.range:g} rad, found {max(self.ranges):g}"
            )
        return self

    @model_validator(mode="after")
    def _heavy_enough(self) -> AntennaSpec:
        for name, mass in (("link_mass", self.link_mass), ("base_mass", self.base_mass)):
            ball = 0.4 * self.radius**2  # of the unit of mass; a link has more
            if mass * ball < _LEAST_INERTIA:
                least = _LEAST_INERTIA / ball if ball else math.inf
                raise ValueError(
                    f"{name}: expected at least {least:.3g} kg with radius {self.radius:g} m, as "
                    f"the physics takes no body with less inertia about its axis, found {mass:g} kg"
                )
        return self

    def base(self, servo: ServoParams | None = None) -> BaseDrive:
        """How its base is held.

        The friction of the gear is left out: it exceeds what the springs of an antenna pull.

        Args:
            servo: Turns the base; an XL330-M288 if absent. Numbers of the antenna come first.

        Raises:
            ConfigError: The servo is none.
        """
        model = XL330Params() if servo is None else checks.instance("servo", servo, ServoParams)
        return BaseDrive(
            model.stiffness if self.base_stiffness is None else self.base_stiffness,
            model.damping if self.base_damping is None else self.base_damping,
            model.armature if self.base_armature is None else self.base_armature,
            model.stall_torque if self.base_torque is None else self.base_torque,
        )

    @property
    def hinges(self) -> int:
        """Number of hinges, which is also the number of links."""
        return len(self.active_coils)

    @property
    def hinge_names(self) -> tuple[str, ...]:
        """Names of hinges and links, base to tip."""
        return tuple(f"hinge{i}" for i in range(self.hinges))

    @property
    def hinge_ranges(self) -> tuple[float, ...]:
        """Largest angle of each hinge, base to tip [rad]."""
        return self.ranges or (self.range,) * self.hinges

    @property
    def link_length(self) -> float:
        """Length of one link [m]."""
        return self.length / self.hinges

    @property
    def mass(self) -> float:
        """Mass of the whole antenna [kg]."""
        return self.hinges * self.link_mass + self.base_mass

    @property
    def sensed_hinges(self) -> int:
        """Number of hinges, from the base, that lie under the flex sensor."""
        reached = math.ceil(self.sensor.active_length / self.link_length - 1e-9)
        return min(self.hinges, reached)

    def spring_stiffness(self) -> tuple[float, ...]:
        """Stiffness of the springs alone, base to tip [N·m/rad]."""
        per_coil = 3.0 * self.three_coil_stiffness_n_mm_per_deg * N_MM_PER_DEG
        return tuple(per_coil / coils for coils in self.active_coils)

    def hinge_stiffness(self) -> tuple[float, ...]:
        """Stiffness of the hinges, stiffened by the sensor where it lies [N·m/rad]."""
        sensor = self.sensor_stiffness_n_mm_per_deg * N_MM_PER_DEG
        springs = self.spring_stiffness()
        return tuple(k + sensor * (i < self.sensed_hinges) for i, k in enumerate(springs))
