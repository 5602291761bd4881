"""Where the parts of a robot are in the arrays of a compiled model."""

from __future__ import annotations

import numpy as np

from antennate.robots.spec import ANTENNA_PREFIXES, RobotSpec
from antennate.sim import layers
from antennate.sim.engine import mujoco
from antennate.types import Bools, Ints

ROBOT_AND_OBSTACLE = 3
"""Sum of the `kinds` of a contact between the robot and an obstacle."""


class Places:
    """Indices by part, found once by their names.

    Args:
        model: The compiled model.
        robot: The robot in it.
        prefix: Before its names.

    Attributes:
        root: First coordinate of the head's free joint.
        yaw, legs: Coordinates of these joints, shape (Y,) and (2 L,).
        hinges: Coordinates of the hinges under the flex sensors, shape (2, n).
        bent: Coordinates of all hinges of the antennae, one antenna after the other, shape (n,).
        bounded: Coordinates of all joints that do not turn without end, shape (n,).
        drives: Actuators of all driven joints in the robot's order, shape (n,).
        driven, turning: Coordinates and degrees of freedom of the same joints, shape (n,).
        links: Bodies of the links, head first, shape (L,).
        leg_geoms: Geoms of the legs, shape (2 L,).
        obstacles: Whether a geom is an obstacle, shape (geoms,).
        own: Whether it is the robot's, shape (geoms,).
        kinds: 1 for the robot's, 2 for an obstacle, 0 for others, shape (geoms,).
        parts: Name of the body of each geom, without the prefix.
    """

    def __init__(self, model: mujoco.MjModel, robot: RobotSpec, prefix: str) -> None:
        def coordinates(names: list[str]) -> Ints:
            return np.array([model.joint(prefix + n).qposadr[0] for n in names], np.int64)

        prefixes = ANTENNA_PREFIXES[: robot.antenna_count]
        bent = coordinates([p + h for p in prefixes for h in robot.antenna.hinge_names])
        names = list(robot.joint_names)
        self.root: int = model.joint(prefix + "root").qposadr[0]
        self.yaw: Ints = coordinates(list(robot.yaw_names))
        self.legs: Ints = coordinates(list(robot.leg_names))
        sensed = robot.antenna.sensed_hinges
        self.bent: Ints = bent
        self.hinges: Ints = bent.reshape(len(ANTENNA_PREFIXES), -1)[:, :sensed]
        pitch = coordinates(list(robot.pitch_names))
        self.bounded: Ints = np.concatenate([self.yaw, pitch, bent])
        self.drives: Ints = np.array([model.actuator(prefix + n).id for n in names])
        self.driven: Ints = coordinates(names)
        self.turning: Ints = np.array([model.joint(prefix + n).dofadr[0] for n in names])
        self.links: Ints = np.array([model.body(prefix + n).id for n in robot.link_names])
        self.leg_geoms: Ints = np.array([model.geom(prefix + n).id for n in robot.leg_names])
        self.obstacles: Bools = (model.geom_contype & layers.OBSTACLE) != 0
        owner = model.body_rootid[model.geom_bodyid]
        self.own: Bools = owner == model.body(prefix + robot.link_names[0]).id
        self.kinds: Ints = self.own + 2 * self.obstacles.astype(np.int64)
        bodies = [model.body(n).name.removeprefix(prefix) for n in range(model.nbody)]
        self.parts: list[str] = [bodies[n] for n in model.geom_bodyid.tolist()]
