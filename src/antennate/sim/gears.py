"""Friction of gears that grows with the torque of their motors, where servos have it."""

from __future__ import annotations

import numpy as np

from antennate.robots.spec import RobotSpec
from antennate.sim.engine import mujoco
from antennate.types import Floats, Ints


class Gears:
    """The joints of a robot in a model, but its antennae.

    Args:
        model: The model, whose joints get that friction.
        robot: The robot.
        prefix: Before its names in the model.

    Attributes:
        share: Friction as a share of the torque of the motor, of those joints that have it, (n,).
        drive, dof: Actuators and degrees of freedom of these joints, shape (n,).
        dry: Their friction without a load [N·m], shape (n,).
        damping: Their damping [N·m·s/rad], shape (n,).
    """

    def __init__(self, model: mujoco.MjModel, robot: RobotSpec, prefix: str) -> None:
        self._model = model
        share: dict[str, float] = {}
        for group, joints, _ in robot.groups:
            if group != "antennae":
                loaded = robot.servos.of(joints.servo).load_friction
                share |= dict.fromkeys(robot.joint_names[robot.places(group)], loaded)
        names = [name for name in share if share[name] > 0.0]
        self.share: Floats = np.array([share[name] for name in names])
        self.drive: Ints = np.array([model.actuator(prefix + n).id for n in names], np.int64)
        self.dof: Ints = np.array([model.joint(prefix + n).dofadr[0] for n in names], np.int64)
        self.dry: Floats = model.dof_frictionloss[self.dof]
        self.damping: Floats = model.dof_damping[self.dof]

    def step(self, data: mujoco.MjData, count: int) -> None:
        """Advance by `count` physics steps, each with friction from the torques of the one before.

        Raises:
            mujoco.FatalError: The engine failed.
        """
        if not len(self.dof):
            mujoco.mj_step(self._model, data, count)
            return
        for _ in range(count):
            motor = data.actuator_force[self.drive] - self.damping * data.qvel[self.dof]
            self._model.dof_frictionloss[self.dof] = self.dry + self.share * abs(motor)
            mujoco.mj_step(self._model, data)
