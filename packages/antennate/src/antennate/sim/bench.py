"""The test bench: one antenna on a carriage that moves in a plane, before fixed obstacles.

Everything happens in the x-y plane. The carriage is a heavy body on two slides, driven by position
servos with velocity feed-forward; the antenna's base servo turns on it. Gravity acts in the plane,
or not at all.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np

from antennate.errors import SimulationError
from antennate.params.scene import PhysicsParams
from antennate.robots.antenna import BASE, AntennaSpec
from antennate.sim.engine import mujoco
from antennate.sim.parts import ANTENNA_BIT, OBSTACLE_BIT, build_antenna
from antennate.sim.places import ANGLE_LIMIT
from antennate.sim.world import new_spec, set_contacts
from antennate.types import Floats, Ints

PREFIX = "antenna/"
CARRIAGE_MASS = 1.0
"""A thousand antenna links [kg]: what the antenna feels does not move it."""
SLIDE_STIFFNESS, SLIDE_DAMPING = 1e4, 200.0
"""Gains of the slides' servos [N/m], [N·s/m]: critically damped, 10 micrometres per 0.1 N."""
_SPEED_LIMIT = 1e4
"""No coordinate of a sound bench moves faster [m/s or rad/s]."""
_WRENCH = 6
"""Force and torque, as the engine gives them."""


@dataclass(frozen=True, slots=True)
class Ball:
    """A fixed sphere at x, y [m] with its radius [m]."""

    x: float
    y: float
    radius: float

    def geom(self) -> dict[str, Any]:
        """Arguments of `add_geom` for the sphere."""
        kind = mujoco.mjtGeom.mjGEOM_SPHERE
        return {"type": kind, "pos": [self.x, self.y, 0], "size": [self.radius, 0, 0]}


@dataclass(frozen=True, slots=True)
class Bar:
    """A fixed capsule from (x0, y0) to (x1, y1) [m] with its radius [m]."""

    x0: float
    y0: float
    x1: float
    y1: float
    radius: float

    def geom(self) -> dict[str, Any]:
        """Arguments of `add_geom` for the capsule."""
        ends = [self.x0, self.y0, 0, self.x1, self.y1, 0]
        kind = mujoco.mjtGeom.mjGEOM_CAPSULE
        return {"type": kind, "fromto": ends, "size": [self.radius, 0, 0]}


def compile_bench(
    physics: PhysicsParams,
    antenna: AntennaSpec,
    obstacles: Sequence[Ball | Bar] = (),
    gravity: tuple[float, float] = (0.0, 0.0),
    probe_radius: float | None = None,
) -> mujoco.MjModel:
    """The bench with its antenna along +x, its base over the origin.

    Args:
        physics: Numerics; contacts take `contact_time`.
        antenna: The antenna; its friction holds against every obstacle.
        obstacles: What stands there.
        gravity: Gravity in the plane [m/s²].
        probe_radius: Radius of a rod that moves on slides of its own [m]; none without.
    """
    spec = new_spec(physics)
    spec.option.gravity = [*gravity, 0.0]
    spec.option.tolerance = 1e-10
    for obstacle in obstacles:
        spec.worldbody.add_geom(**obstacle.geom(), **_OBSTACLE)
    carriage = _slider(spec, "carriage")
    if probe_radius is not None:
        probe = _slider(spec, "probe")
        probe.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[probe_radius, 0, 0], **_OBSTACLE)
    frame = carriage.add_frame()
    spec.attach(build_antenna(antenna), frame=frame, prefix=PREFIX)
    set_contacts(spec, physics)
    return spec.compile()


_OBSTACLE: dict[str, Any] = {
    "friction": [0, 0, 0],  # the larger of two counts: the antenna's
    "condim": 3,
    "contype": OBSTACLE_BIT,
    "conaffinity": ANTENNA_BIT,
}


