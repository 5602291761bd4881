"""States of worlds in rows, copied at once, and which of them may be unsound."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from antennate.sim.engine import mujoco
from antennate.sim.places import ANGLE_LIMIT, DISTANCE_LIMIT, SPEED_LIMIT
from antennate.sim.world import World
from antennate.types import Floats, Ints

HEAD = 10
"""Numbers of a head: quaternion, real part first, velocity in the axes of the world [m/s], angular
velocity in those of the head [rad/s]."""
_STATE = int(
    mujoco.mjtState.mjSTATE_TIME | mujoco.mjtState.mjSTATE_QPOS | mujoco.mjtState.mjSTATE_QVEL
)
"""What is copied of each world: its time, its coordinates, its speeds, in this order."""


class _State(NamedTuple):
    """A world, where its state is copied, and how often its engine has warned."""

    world: World
    model: mujoco.MjModel
    data: mujoco.MjData
    copy: Floats
    warnings: Ints
    no_warning: bytes


class States:
    """Time, coordinates and speeds of worlds in rows, as they were when one looked last.

    The last column is 0, for what an empty row does not have.

    Args:
        batch: Number of rows B.
        hinges: Number n of hinges under each flex sensor.
        joints: Number of driven joints.
    """

    def __init__(self, batch: int, hinges: int, joints: int) -> None:
        self._rows: dict[int, _State] = {}
        self._all: Floats = np.zeros((batch, 1))
        self._scale: Floats = np.zeros((batch, 1))
        self._heights: Ints = np.zeros(batch, np.int64)
        self._hinges: Ints = np.zeros((batch, 2, hinges), np.int64)
        self._joints: Ints = np.zeros((batch, joints), np.int64)
        self._heads: Ints = np.zeros((batch, HEAD), np.int64)

    def put(self, row: int, world: World) -> None:
        """Put a world into a row."""
        size = mujoco.mj_stateSize(world.model, _STATE)
        if size < self._all.shape[1]:
            self._place(row, world, size)
            return
        worlds = {each: held.world for each, held in self._rows.items()} | {row: world}
        self._all = np.zeros((len(self._all), size + 1))
        self._scale = np.zeros_like(self._all)
        for each in range(len(self._all)):
            self.remove(each)
        for each, other in worlds.items():
            self._place(each, other, mujoco.mj_stateSize(other.model, _STATE))

    def _place(self, row: int, world: World, size: int) -> None:
        """Put a world whose state has this size into a row; there is room for it."""
        model, places = world.model, world.places
        self.remove(row)
        self._scale[row, 1 + model.nq : size] = 1.0 / SPEED_LIMIT
        coordinates = self._scale[row, 1 : 1 + model.nq]
        coordinates[places.root : places.root + 2] = 1.0 / DISTANCE_LIMIT
        coordinates[places.root + 2] = 1.0 / world.height_limit
        coordinates[places.bounded] = 1.0 / ANGLE_LIMIT
        first = row * self._all.shape[1] + 1
        self._heights[row] = first + places.root + 2
        self._hinges[row] = first + places.hinges
        self._joints[row] = first + places.driven
        self._heads[row, :4] = first + places.root + 3 + np.arange(4)
        self._heads[row, 4:] = first + model.nq + places.root_speed + np.arange(6)
        warnings, copy = world.data.warning.number, self._all[row, :size]
        self._rows[row] = _State(world, model, world.data, copy, warnings, bytes(warnings.nbytes))

    def remove(self, row: int) -> None:
        """Empty a row."""
        self._rows.pop(row, None)
        self._all[row] = self._scale[row] = 0.0
        last = (row + 1) * self._all.shape[1] - 1
        self._heights[row] = self._hinges[row] = self._joints[row] = self._heads[row] = last

    def look(self) -> list[int]:
        """Copy all states; rows that may be unsound, or whose time has not gone on since."""
        before, suspects = self._all[:, 0].copy(), list[int]()
        for row, (_, model, data, copy, warnings, no_warning) in self._rows.items():
            mujoco.mj_getState(model, data, copy, _STATE)
            if warnings.tobytes() != no_warning:
                suspects.append(row)
        with np.errstate(invalid="ignore", over="ignore"):
            shares = self._all * self._scale
            sound = np.einsum("ij,ij->i", shares, shares) < 1.0  # none is beyond their norm
        sound &= self._all.take(self._heights) > 0.0
        sound &= self._all[:, 0] > before
        return suspects if sound.all() else [*suspects, *np.flatnonzero(~sound).tolist()]

    @property
    def times(self) -> Floats:
        """Time of each world, 0 in an empty row [s], shape (B,)."""
        return self._all[:, 0]

    @property
    def hinges(self) -> Floats:
        """Angles of the hinges under the flex sensors [rad], shape (B, 2, n)."""
        return self._all.take(self._hinges)

    @property
    def joints(self) -> Floats:
        """Angles of all driven joints, 0 in an empty row [rad], shape (B, joints)."""
        return self._all.take(self._joints)

    @property
    def heads(self) -> Floats:
        """Attitudes and velocities of the heads as `HEAD` says, shape (B, 10)."""
        return self._all.take(self._heads)
