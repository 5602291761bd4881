"""One antenna: a chain of springs with a film along its base."""

from __future__ import annotations

import math
from typing import Annotated

from pydantic import Field

from antennate.params.base import Params, number
from antennate.robots.anatomy import ANTENNA_LINK_COUNT

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
