"""Which parameters of a robot only its hardware reads, and which only its simulation."""

from __future__ import annotations

from antennate.params.base import paths_of
from antennate.robots.antenna import AntennaSpec
from antennate.robots.joints import BaseParams
from antennate.robots.servos import ServosParams
from antennate.robots.spec import RobotSpec

HARDWARE_ALONE = (
    *(
        f"robot.{group}.{name}"
        for group in ("yaw", "legs", "antennae", "pitch")
        for name in ("ids", "directions", "zeros", "limit", "fastest")
        if (group, name) != ("yaw", "limit")
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
            "leg_width",
            "leg_mass",
            "leg_friction",
            "body_friction",
            "body_radius",
            "pitch.stiffness",
            "legs.reach",
        )
    ),
    *paths_of(ServosParams, "robot.servos"),
    *paths_of(AntennaSpec, "robot.antenna"),
)
"""Parameters that only the simulation, or the twin, reads; the robot's hardware does not."""
_OF_FOLLOWING = {
    f"robot.servos.{servo}.{name}"
    for servo in ServosParams.model_fields
    for name in ("p_gain", "gain_divisor", "no_load_speed")
}
UNDRIVEN = tuple(path for path in SIMULATION_ALONE if path not in _OF_FOLLOWING)
"""The same of a drive, which judges by the models of its servos whether joints follow."""


def unused(robot: RobotSpec) -> dict[str, str]:
    """Parameters of what a robot does not have, as `robot.servos...`, and why."""
    used = {f"robot.servos.{name}" for name in robot.servo_names}
    every = paths_of(ServosParams, "robot.servos")
    servos = (path for path in every if path.rpartition(".")[0] not in used)
    found = dict.fromkeys(servos, "no joint of the robot has this servo")
    if robot.legs.kind == "rolling":
        lifting = ("robot.legs.limit", "robot.legs.reach")
        found |= dict.fromkeys(lifting, "only legs of the kind lifting have it")
    if robot.pitch.kind == "actuated":
        found["robot.pitch.stiffness"] = "only pitch joints of the kind locked have it"
    if not robot.antenna_count:
        bases = (f"robot.antennae.{name}" for name in BaseParams.model_fields if name != "kind")
        paths = (*bases, *paths_of(AntennaSpec, "robot.antenna"))
        found |= dict.fromkeys(paths, "the robot has no antennae")
    return found
