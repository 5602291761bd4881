"""Frames of a robot's links: those of its URDF, where each lies on its joint."""

from __future__ import annotations

import json
from typing import NamedTuple, Self

import numpy as np
from scipy.spatial.transform import Rotation

from antennate.errors import BadInputError
from antennate.sim.engine import mujoco
from antennate.sim.world import PREFIX
from antennate.types import Floats, Ints


class Links(NamedTuple):
    """Links of a robot, and its driven joints.

    Attributes:
        joints: Names of the driven joints.
        names: Names of the links, the head first.
        parents: Number of the link that carries each, -1 of the head, shape (n,).
        anchors: Where each link turns, along its own axes [m], shape (n, 3).
    """

    joints: tuple[str, ...]
    names: tuple[str, ...]
    parents: Ints
    anchors: Floats

    def pack(self) -> bytes:
        """Bytes of all of it, for another process."""
        lists = {"parents": self.parents.tolist(), "anchors": self.anchors.tolist()}
        return json.dumps(self._asdict() | lists).encode()

    @classmethod
    def unpack(cls, content: bytes) -> Self:
        """Links from the bytes of `pack`."""
        try:
            found = json.loads(content)
            numbers = np.array(found["parents"], np.int64), np.array(found["anchors"], float)
            return cls(tuple(found["joints"]), tuple(found["names"]), *numbers)
        except (ValueError, KeyError, TypeError) as error:
            raise BadInputError(f"expected the links of a robot, found {error}") from None

    def transforms(self, places: bytes) -> Floats:
        """Place [m] and quaternion x, y, z, w of each link in its parent's frame, shape (n, 7).

        Those of the head are in the world.

        Args:
            places: Of `LinkFrames.places`.
        """
        rows = np.frombuffer(places).reshape(len(self.names), 7)
        turned = Rotation.from_quat(rows[:, [4, 5, 6, 3]])
        origins = rows[:, :3] + turned.apply(self.anchors)
        carried = np.flatnonzero(self.parents >= 0)
        above = self.parents[carried]
        back = turned[above].inv()
        made = np.concatenate([origins, turned.as_quat()], axis=1)
        made[carried, :3] = back.apply(origins[carried] - origins[above])
        made[carried, 3:] = (back * turned[carried]).as_quat()
        return made


class LinkFrames:
    """Links of the robot in a compiled model, and where they and its joints are.

    Args:
        model: The compiled model; one without a robot has no links.

    Attributes:
        links: The links and joints.
    """

    def __init__(self, model: mujoco.MjModel) -> None:
        names = [model.body(i).name for i in range(model.nbody)]
        self._bodies: Ints = np.array(
            [i for i, name in enumerate(names) if name.startswith(PREFIX)], np.int64
        )
        numbers = {body: number for number, body in enumerate(self._bodies.tolist())}
        parents = [numbers.get(int(model.body_parentid[body]), -1) for body in numbers]
        anchors = np.zeros((len(numbers), 3))
        for body, number in numbers.items():
            if parents[number] >= 0 and model.body_jntnum[body]:
                anchors[number] = model.jnt_pos[model.body_jntadr[body]]
        drives = [i for i in range(model.nu) if model.actuator(i).name.startswith(PREFIX)]
        self._drives = np.array(drives, np.int64)
        joints = model.actuator_trnid[self._drives, 0]
        self._angles, self._speeds = model.jnt_qposadr[joints], model.jnt_dofadr[joints]
        self.links = Links(
            tuple(model.joint(int(i)).name.removeprefix(PREFIX) for i in joints),
            tuple(names[body].removeprefix(PREFIX) for body in numbers),
            np.array(parents, np.int64),
            anchors,
        )

    def places(self, data: mujoco.MjData) -> bytes:
        """Place [m] and quaternion w, x, y, z of each link in the world, as the engine has them."""
        rows = data.xpos[self._bodies], data.xquat[self._bodies]
        return np.concatenate(rows, axis=1).tobytes()

    def joints(self, data: mujoco.MjData) -> dict[str, tuple[float, ...]]:
        """Targets and angles [rad], speeds [rad/s] and torques [N·m] of the joints."""
        columns = {
            "angles": data.ctrl[self._drives],
            "positions": data.qpos[self._angles],
            "velocities": data.qvel[self._speeds],
            "efforts": data.actuator_force[self._drives],
        }
        return {name: tuple(column.tolist()) for name, column in columns.items()}
