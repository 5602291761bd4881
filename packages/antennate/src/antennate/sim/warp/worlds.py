"""Worlds of one structure with a robot each, stepped at once on a device by MuJoCo Warp.

All have the same numbers of bodies, joints and geoms. What may differ from world to world is what
Warp holds by world: masses, springs, places, sizes, friction and so on. Friction of gears and the
forces on obstacles are worked out on the device, too.
"""

from __future__ import annotations

import copy
import warnings
from dataclasses import dataclass, fields
from importlib import import_module, metadata
from importlib.util import find_spec
from typing import Any

import numpy as np

from antennate.errors import ConfigError, MissingPackageError, SceneError, in_one_line
from antennate.messages import extra
from antennate.sim.engine import mujoco
from antennate.sim.world import World
from antennate.types import Floats

_MODULES = {"mujoco_warp": "mujoco-warp", "warp": "warp-lang", "absl": "absl-py", "etils": "etils"}


def require_warp() -> tuple[Any, Any]:
    """The modules warp and mujoco_warp."""
    missing = [package for module, package in _MODULES.items() if find_spec(module) is None]
    if missing:
        raise MissingPackageError(
            f"--engine warp: expected the packages {', '.join(_MODULES.values())}, found no "
            f"{', '.join(missing)}; install them with {extra('gpu')}"
        )
    engine, version = _series(mujoco.__version__), _version("mujoco-warp")
    if version and _series(version) != engine:
        raise ConfigError(
            f"--engine warp: expected mujoco-warp {engine}, as the engine mujoco is "
            f"{mujoco.__version__}, found {version}"
        )
    import mujoco_warp  # pyright: ignore[reportMissingImports]

    warp = import_module("warp")  # type checkers take our own folder of that name for it
    warp.config.log_level = warp.LOG_WARNING
    return warp, mujoco_warp


def require_device(name: str | None) -> Any:
    """The device of a name, or a GPU."""
    warp, _ = require_warp()
    try:
        device = warp.get_device(name) if name else warp.get_preferred_device()
    except Exception as error:
        raise ConfigError(f"--engine warp: {in_one_line(error)}") from error
    if name is None and not (device and device.is_cuda):
        raise ConfigError(
            "--engine warp: expected a GPU with CUDA, found none; without one the usual engine is "
            'much faster, and device "cpu" is there for tests'
        )
    return device


def _series(version: str) -> str:
    """The first two numbers of a version."""
    return ".".join(version.split(".")[:2])


def _version(name: str) -> str:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return ""


_STATE = ("qpos", "qvel", "ctrl", "qacc_warmstart", "actuator_force", "time", "history")
_STATIC = ("geom_xpos", "geom_xmat")
"""Arrays of what does not move, which Warp computes for the first world alone."""
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
        """Let a row be the world of a model from now on, in the state that it is in."""
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
        if not held.size:  # as the history of servos without a delay
            return
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
    """A copy of the model without what Warp does not have, or what we do not use there."""
    plain = copy.copy(model)
    plain.opt.disableflags &= ~int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
    plain.opt.enableflags &= ~int(mujoco.mjtEnableBit.mjENBL_SLEEP)
    return plain


def _values(model: mujoco.MjModel) -> dict[str, Any]:
    """All numbers of a model by name, but those that Warp does not read: for rays and muscles."""
    owners = (("", model), ("opt.", model.opt))
    named = (
        (head + n, getattr(owner, n))
        for head, owner in owners
        for n in dir(owner)
        if not n.startswith("_")
    )
    return {
        n: value
        for n, value in named
        if isinstance(value, int | float | np.ndarray) and not n.startswith(_UNREAD)
    }


def same(one: Any, other: Any) -> bool:
    """Whether two numbers or arrays are equal in shape and values."""
    return bool(np.array_equal(one, other))


class RobotWorlds(WarpWorlds):
    """B worlds with a robot each.

    Args:
        first: A world whose structure all have.
        batch: Number of worlds B.
        limits: Sizes on the device.
        device: Name of a device of Warp, as cuda:0 or cpu; a GPU if not given.
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
        """Let a row be a world from now on, in the state that it is in."""
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