def _slider(spec: mujoco.MjSpec, name: str) -> mujoco.MjsBody:
    """A heavy body on two slides with servos, untouched by gravity."""
    body = spec.worldbody.add_body(name=name)
    body.gravcomp = 1.0
    body.mass = CARRIAGE_MASS
    body.inertia = [1e-3, 1e-3, 1e-3]
    body.explicitinertial = True
    for slide, axis in ((f"{name}_x", [1, 0, 0]), (f"{name}_y", [0, 1, 0])):
        body.add_joint(name=slide, type=mujoco.mjtJoint.mjJNT_SLIDE, axis=axis)
        hinge = mujoco.mjtTrn.mjTRN_JOINT
        spec.add_actuator(name=slide, trntype=hinge, target=slide).set_to_position(
            kp=SLIDE_STIFFNESS
        )
        follow = spec.add_actuator(name=f"{slide}_speed", trntype=hinge, target=slide)
        follow.set_to_velocity(kv=SLIDE_DAMPING)
    return body


class Slider:
    """A body of the bench that servos move in the plane.

    Attributes:
        coordinates: Its coordinates x and y, shape (2,).
        servos: Actuators in the order of `command`, shape (4,).
    """

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, name: str) -> None:
        self._model, self._data = model, data
        slides = (f"{name}_x", f"{name}_y")
        self.coordinates: Ints = _addresses(model, slides)
        servos = (*slides, *(f"{slide}_speed" for slide in slides))
        self.servos: Ints = np.array([model.actuator(servo).id for servo in servos])

    @property
    def position(self) -> Floats:
        """Where it is [m], shape (2,)."""
        return self._data.qpos[self.coordinates]

    def place(self, x: float, y: float) -> None:
        """Put it at x, y [m], at rest."""
        self._data.qpos[self.coordinates] = x, y
        self.command(x, y, 0.0, 0.0)
        mujoco.mj_forward(self._model, self._data)

    def command(self, x: float, y: float, speed_x: float, speed_y: float) -> None:
        """Set its target [m] and its speed there [m/s]."""
        self._data.ctrl[self.servos] = x, y, speed_x, speed_y


def _addresses(model: mujoco.MjModel, joints: Sequence[str]) -> Ints:
    return np.array([model.joint(name).qposadr[0] for name in joints])


