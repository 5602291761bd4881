"""Frames of a robot's links: those of its URDF, where each lies on its joint."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial.transform import Rotation

from antennate.sim.engine import mujoco
from antennate.sim.world import PREFIX
from antennate.types import Floats, Ints


class LinkFrames:
    """Links of the robot in a compiled model, and where they and its joints are.

    Args:
        model: The compiled model; one without a robot has no links.

    Attributes:
        joints: Names of the driven joints.
        names: Names of the links, the head first.
        parents: Number of the link that carries each, -1 of the head.
    """

    def __init__(self, model: mujoco.MjModel) -> None:
        names = {i: model.body(i).name for i in range(model.nbody)}
        links = [i for i, name in names.items() if name.startswith(PREFIX)]
        carriers = [int(model.body_parentid[i]) for i in links]
        self.names = [names[i].removeprefix(PREFIX) for i in links]
        self.parents = [links.index(i) if i in links else -1 for i in carriers]
        self._bodies: Ints = np.array(links, np.int64)
        self._first = model.body_jntadr[self._bodies]
        drives = [i for i in range(model.nu) if model.actuator(i).name.startswith(PREFIX)]
        self._drives = np.array(drives, np.int64)
        turned = model.actuator_trnid[self._drives, 0]
        self._angles, self._speeds = model.jnt_qposadr[turned], model.jnt_dofadr[turned]
        self.joints = [model.joint(int(i)).name.removeprefix(PREFIX) for i in turned]

    def places(self, data: mujoco.MjData) -> Floats:
        """Where each link turns [m], and its quaternion w, x, y, z, in the world, shape (n, 7)."""
        turns = np.where(
            self._first[:, None] < 0, data.xpos[self._bodies], data.xanchor[self._first]
        )
        return np.concatenate([turns, data.xquat[self._bodies]], axis=1)

    def drives(self, data: mujoco.MjData) -> dict[str, tuple[float, ...]]:
        """Targets and angles [rad], speeds [rad/s] and torques [N·m] of the joints."""
        columns = {
            "angles": data.ctrl[self._drives],
            "positions": data.qpos[self._angles],
            "velocities": data.qvel[self._speeds],
            "efforts": data.actuator_force[self._drives],
        }
        return {name: tuple(column.tolist()) for name, column in columns.items()}


def transforms(places: Floats, parents: Sequence[int]) -> Floats:
    """Place [m] and quaternion x, y, z, w of each link in its parent's frame, shape (n, 7).

    Those of the head are in the world.

    Args:
        places: Of `LinkFrames.places`.
        parents: Of `LinkFrames`.
    """
    quaternions = places[:, [4, 5, 6, 3]]
    turned = Rotation.from_quat(quaternions)
    made = np.concatenate([places[:, :3], turned.as_quat()], axis=1)
    carried = np.flatnonzero(np.array(parents) >= 0)
    above = np.array(parents)[carried]
    back = Rotation.from_quat(quaternions[above]).inv()
    made[carried, :3] = back.apply(places[carried, :3] - places[above, :3])
    made[carried, 3:] = (back * Rotation.from_quat(quaternions[carried])).as_quat()
    return made
