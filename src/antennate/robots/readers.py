"""Which parameters of a robot only its hardware reads, and which only its simulation."""

from __future__ import annotations

from antennate.params.base import paths_of
from antennate.robots.antenna import AntennaSpec
from antennate.robots.servos import ServosParams

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
