"""One antenna on the bench: springs, film, divider and converter."""

from __future__ import annotations

import math
from typing import Annotated, Literal

from pydantic import Field

from antennate.anatomy import ANTENNA_LINK_COUNT
from antennate.params.base import Params, number

_Coils = Annotated[float, Field(gt=0)]

N_MM_PER_DEG = 1e-3 * 180.0 / math.pi
"""One N·mm/deg in N·m/rad."""


class AntennaParams(Params):
    """One antenna: a chain of six torsion springs with a film sensor along its base."""

    active_coils: tuple[_Coils, _Coils, _Coils, _Coils, _Coils, _Coils] = number(
        (3.0, 6.0, 6.0, 9.0, 9.0, 9.0),
        "1",
        "paper: one spring of 3, two of 6 and three of 9 active coils, stiff base to soft tip",
        "active coils of each spring, base to tip",
    )
    three_coil_stiffness_n_mm_per_deg: float = number(
        0.274,
        "N·mm/deg",
        "paper: table of springs; stiffness goes with 1/coils, so 0.137 and 0.091 follow",
        "stiffness of a spring of three active coils",
        gt=0,
    )
    film_stiffness_n_mm_per_deg: float = number(
        0.048,
        "N·mm/deg",
        "assumed: bending stiffness of a 10 x 0.25 mm PET strip, E 3.5 GPa, per 16.7 mm hinge",
        "stiffness the sensor film adds to each hinge it covers",
        ge=0,
    )
    length: float = number(
        0.12,
        "m",
        "assumed: unpublished; six springs and holders under a sensor of about 0.1 m",
        "length from base to tip",
        gt=0.02,
        le=0.4,
    )
    radius: float = number(
        0.003, "m", "assumed: coils of about 5 mm diameter and wire", "outer radius", gt=0, le=0.02
    )
    link_mass: float = number(
        0.0008,
        "kg",
        "assumed: unpublished; steel coil and printed holder",
        "mass of one link",
        gt=0,
    )
    base_mass: float = number(
        0.001, "kg", "assumed: printed horn", "mass that turns with the base servo", gt=0
    )
    damping_time: float = number(
        0.04,
        "s",
        "assumed: damping over stiffness of a hinge; with less, the gait alone swings the antenna",
        "relaxation time of a hinge",
        ge=0,
    )
    armature: float = number(
        3e-6,
        "kg·m²",
        "assumed: keeps the light chain well conditioned",
        "inertia added per hinge",
        gt=0,
    )
    range: float = number(
        1.4, "rad", "assumed: neighbouring holders meet", "largest angle of one hinge", gt=0, lt=3.1
    )
    base_angle: float = number(
        math.radians(47.0),
        "rad",
        "assumed: unpublished; tips then lead the head and span the body width",
        "mounting angle from the heading, outwards",
        ge=0,
        lt=math.pi / 2,
    )
    base_spacing: float = number(
        0.04,
        "m",
        "assumed: two XL330 servos (20 mm wide) side by side",
        "distance of the two bases",
        gt=0,
    )
    friction: float = number(
        0.3, "1", "assumed: printed plastic on paper", "friction against obstacles", ge=0, le=2
    )

    @property
    def link_length(self) -> float:
        """Length of one link [m]."""
        return self.length / ANTENNA_LINK_COUNT

    def spring_stiffness(self) -> tuple[float, ...]:
        """Stiffness of the six springs alone, base to tip [N·m/rad]."""
        per_coil = 3.0 * self.three_coil_stiffness_n_mm_per_deg * N_MM_PER_DEG
        return tuple(per_coil / coils for coils in self.active_coils)

    def hinge_stiffness(self, covered: int) -> tuple[float, ...]:
        """Stiffness of the six hinges with the film over the first `covered` of them [N·m/rad]."""
        film = self.film_stiffness_n_mm_per_deg * N_MM_PER_DEG
        springs = self.spring_stiffness()
        return tuple(k + film * (i < covered) for i, k in enumerate(springs))


class SensorParams(Params):
    """Flex film, voltage divider and the ESP32's converter."""

    active_length: float = number(
        0.0953, "m", "datasheet: Spectra Symbol FS-L-0095-103, active length", "sensed length", gt=0
    )
    flat_resistance: float = number(
        10e3,
        "Ohm",
        "datasheet: Spectra Symbol FS-L-0095-103, flat 10 kOhm",
        "resistance unbent",
        gt=0,
    )
    bend_gain: float = number(
        1.2 / math.pi,
        "1/rad",
        "datasheet: at least doubled at 180 deg (FS-L-0095-103); 2.2 assumed",
        "relative rise of resistance per radian of flex",
        gt=0,
    )
    directions: Literal["both", "one"] = number(
        "both",
        "1",
        "assumed: the paper's ZD10-100 is sold as a pressure strip, which answers bending either "
        "way",
        "whether the film sees bending towards the tail only (one) or either way",
    )
    divider_resistance: float = number(
        10e3,
        "Ohm",
        "assumed: the value makers pair with this film",
        "fixed resistor to ground",
        gt=0,
    )
    supply: float = number(3.3, "V", "datasheet: ESP32 supply", "voltage over the divider", gt=0)
    adc_gain: float = number(
        0.8056e-3, "V", "datasheet: ESP-IDF line fit at 11 dB, Vref 1.1 V", "volts per count", gt=0
    )
    adc_offset: float = number(
        0.142,
        "V",
        "datasheet: ESP-IDF line fit at 11 dB, Vref 1.1 V",
        "voltage that reads zero",
        ge=0,
    )
    noise_counts: float = number(
        2.5,
        "counts",
        "assumed: 8 counts a sample; averaging 16 leaves 2-3 as part of it is correlated",
        "standard deviation of one reading",
        ge=0,
    )
    rate: float = number(
        100.0, "Hz", "paper: about 100 Hz over serial", "readings per second", gt=0, le=1000
    )

    def covered_hinges(self, antenna: AntennaParams) -> int:
        """Number of hinges, from the base, that lie under the film."""
        pitch = antenna.link_length
        return min(ANTENNA_LINK_COUNT, math.ceil(self.active_length / pitch - 1e-9))
