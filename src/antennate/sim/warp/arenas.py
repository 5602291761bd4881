"""Tunnels with one number of cylinders and walls, as Warp needs them, and the sizes for them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from antennate.robots.spec import RobotSpec
from antennate.sim.engine import mujoco
from antennate.sim.scenes.scene import Scene, SceneInstance
from antennate.sim.scenes.tunnel import Tunnel
from antennate.sim.sim_robot import Disturbance, SimRobot
from antennate.sim.world import World
from antennate.types import Floats

_PARKING = -60.0
"""Cylinders that a tunnel has too few of stand behind this x, away from everything [m]."""
_GAP = 0.05
"""Free distance between parked cylinders [m]."""
_ASIDE = 5.0
"""Distance of the parked walls from the parked cylinders [m]."""
_RESERVE = 1.5
"""Room on the device over the largest counts on the CPU."""
_LEAST = (100, 40)
"""Rows and contacts: more than twice what our robot's legs alone have on a floor."""


class PaddedTunnels:
    """A scene whose tunnels all have as many cylinders and walls; other scenes stay as they are.

    Args:
        scene: Draws them.
        instances: Those that will be drawn.
    """

    def __init__(self, scene: Scene, instances: Iterable[SceneInstance]) -> None:
        self._scene, self.random = scene, scene.random
        self.variation = getattr(scene, "variation", {})
        tunnels = [each for each in instances if isinstance(each, Tunnel)]
        self._count = max((len(each.cylinders) for each in tunnels), default=0)
        self._walls = max((len([*each.pieces()]) for each in tunnels), default=0)

    def draw(self, robot: RobotSpec, rng: np.random.Generator) -> SceneInstance:
        """Draw the same instance as the scene itself, filled up with parked cylinders and walls.

        Raises:
            SceneError: There is none.
        """
        drawn = self._scene.draw(robot, rng)
        if not isinstance(drawn, Tunnel):
            return drawn
        pitch = 2 * drawn.params.cylinder.radius + _GAP
        spare = self._count - len(drawn.cylinders)
        parked = np.column_stack([_PARKING - pitch * np.arange(1, spare + 1), np.zeros(spare)])
        lacking = self._walls - len([*drawn.pieces()])
        row = np.arange(lacking)[:, None] + [0.0, 0.5]
        walls = np.stack([_PARKING - 1.0 - row, np.full_like(row, _ASIDE)], axis=2)
        cylinders = np.concatenate([drawn.cylinders, parked])
        return replace(drawn, cylinders=cylinders, parked=walls)


def is_parked(polygon: Floats) -> bool:
    """Whether an obstacle only fills the counts."""
    return bool(polygon[:, 0].max() < _PARKING)


class CountingRobot(SimRobot):
    """Robots on the CPU that count rows of constraints and contacts, with nothing asleep.

    Attributes:
        room: Rows and contacts a world that would have been enough so far, with a reserve.
    """

    def __init__(self, batch: int, robot: RobotSpec, period: float, timestep: float) -> None:
        super().__init__(batch, robot, period, timestep)
        self._counted = dict[int, World]()
        self.room = _LEAST

    def load(self, row: int, world: World, chance: Disturbance) -> None:
        """Put a fresh world into a row."""
        world.model.opt.enableflags &= ~int(mujoco.mjtEnableBit.mjENBL_SLEEP)
        self._counted[row] = world
        super().load(row, world, chance)

    def sleep_until(self, t: float) -> None:
        """Advance the physics of every row to time t [s]."""
        super().sleep_until(t)
        for world in self._counted.values():
            rows, contacts = self.room
            data = world.data
            self.room = (
                max(rows, round(_RESERVE * data.nefc)),
                max(contacts, round(_RESERVE * data.ncon)),
            )
