"""Worlds of one structure, stepped at once on a device by MuJoCo Warp.

All have the same numbers of bodies, joints and geoms. What may differ from world to world is what
Warp holds by world: masses, springs, places, sizes, friction and so on.
"""

from __future__ import annotations

import copy
from dataclasses import dataclass, fields
from typing import Any

import mujoco
import numpy as np

from antennate.errors import ConfigError, SceneError, in_one_line
from antennate.sim.warp.packages import require_device, require_warp
from antennate.sim.world import World
from antennate.types import Floats

_STATE = ("qpos", "qvel", "ctrl", "qacc_warmstart", "actuator_force")
_STATIC = ("geom_xpos", "geom_xmat")
"""Of what does not move, Warp computes these for the first world alone."""
_UNREAD = ("bvh_", "dof_M0")
_DROPPED = ("NEFC", "NJMAX_NNZ", "BROADPHASE", "NARROWPHASE", "CCD", "HFIELD", "EPA_HORIZON")
"""Overflows of Warp with which contacts are lost."""


@dataclass(frozen=True, slots=True)
class Limits:
    """Fixed sizes on the device, for each world.

    Attributes:
        rows: Most rows of constraints in one world; Warp drops those beyond.
        contacts: Most contacts, averaged over all worlds; Warp drops those beyond.
    """

    rows: int
    contacts: int


