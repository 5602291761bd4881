"""A fly that walks on a flat floor, as FlyGym ships it, with a tripod gait of sines."""

from __future__ import annotations

from importlib import metadata
from typing import Any

import numpy as np
from answering import Job, answer
from flygym.anatomy import ActuatedDOFPreset, AxisOrder, JointPreset, Skeleton
from flygym.compose import ActuatorType, FlatGroundWorld, KinematicPosePreset, NeuroMechFly
from flygym.simulation import Simulation
from flygym.utils.math import Rotation3D

FREQUENCY = 12.0
"""Steps of a leg [Hz]."""
SWING = 0.25
"""Amplitude of the pitch joints [rad]."""
LATE = {"lf": 0.0, "lm": np.pi, "lh": 0.0, "rf": np.pi, "rm": 0.0, "rh": np.pi}


def walk(told: dict[str, Any]) -> Job:
    """The fly with position servos at all active joints of its legs, and adhesive feet."""
    fly = NeuroMechFly()
    pose = KinematicPosePreset.NEUTRAL
    skeleton = Skeleton(axis_order=AxisOrder.YAW_PITCH_ROLL, joint_preset=JointPreset.LEGS_ONLY)
    fly.add_joints(skeleton, neutral_pose=pose)
    moved = fly.skeleton.get_actuated_dofs_from_preset(ActuatedDOFPreset.LEGS_ACTIVE_ONLY)
    kind = ActuatorType.POSITION
    fly.add_actuators(moved, actuator_type=kind, kp=50.0, neutral_input=pose)
    fly.add_leg_adhesion()
    world = FlatGroundWorld()
    world.add_fly(fly, (0, 0, 0.8), Rotation3D("quat", (1, 0, 0, 0)))
    simulation = Simulation(world)
    order = fly.get_actuated_jointdofs_order(kind)
    middle = simulation.get_joint_angles(fly.name)[
        [fly.get_jointdofs_order().index(one) for one in order]
    ]
    pitch = np.array([one.axis.value == "pitch" for one in order])
    late = np.array([LATE[one.child.name[:2]] for one in order])
    simulation.set_leg_adhesion_states(fly.name, np.ones(6))
    step = simulation.mj_model.opt.timestep

    def go_on(seconds: float) -> None:
        for _ in range(round(seconds / step)):
            phase = 2 * np.pi * FREQUENCY * simulation.time + late
            targets = middle + SWING * pitch * np.sin(phase)
            simulation.set_actuator_inputs(fly.name, kind, targets)
            simulation.step()

    model = simulation.mj_model
    return go_on, {"size": f"{model.nv} degrees of freedom, step {1e3 * step:g} ms"}


if __name__ == "__main__":
    answer(metadata.version("flygym"), lambda told: {"walk": walk(told)})
