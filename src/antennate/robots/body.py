"""The walking robot: servos, links, legs."""

from __future__ import annotations

import math

from pydantic import model_validator

from antennate.params.base import Params, number
from antennate.robots.anatomy import ANTENNA_LINK_COUNT, LINK_COUNT
from antennate.robots.antenna import AntennaParams
from antennate.robots.sensor import SensorParams


class ServoParams(Params):
    """DYNAMIXEL XC430-W240-T at 11.1 V, in position mode."""

    stall_torque: float = number(
        1.7, "N·m", "datasheet: XC430-W240, 11.1 V", "torque at standstill", gt=0
    )
    no_load_speed: float = number(
        65.0 * 2.0 * math.pi / 60.0,
        "rad/s",
        "datasheet: XC430-W240, 65 rpm at 11.1 V",
        "speed unloaded",
        gt=0,
    )
    position_gain: float = number(
        700 / 128 * 4096 / (2 * math.pi) / 885,
        "1/rad",
        "datasheet: Position P Gain 700, scaled by 1/128 to PWM counts a tick of 1/4096 turn, PWM "
        "limit 885",
        "share of the full drive per radian of position error",
        gt=0,
    )
    armature: float = number(
        0.003,
        "kg·m²",
        "assumed: rotor of about 5e-8 kg·m² behind a 245:1 gear",
        "inertia at the output",
        ge=0,
    )

    @property
    def stiffness(self) -> float:
        """Torque per radian of position error, before saturation [N·m/rad]."""
        return self.stall_torque * self.position_gain

    @property
    def damping(self) -> float:
        """Slope of the torque-speed line [N·m·s/rad]: full drive holds no_load_speed unloaded."""
        return self.stall_torque / self.no_load_speed


class RobotParams(Params):
    """Six links, five yaw joints, twelve O-legs."""

    link_pitch: float = number(
        0.10,
        "m",
        "assumed: one yaw servo and two leg servos (28.5 x 46.5 x 34 mm) a link",
        "joint spacing",
        gt=0.03,
    )
    mass: float = number(
        2.0,
        "kg",
        "assumed: 17 servos of 65 g (datasheet) and as much again in frames and legs",
        "total mass",
        gt=0.3,
    )
    width: float = number(
        0.20,
        "m",
        "paper: a free section of 0.40 m is called about twice the robot's width",
        "width over the legs",
        gt=0.08,
    )
    leg_radius: float = number(
        0.030,
        "m",
        "assumed: a ring under the 34 mm body that gives 0.12 m/s within the servo's speed",
        "outer radius of an O-leg",
        gt=0,
    )
    leg_eccentricity: float = number(
        0.012, "m", "assumed: as leg_radius", "distance of the ring's centre from its axle", ge=0
    )
    leg_width: float = number(
        0.016, "m", "assumed: printed ring with a rubber tread", "thickness of an O-leg", gt=0
    )
    leg_mass: float = number(0.020, "kg", "assumed: printed ring", "mass of one O-leg", gt=0)
    leg_friction: float = number(
        0.6,
        "1",
        "assumed: rubber on a laboratory floor, 0.5 to 0.8",
        "friction of a leg on the floor",
        gt=0,
        le=2,
    )
    body_friction: float = number(
        0.3,
        "1",
        "assumed: printed plastic on paper",
        "friction of the body against obstacles",
        ge=0,
        le=2,
    )
    body_radius: float = number(
        0.020,
        "m",
        "assumed: half the height of the servo and its frame",
        "radius of spine and cross-beams",
        gt=0,
    )
    pitch_stiffness: float = number(
        30.0,
        "N·m/rad",
        "assumed: a servo that holds; the paper leaves pitch unused",
        "stiffness of a locked pitch joint",
        gt=0,
    )
    antenna: AntennaParams = AntennaParams()
    sensor: SensorParams = SensorParams()
    servo: ServoParams = ServoParams()

    @property
    def length(self) -> float:
        """Robot length without antennae [m]."""
        return LINK_COUNT * self.link_pitch

    @property
    def link_mass(self) -> float:
        """Mass of one link without its legs [kg]."""
        antennae = 2 * (ANTENNA_LINK_COUNT * self.antenna.link_mass + self.antenna.base_mass)
        return (self.mass - 2 * LINK_COUNT * self.leg_mass - antennae) / LINK_COUNT

    @model_validator(mode="after")
    def _mass_left_for_links(self) -> RobotParams:
        if self.link_mass <= 0.01:
            raise ValueError(
                f"mass must leave more than 10 g a link beside legs and antennae, got {self.mass} "
                "kg"
            )
        return self
