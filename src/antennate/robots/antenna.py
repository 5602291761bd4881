"""One antenna: a chain of springs with a flex sensor along its base."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

from pydantic import Field, model_validator

from antennate import checks
from antennate.params.base import Params, number
from antennate.robots.sensor import SensorParams
from antennate.robots.servos import ServoParams, XL330Params

_Coils = Annotated[float, Field(ge=0.25, le=1000)]
"""Less than a quarter of a turn is no coil spring."""

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
    base_angle: float = number(
        math.radians(47.0), "rad", "assumed: tips lead and span the width", ge=0, lt=math.pi / 2
    )
    """Mounting angle from the heading, outwards."""
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