class WarpWorlds:
    """B worlds on a device.

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
        self._wp, self._mjw = require_warp()
        self._batch, self._first, self._limits = batch, first, limits
        self._device = require_device(device)
        try:
            with self._wp.ScopedDevice(self._device):
                self._make(_plain(first.model))
        except Exception as error:
            raise ConfigError(f"--engine warp: {in_one_line(error)}") from error
        self._base = _values(first.model)
        self._graph: Any = None
        self._runs = 0
        self._bits = sum(int(self._mjw.OverflowType[name]) for name in _DROPPED)

    def _make(self, model: mujoco.MjModel) -> None:
        rows, contacts = self._limits.rows, self._limits.contacts
        self._model = self._mjw.put_model(model)
        self._model.opt.warn_overflow = 0
        self._data = self._mjw.make_data(model, nworld=self._batch, nconmax=contacts, njmax=rows)
        self._by_world = {
            field.name
            for field in fields(self._model)
            if getattr(field.type, "shape", (None,))[0] == "*"
        }
        self._spread = dict[str, Any]()
        self._hold("geom_friction")
        places, gears = self._first.places, self._first.gears
        self._loaded: tuple[Any, ...] = ()
        if len(gears.dof):
            self._hold("dof_frictionloss")
            at = gears.drive, gears.dof
            self._loaded = (*map(self._ints, at), *map(self._floats, _terms(self._first)))
        self._kinds = self._ints(places.obstacles), self._ints(places.own)
        self._force = self._wp.zeros(self._batch, dtype=float)

    def _ints(self, values: Any) -> Any:
        return self._wp.array(np.asarray(values, np.int32), dtype=int)

    def _floats(self, values: Any) -> Any:
        return self._wp.array(np.asarray(values, np.float32), dtype=float)

    def _hold(self, name: str) -> Any:
        """The array of a field of the model, with a row for each world."""
        if name not in self._spread:
            held = getattr(self._model, name)
            rows = np.repeat(held.numpy(), self._batch, axis=0)
            self._spread[name] = self._wp.array(rows, dtype=held.dtype, device=self._device)
            setattr(self._model, name, self._spread[name])
            self._graph = None
        return self._spread[name]

    def put(self, row: int, world: World) -> None:
        """Let a row be a world from now on, in the state that it is in.

        Raises:
            SceneError: It differs from the first in what all have in common.
        """
        values = _values(world.model)
        differing = {n for n, value in values.items() if not _same(value, self._base.get(n))}
        if alien := sorted((differing | (self._base.keys() - values.keys())) - self._by_world):
            raise SceneError(
                "--engine warp: expected scenes and robots that differ in numbers alone, found "
                f"another {', '.join(alien[:5])}"
            )
        if any(not _same(*pair) for pair in zip(_terms(world), _terms(self._first), strict=True)):
            raise SceneError(
                "--engine warp: expected the same friction of gears under load in all worlds"
            )
        for name in sorted(differing | self._spread.keys()):
            self._write(self._hold(name), row, values[name])
        mujoco.mj_kinematics(world.model, world.data)
        for name in (*_STATE, *_STATIC):
            self._write(getattr(self._data, name), row, getattr(world.data, name))
        self._write(self._data.overflow, row, np.zeros(1))

    def rest(self, row: int) -> None:
        """Let the world of a row stand still; its trial has ended."""
        for name in _STATE:
            value = self._first.model.qpos0 if name == "qpos" else 0.0
            held = getattr(self._data, name)
            self._write(held, row, np.broadcast_to(value, held.shape[1:]))

    def _write(self, held: Any, row: int, value: Any) -> None:
        part = held[row : row + 1]
        shape = (*part.shape, *getattr(held.dtype, "_shape_", ()))
        part.assign(np.asarray(value).reshape(shape))

    def set_friction(self, row: int, world: World) -> None:
        """Take the friction of all geoms from a world."""
        self._write(self._hold("geom_friction"), row, world.model.geom_friction)

    def command(self, controls: Floats) -> None:
        """Set the targets of all actuators of all worlds [rad], shape (B, n)."""
        self._data.ctrl.assign(controls.astype(np.float32))

    def step(self, count: int) -> None:
        """Advance all worlds by `count` physics steps; on a GPU as one recorded graph."""
        with self._wp.ScopedDevice(self._device):
            self._runs += 1
            if self._device.is_cuda and self._graph is None and self._runs > 1:
                with self._wp.ScopedCapture() as capture:
                    self._advance(count)
                self._graph = (count, capture.graph)
            if self._graph is not None and self._graph[0] == count:
                self._wp.capture_launch(self._graph[1])
            else:  # the first run loads the kernels, which a recording must not
                self._advance(count)

    def _advance(self, count: int) -> None:
        from antennate.sim.warp.kernels import load_friction

        data = self._data
        for _ in range(count):
            if self._loaded:
                torque = data.actuator_force, data.qvel
                self._wp.launch(
                    load_friction,
                    dim=(self._batch, len(self._first.gears.dof)),
                    inputs=[*torque, *self._loaded],
                    outputs=[self._model.dof_frictionloss],
                )
            self._mjw.step(self._model, data)

    def state(self) -> tuple[Floats, Floats]:
        """Positions, shape (B, nq), and speeds, shape (B, nv), of all worlds, from float32."""
        return self._data.qpos.numpy().astype(float), self._data.qvel.numpy().astype(float)

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

    def overflows(self) -> dict[int, str]:
        """What was dropped, by world, since the world was put there."""
        bits = self._data.overflow.numpy() & self._bits
        return {
            row: f"Warp dropped contacts ({self._mjw.OverflowType(int(bits[row])).name}): limits "
            f"of {self._limits.rows} rows and {self._limits.contacts} contacts a world"
            for row in np.flatnonzero(bits).tolist()
        }


def _plain(model: mujoco.MjModel) -> mujoco.MjModel:
    """The same model without what Warp does not have, or what we do not use there."""
    plain = copy.copy(model)
    plain.opt.disableflags &= ~int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
    plain.opt.enableflags &= ~int(mujoco.mjtEnableBit.mjENBL_SLEEP)
    return plain


def _values(model: mujoco.MjModel) -> dict[str, Any]:
    """All numbers of a model by name, but those that Warp does not read: for rays and muscles."""
    owners = (("", model), ("opt.", model.opt))
    named = ((head + n, getattr(owner, n)) for head, owner in owners for n in _names(owner))
    return {
        n: value
        for n, value in named
        if isinstance(value, int | float | np.ndarray) and not n.startswith(_UNREAD)
    }


def _terms(world: World) -> tuple[Floats, Floats, Floats]:
    """What friction under load is made of."""
    return world.gears.share, world.gears.dry, world.gears.damping


def _names(owner: Any) -> list[str]:
    return [name for name in dir(owner) if not name.startswith("_")]


def _same(one: Any, other: Any) -> bool:
    return bool(np.array_equal(one, other))
