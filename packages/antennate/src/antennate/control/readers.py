"""Which parameters a robot, its simulation and a policy read, and which they do not."""

from __future__ import annotations

from antennate.params.base import paths_of
from antennate.params.control import (
    ControlParams,
)
from antennate.params.gaits import LiftParams
from antennate.robots.antenna import AntennaSpec
from antennate.robots.imu import ImuParams
from antennate.robots.joints import BaseParams, ElevationParams, LegParams, YawParams
from antennate.robots.servos import ServosParams
from antennate.robots.spec import RobotSpec

_GROUPS = ("yaw", "legs", "antennae", "pitch", "elevation")
HARDWARE_ALONE = (
    *(
        f"robot.{group}.{name}"
        for group in _GROUPS
        for name in ("ids", "directions", "zeros", "limit", "fastest")
        if (group, name) not in (("yaw", "limit"), ("legs", "fastest"))
    ),
    "robot.antenna.sensor.rate",
    "robot.baud",
    "robot.release",
)
"""Parameters that only the robot's hardware, or its twin, reads; the simulation alone does not."""
SIMULATION_ALONE = (
    *(
        f"robot.{name}"
        for name in (
            "mass",
            "bodies",
            "meshes",
            "leg_width",
            "leg_mass",
            "leg_friction",
            "body_friction",
            "body_radius",
            "yaw.backlash",
            "legs.friction_factors",
            "antennae.right_stiffness",
            "antennae.right_gain",
            "pitch.stiffness",
            "elevation.mass",
            "legs.reach",
            "imu.gyro_noise",
            "imu.gyro_bias",
            "imu.accel_noise",
            "imu.accel_bias",
        )
    ),
    *(f"robot.{group}.gain_factor" for group in _GROUPS),
    *paths_of(ServosParams, "robot.servos"),
    *paths_of(AntennaSpec, "robot.antenna"),
)
"""Parameters that only the simulation, or the twin, reads; the robot's hardware does not."""
_OF_FOLLOWING = {
    f"robot.servos.{servo}.{name}"
    for servo in ServosParams.model_fields
    for name in ("p_gain", "gain_divisor", "no_load_speed")
} | {f"robot.{group}.gain_factor" for group in _GROUPS}
UNDRIVEN = tuple(path for path in SIMULATION_ALONE if path not in _OF_FOLLOWING)
"""Parameters that a drive does not read; by models of its servos it judges if joints follow."""


def unused(robot: RobotSpec) -> dict[str, str]:
    """Parameters of what a robot does not have, as `robot.servos...`, and why."""
    used = {f"robot.servos.{name}" for name in robot.servo_names}
    paths = paths_of(ServosParams, "robot.servos")
    servos = (path for path in paths if path.rpartition(".")[0] not in used)
    reasons = dict.fromkeys(servos, "no joint of the robot has this servo")
    if not robot.leg_count:
        legs = (f"robot.legs.{name}" for name in LegParams.model_fields if name != "kind")
        names = ("radius", "eccentricity", "width", "mass", "friction")
        yaw = (f"robot.yaw.{name}" for name in YawParams.model_fields)
        paths = (*legs, *(f"robot.leg_{name}" for name in names), *yaw, "robot.pitch.stiffness")
        reasons |= dict.fromkeys(paths, "a bench has one link and no legs")
    elif robot.legs.kind == "rolling":
        lifting = ("robot.legs.limit", "robot.legs.reach")
        reasons |= dict.fromkeys(lifting, "only legs of the kind lifting have it")
    if robot.pitch.kind == "actuated":
        reasons["robot.pitch.stiffness"] = "only pitch joints of the kind locked have it"
    else:
        reasons["robot.pitch.gain_factor"] = "only pitch joints of the kind actuated have it"
    if not robot.elevation_count:
        names = (name for name in ElevationParams.model_fields if name != "kind")
        paths = (f"robot.elevation.{name}" for name in names)
        reasons |= dict.fromkeys(paths, "the antennae of the robot have no vertical joints")
    if not robot.has_imu:
        paths = (f"robot.imu.{name}" for name in ImuParams.model_fields if name != "kind")
        reasons |= dict.fromkeys(paths, "the robot has no inertial sensor")
    if robot.antenna_count == 1:
        paths = ("robot.antennae.right_stiffness", "robot.antennae.right_gain")
        paths = (*paths, "robot.antenna.base_spacing")
        reasons |= dict.fromkeys(paths, "the robot has one antenna")
    if not robot.antenna_count:
        bases = (f"robot.antennae.{name}" for name in BaseParams.model_fields if name != "kind")
        paths = (*bases, *paths_of(AntennaSpec, "robot.antenna"))
        reasons |= dict.fromkeys(paths, "the robot has no antennae")
    return reasons


_POLICY = ("rate", "gait.", "conditioning", "rule.threshold", "rule.hysteresis")
UNREAD_BY_POLICIES = tuple(p for p in paths_of(ControlParams) if not p.startswith(_POLICY))
"""Parameters of `ControlParams`, dotted, that a policy file does not read. Another rate or gait
than that of its contract is refused with it."""


def unread_lift(robot: RobotSpec, gait: str) -> dict[str, str]:
    """Parameters of the step of lifting legs that our gait does not read, and why.

    Args:
        robot: The robot that walks.
        gait: Where the gait stands in a configuration, dotted.
    """
    paths = () if robot.legs.kind == "lifting" else paths_of(LiftParams, f"{gait}.lift")
    return dict.fromkeys(paths, "legs that roll do not read it")
