"""A walk of a gait as a table: what the servos are told, and where the head is then.

Whoever drives the exported model by it, in the engine or in another, sees how far the two agree.
"""

from __future__ import annotations

import csv
import io
from typing import NamedTuple

import numpy as np

from antennate.control.gait import Gait
from antennate.params.gaits import GaitParams
from antennate.sim.engine import mujoco
from antennate.sim.export.parts import GEARS, PERIOD, START
from antennate.sim.world import World
from antennate.types import Floats, Maneuver, joint_angles

HEAD = ("head_x", "head_y", "head_z")
TICKS = 300
"""Length of a walk in control periods: 3 s at 100 Hz."""


class Walk(NamedTuple):
    """A walk.

    Attributes:
        servos: Names of the servos' joints, in the robot's order.
        goals: Their targets at each tick [rad], shape (ticks, servos).
        head: Position of the head at the end of each tick [m], shape (ticks, 3).
    """

    servos: tuple[str, ...]
    goals: Floats
    head: Floats

    def table(self) -> str:
        """Goals and head as CSV, in digits that bring back the same numbers."""
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow([*self.servos, *HEAD])
        writer.writerows(np.hstack([self.goals, self.head]).tolist())
        return text.getvalue()


def walk(world: World, gait: GaitParams, period: float, ticks: int = TICKS) -> Walk:
    """Walk ahead from where the robot stands, without touch and without chance.

    Args:
        world: The robot at its start; it is moved.
        gait: The gait.
        period: Control period [s], a whole number of physics steps.
        ticks: How many of them.
    """
    robot, steps = world.robot, round(period / world.model.opt.timestep)
    walker, parts = Gait(gait, robot, 1, period), list(robot.command_shapes())
    goals, head = np.empty((ticks, len(robot.joint_names))), np.empty((ticks, 3))
    for tick in range(ticks):
        command = walker.step(np.array([int(Maneuver.FORWARD)]))
        goals[tick] = joint_angles(command, parts)[0]
        world.command(goals[tick])
        world.step(steps)
        head[tick] = world.head
    return Walk(robot.joint_names, goals, head)


def head_in_model(model: mujoco.MjModel, walk: Walk) -> Floats:
    """Where the head of an exported model goes by the same targets [m], shape (ticks, 3).

    It is what `walk.py` in the exported folder does.
    """
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key(START).id)
    mujoco.mj_forward(model, data)
    servos = [model.actuator(name).id for name in walk.servos]
    for servo in np.flatnonzero(model.actuator_delay).tolist():
        angle = data.qpos[model.jnt_qposadr[model.actuator_trnid[servo, 0]]]
        held = np.full((model.actuator_history[servo, 0], 1), angle)
        mujoco.mj_initCtrlHistory(model, data, servo, None, held)
    steps = round(model.numeric(PERIOD).data[0] / model.opt.timestep)
    numerics = {model.numeric(i).name for i in range(model.nnumeric)}
    share = model.numeric(GEARS).data if GEARS in numerics else np.zeros(model.nu)
    dof = model.jnt_dofadr[model.actuator_trnid[:, 0]]
    dry, damping = model.dof_frictionloss[dof], model.dof_damping[dof]
    root, head = int(model.joint("root").qposadr[0]), np.empty_like(walk.head)
    for tick, goals in enumerate(walk.goals):
        data.ctrl[servos] = goals
        for _ in range(steps):
            motor = data.actuator_force - damping * data.qvel[dof]
            model.dof_frictionloss[dof] = dry + share * abs(motor)
            mujoco.mj_step(model, data)
        head[tick] = data.qpos[root : root + 3]
    return head
