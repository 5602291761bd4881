"""Worlds of one structure, stepped at once on a device by MuJoCo Warp.

All have the same numbers of bodies, joints and geoms. What may differ from world to world is what
Warp holds by world: masses, springs, places, sizes, friction and so on.
"""

from __future__ import annotations

import copy
import warnings
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from antennate.errors import ConfigError, SceneError, in_one_line
from antennate.sim.engine import mujoco
from antennate.sim.warp.packages import require_device, require_warp
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
        first: A model whose structure all have.
        batch: Number of worlds B.
        limits: Sizes on the device.
        device: Name of a device of Warp, as cuda:0 or cpu; a GPU if not given.

    Raises:
        ConfigError: There is no such device, or Warp cannot hold that model.
        MissingPackageError: Warp is not installed.
    """

    def __init__(
        self, first: mujoco.MjModel, batch: int, limits: Limits, device: str | None = None
    ) -> None:
        self._wp, self._mjw = require_warp()
        self._batch, self._rest, self._limits = batch, first.qpos0.copy(), limits
        self._device = require_device(device)
        try:
            with self._wp.ScopedDevice(self._device), warnings.catch_warnings():
                warnings.filterwarnings("ignore", r"geom \d+: friction")  # that of the pair counts
                self._make(_plain(first))
        except Exception as error:
            raise ConfigError(f"--engine warp: {in_one_line(error)}") from error
        self._base = _values(first)
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

    def put(self, row: int, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        """Let a row be the world of a model from now on, in the state that it is in.

        Raises:
            SceneError: It differs from the first in what all have in common.
        """
        values = _values(model)
        differing = {n for n, value in values.items() if not same(value, self._base.get(n))}
        if alien := sorted((differing | (self._base.keys() - values.keys())) - self._by_world):
            raise SceneError(
                "--engine warp: expected scenes and robots that differ in numbers alone, found "
                f"another {', '.join(alien[:5])}"
            )
        for name in sorted(differing | self._spread.keys()):
            self._write(self._hold(name), row, values[name])
        mujoco.mj_kinematics(model, data)
        for name in (*_STATE, *_STATIC):
            self._write(getattr(self._data, name), row, getattr(data, name))
        self._write(self._data.overflow, row, np.zeros(1))

    def rest(self, row: int) -> None:
        """Let the world of a row stand still; its trial has ended."""
        for name in _STATE:
            value = self._rest if name == "qpos" else 0.0
            held = getattr(self._data, name)
            self._write(held, row, np.broadcast_to(value, held.shape[1:]))

    def _write(self, held: Any, row: int, value: Any) -> None:
        part = held[row : row + 1]
        shape = (*part.shape, *getattr(held.dtype, "_shape_", ()))
        part.assign(np.asarray(value).reshape(shape))

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
        for _ in range(count):
            self._before_step()
            self._mjw.step(self._model, self._data)

    def _before_step(self) -> None:
        """What is computed on the device before each physics step; by default nothing."""

    def state(self) -> tuple[Floats, Floats]:
        """Positions, shape (B, nq), and speeds, shape (B, nv), of all worlds, from float32."""
        return self._data.qpos.numpy().astype(float), self._data.qvel.numpy().astype(float)

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


def _names(owner: Any) -> list[str]:
    return [name for name in dir(owner) if not name.startswith("_")]


def same(one: Any, other: Any) -> bool:
    """Whether two numbers or arrays are equal in shape and values."""
    return bool(np.array_equal(one, other))