class Bench:
    """One compiled bench with its state.

    Attributes:
        model: The compiled model; `data` its state.
        carriage: Carries the antenna; a rod is another `Slider`, "probe".
        order: Coordinates of carriage, base and n hinges, shape (n + 3,).
        servos: Actuators in the order of `command`, shape (5,).
    """

    def __init__(self, model: mujoco.MjModel, antenna: AntennaSpec) -> None:
        self.model = model
        self.data = mujoco.MjData(model)
        names = [PREFIX + name for name in antenna.hinge_names]
        self.carriage = Slider(model, self.data, "carriage")
        self._base = _addresses(model, [PREFIX + BASE])
        self._hinges = _addresses(model, names)
        self._chain: Ints = np.concatenate([self._base, self._hinges])  # speeds have the same
        self._sensed = antenna.sensed_hinges
        self._links: Ints = np.array([model.body(name).id for name in names])
        self._end = 2.0 * float(model.geom(names[-1]).pos[0])
        self._base_servo: int = model.actuator(PREFIX + BASE).id
        self._steps = 0
        self.order: Ints = np.concatenate([self.carriage.coordinates, self._chain])
        self.servos: Ints = np.append(self.carriage.servos, self._base_servo)

    @property
    def t(self) -> float:
        """Time since the bench was made [s]."""
        return float(self.data.time)

    def place(self, x: float, y: float, base: float) -> None:
        """Put the carriage at x, y [m] and turn the base [rad], all at rest and straight."""
        self.data.qpos[self._base] = base
        self.data.ctrl[self._base_servo] = base
        self.carriage.place(x, y)

    def bend(self, angles: Floats) -> None:
        """Turn the base and the n hinges to angles [rad], shape (n + 1,); targets stay."""
        self.data.qpos[self._chain] = angles
        mujoco.mj_forward(self.model, self.data)

    def chain(self) -> tuple[Floats, Floats]:
        """Angles [rad] and speeds [rad/s] of the base and the n hinges, each of shape (n + 1,)."""
        return self.data.qpos[self._chain], self.data.qvel[self._chain]

    def command(self, x: float, y: float, speed_x: float, speed_y: float, base: float) -> None:
        """Set the carriage's target [m], its speed there [m/s] and the base angle [rad]."""
        self.carriage.command(x, y, speed_x, speed_y)
        self.data.ctrl[self._base_servo] = base

    def step(self, count: int = 1) -> None:
        """Advance by `count` physics steps."""
        with self._checked(count):
            mujoco.mj_step(self.model, self.data, count)

    def press(self, count: int) -> Floats:
        """Advance by `count` physics steps and return the mean over them of `contact_force`.

        A contact that lasts is not on in every step; its mean converges, its share of steps does
        not.
        """
        total = np.zeros(2)
        with self._checked(count):
            for _ in range(count):
                mujoco.mj_step(self.model, self.data)
                if self.data.ncon:
                    total += self.contact_force()
        return total / count

    @contextmanager
    def _checked(self, count: int) -> Iterator[None]:
        """Physics steps, with a check of the commands before and of the state after them."""
        if not np.isfinite(self.data.ctrl).all():
            raise SimulationError(self._steps, "a command of the bench is not finite")
        before, self._steps = self.data.time, self._steps + count
        try:
            yield
        except mujoco.FatalError as error:
            raise SimulationError(self._steps, str(error).splitlines()[0]) from error
        if self.data.warning.number.any() or not self.data.time > before:
            raise SimulationError(self._steps, "engine warning")
        if trouble := broken(self.hinges(), self.data.qvel):
            raise SimulationError(self._steps, trouble)

    def hinges(self) -> Floats:
        """Angles of the n hinges [rad], shape (n,)."""
        return self.data.qpos[self._hinges]

    def flex(self) -> float:
        """Summed hinge angles under the flex sensor [rad]."""
        return float(self.hinges()[: self._sensed].sum())

    def base_angle(self) -> float:
        """Angle of the antenna's base [rad]."""
        return float(self.data.qpos[self._base][0])

    def joints(self) -> Floats:
        """Positions of the n hinges and the tip [m], shape (n + 1, 2)."""
        tip = self._end * self.data.xmat[self._links[-1]].reshape(3, 3)[:2, 0]
        origins = self.data.xpos[self._links, :2]
        return np.vstack([origins, origins[-1] + tip])

    def tip(self) -> Floats:
        """Position of the tip [m], shape (2,)."""
        return self.joints()[-1]

    def contact_force(self) -> Floats:
        """Force of all obstacles on the antenna in the last physics step [N], shape (2,)."""
        data = self.data
        total = np.zeros(2)
        wrench = np.zeros(_WRENCH)
        for i in range(data.ncon):
            mujoco.mj_contactForce(self.model, data, i, wrench)
            force = data.contact.frame[i].reshape(3, 3).T @ wrench[:3]
            on_second = self.model.geom_contype[data.contact.geom[i, 1]] == ANTENNA_BIT
            total += force[:2] if on_second else -force[:2]
        return total

    def touching(self) -> bool:
        """Whether any obstacle presses on the antenna in the last physics step."""
        address = self.data.contact.efc_address
        return bool((self.data.efc_force[address[address >= 0]] > 0).any())


def broken(hinges: Floats, speeds: Floats) -> str:
    """What is beyond its bound in a state; empty if nothing is.

    Args:
        hinges: Angles of all hinges [rad], shape (n,).
        speeds: Speeds of all coordinates [m/s or rad/s], shape (nv,).
    """
    flex, speed = abs(hinges).max(), abs(speeds).max()
    if flex < ANGLE_LIMIT and speed < _SPEED_LIMIT:
        return ""
    return f"a hinge is at {flex:.3g} rad, a coordinate moves at {speed:.3g} m/s or rad/s"


Watch = Callable[[Bench], None]
"""Looks at a bench while it runs, and changes nothing."""


def unwatched(bench: Bench) -> None:
    """Look at nothing."""
