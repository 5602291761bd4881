"""Worlds with a robot on a device: friction of its gears, and the forces on obstacles."""

from __future__ import annotations

from typing import Any

from antennate.errors import SceneError
from antennate.sim.engine import mujoco
from antennate.sim.warp.worlds import Limits, WarpWorlds, same
from antennate.sim.world import World
from antennate.types import Floats


class RobotWorlds(WarpWorlds):
    """B worlds with a robot each.

    Args:
        first: A world whose structure all have.
        batch: Number of worlds B.
        limits: Sizes on the device.
        device: Name of a device of Warp, as cuda:0 or cpu; a GPU if not given.

    Raises:
        ConfigError: There is no such device, or Warp cannot hold that model.
        MissingPackageError: Warp is not installed.
    """

    def __init__(self, first: World, batch: int, limits: Limits, device: str | None = None) -> None:
        self._first = first
        super().__init__(first.model, batch, limits, device)

    def _make(self, model: mujoco.MjModel) -> None:
        super()._make(model)
        self._hold("geom_friction")
        places, gears = self._first.places, self._first.gears
        self._loaded: tuple[Any, ...] = ()
        if len(gears.dof):
            self._hold("dof_frictionloss")
            at = gears.drive, gears.dof
            self._loaded = (*map(self._ints, at), *map(self._floats, _terms(self._first)))
        self._kinds = self._ints(places.obstacles), self._ints(places.own)
        self._force = self._wp.zeros(self._batch, dtype=float)

    def put_world(self, row: int, world: World) -> None:
        """Let a row be a world from now on, in the state that it is in.

        Raises:
            SceneError: It differs from the first in what all have in common.
        """
        if any(not same(*pair) for pair in zip(_terms(world), _terms(self._first), strict=True)):
            raise SceneError(
                "--engine warp: expected the same friction of gears under load in all worlds"
            )
        self.put(row, world.model, world.data)

    def set_friction(self, row: int, world: World) -> None:
        """Take the friction of all geoms from a world."""
        self._write(self._hold("geom_friction"), row, world.model.geom_friction)

    def _before_step(self) -> None:
        from antennate.sim.warp.kernels import load_friction

        if self._loaded:
            self._wp.launch(
                load_friction,
                dim=(self._batch, len(self._first.gears.dof)),
                inputs=[self._data.actuator_force, self._data.qvel, *self._loaded],
                outputs=[self._model.dof_frictionloss],
            )

    def forces(self) -> Floats:
        """Summed normal force between robot and obstacles in the last step [N], shape (B,)."""
        from antennate.sim.warp.kernels import obstacle_forces

        data = self._data
        with self._wp.ScopedDevice(self._device):
            self._force.zero_()
            contact = data.contact
            self._wp.launch(
                obstacle_forces,
                dim=data.naconmax,
                inputs=[
                    *(data.nacon, contact.worldid, contact.geom, contact.efc_address),
                    *(data.efc.force, *self._kinds),
                ],
                outputs=[self._force],
            )
        return self._force.numpy().astype(float)


def _terms(world: World) -> tuple[Floats, Floats, Floats]:
    """What friction under load is made of."""
    return world.gears.share, world.gears.dry, world.gears.damping
