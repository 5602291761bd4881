"""One compiled world: names become indices once, then it steps.

A world never hides trouble: commands are checked before they reach the engine, the engine's silent
reset is off, and every warning it counts, a clock that stands still and any state out of bounds end
the world with a `SimulationError`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from antennate.errors import SceneError, SimulationError, in_one_line
from antennate.params.scene import PhysicsParams
from antennate.robots.spec import RobotSpec
from antennate.sim.engine import mujoco
from antennate.sim.engine_setup import drop_if_asked
from antennate.sim.parts import (
    FLOOR_BIT,
    GROUND_BIT,
    GROUND_FRICTION,
    OBSTACLE_BIT,
    axle_height,
    build_robot,
)
from antennate.sim.places import (
    HEIGHT_LIMIT,
    ROBOT_AND_OBSTACLE,
    Contacts,
    Gears,
    Places,
    ServoDrives,
    broken,
    outline,
)
from antennate.sim.scenes.scene import SceneInstance, add_floor
from antennate.types import Bools, Floats, Ints

drop_if_asked()

PREFIX = "robot/"
_PLANE = int(mujoco.mjtGeom.mjGEOM_PLANE)
CONTACT_IMPEDANCE = (0.95, 0.99, 0.0005)
"""Least and largest impedance of contacts, and the depth of the largest [m]: `solimp`."""
_CLAMP = 1e6, 1e9
"""Inertia [kg, kg·m²] and damping [N·s/m, N·m·s/rad] that hold a bench: the 4 N of its weight lower
it by 0.02 mm in an hour."""
_LINEAR = 1
"""Goals between two of a servo with a delay are on a line, so that a delay may be any."""


def new_spec(physics: PhysicsParams) -> mujoco.MjSpec:
    """An empty spec with our numerics: implicitfast, Newton, elliptic cones, sleeping islands."""
    spec = mujoco.MjSpec()
    spec.compiler.degree = False
    option = spec.option
    option.timestep = physics.timestep
    option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    option.solver = mujoco.mjtSolver.mjSOL_NEWTON
    option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    option.impratio = physics.impratio
    option.iterations = 100
    option.tolerance = 1e-8
    option.sleep_tolerance = physics.sleep_tolerance
    option.enableflags |= int(mujoco.mjtEnableBit.mjENBL_SLEEP)
    option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
    return spec


def world_spec(
    physics: PhysicsParams, robot: RobotSpec, scene: SceneInstance | None = None
) -> mujoco.MjSpec:
    """Robot in a scene, uncompiled; on a bare floor without one. The head is over the origin."""
    spec = new_spec(physics)
    if scene is None:
        add_floor(spec)
    else:
        scene.build(spec)
        _meet_robot(spec)
    if robot.elevation_count:
        _feel_floor(spec)
    add_robot(spec, robot, physics)
    return spec


def add_robot(spec: mujoco.MjSpec, robot: RobotSpec, physics: PhysicsParams) -> None:
    """Add the robot with its free joint, and give all contacts their stiffness."""
    frame = spec.worldbody.add_frame(pos=[0, 0, axle_height(robot)])
    spec.attach(build_robot(robot), frame=frame, prefix=PREFIX)
    root = spec.body(PREFIX + robot.link_names[0]).add_freejoint(name=PREFIX + "root")
    if not robot.leg_count:
        root.armature, root.damping[:] = _CLAMP
    set_contacts(spec, physics)
    for name in robot.joint_names:
        _hold_goals(spec.actuator(PREFIX + name), physics.timestep)


def _hold_goals(servo: mujoco.MjsActuator, timestep: float) -> None:
    """Give a servo with a delay room for the goals that are under way."""
    if servo.delay:
        servo.nsample = math.ceil(servo.delay / timestep - 1e-9) + 1
        servo.interp = _LINEAR


def compile_world(
    physics: PhysicsParams, robot: RobotSpec, scene: SceneInstance | None = None
) -> mujoco.MjModel:
    """The world of `world_spec`, compiled."""
    spec = world_spec(physics, robot, scene)
    try:
        return spec.compile()
    except ValueError as error:
        raise SceneError(f"the scene cannot be compiled: {in_one_line(error)}") from error


def set_contacts(spec: mujoco.MjSpec, physics: PhysicsParams) -> None:
    """Give all contacts one stiffness, that of `contact_time`."""
    for geom in spec.geoms:
        geom.solref[0] = physics.contact_time
        geom.solimp[:3] = CONTACT_IMPEDANCE


def _meet_robot(spec: mujoco.MjSpec) -> None:
    """Let geoms with the engine's default collision bits touch the robot; planes are floors."""
    for geom in spec.geoms:
        if geom.contype == geom.conaffinity == 1:
            is_floor = int(geom.type) == _PLANE
            geom.contype = FLOOR_BIT if is_floor else OBSTACLE_BIT
            geom.conaffinity = 0 if is_floor else OBSTACLE_BIT | FLOOR_BIT


def _feel_floor(spec: mujoco.MjSpec) -> None:
    """Let antennae that can be lowered, and the body, touch the floor."""
    for geom in spec.geoms:
        if geom.contype & FLOOR_BIT:
            geom.contype |= GROUND_BIT
            geom.friction[0] = GROUND_FRICTION


class World:
    """One model with its state, and the robot's parts by index.

    Attributes:
        model: The compiled model; `data` its state.
        robot: The robot in it.
        places: Where the robot's parts are in the model.
        gears: Friction of the gears under load.
        root: Number of the robot's first coordinate.
        head: Position of the head link [m], shape (3,), a view of the state.
        servo_drives: Gain and limits of the servos' drives.
        t: Time since the world was made [s].
        height_limit: Height that no head can have [m].
        forces: Sets forces of its own before each physics step; None without any.
    """

    def __init__(self, model: mujoco.MjModel, robot: RobotSpec, top: float = 0.0) -> None:
        """Make it of a model, whose highest ground is at `top` [m]."""
        self.robot = robot
        self.height_limit = top + HEIGHT_LIMIT
        self.model = model
        self.data = mujoco.MjData(model)
        self.places = places = Places(model, robot, PREFIX)
        self._drive = places.drives
        self._late: Bools = model.actuator_delay[places.drives] > 0.0
        self.gears = Gears(model, robot, PREFIX)
        names = [PREFIX + n for n in robot.joint_names]
        stall = np.array([servo.stall_torque for servo in robot.joint_servos])
        self.servo_drives = ServoDrives(model, names, stall)
        self.root = places.root
        self.forces: Callable[[], None] | None = None
        self._steps = 0
        self._before = 0.0
        data = self.data
        self._qpos, self._qvel, self._ctrl = data.qpos, data.qvel, data.ctrl
        self._torque = data.actuator_force
        self._shown = [memoryview(part) for part in (self._qpos, self._qvel, self._torque)]
        self.head: Floats = data.qpos[self.root : self.root + 3]

    @property
    def t(self) -> float:
        """Time since the world was made [s]."""
        return float(self.data.time)

    def place(
        self,
        x: float,
        y: float,
        heading: float,
        yaw: Floats,
        leg: Floats,
        ground: float = 0.0,
    ) -> None:
        """Put the robot somewhere, level.

        Args:
            x: Of the head [m].
            y: Of the head [m].
            heading: Of the head [rad].
            yaw: Yaw joints [rad], shape (Y,).
            leg: Legs [rad], shape (L, 2).
            ground: Height of the ground under the robot [m].
        """
        q = self.data.qpos
        q[self.root : self.root + 2] = x, y
        if ground:
            q[self.root + 2] += ground
        q[self.root + 3 : self.root + 7] = math.cos(heading / 2), 0.0, 0.0, math.sin(heading / 2)
        q[self.places.yaw] = yaw
        q[self.places.legs] = leg.ravel()
        self.skip_delay(goals=self.drives())
        mujoco.mj_forward(self.model, self.data)

    def state(self) -> Floats:
        """All that the physics goes on from, for `restore`."""
        kind = mujoco.mjtState.mjSTATE_INTEGRATION
        state = np.empty(mujoco.mj_stateSize(self.model, kind))
        mujoco.mj_getState(self.model, self.data, state, kind)
        return state

    def place_all(self, position: Floats) -> None:
        """Put everything at coordinates of the model [m, rad], shape (nq,), without physics."""
        self._qpos[:] = position
        mujoco.mj_kinematics(self.model, self.data)

    def restore(self, state: Floats) -> None:
        """Be again as when `state` was called, also in time."""
        mujoco.mj_setState(self.model, self.data, state, mujoco.mjtState.mjSTATE_INTEGRATION)
        mujoco.mj_forward(self.model, self.data)

    def command(self, drive: Floats) -> None:
        """Set the targets of all servo joints, in the robot's order [rad], shape (n,)."""
        if not np.isfinite(drive).all():
            bad = int(np.flatnonzero(~np.isfinite(drive))[0])
            raise SimulationError(
                self._steps,
                f"target of actuator {self.model.actuator(self._drive[bad]).name} is {drive[bad]}",
            )
        self.command_finite(drive)

    def command_finite(self, drive: Floats) -> None:
        """Set all joint targets as `command` does, without a check."""
        self._ctrl[self._drive] = drive

    def skip_delay(self, which: Bools | bool = True, goals: Floats | None = None) -> None:
        """Let goals of servos arrive at once, and drop those that are under way.

        Args:
            which: Servos that it is done for, in the order of `command`, shape (n,); or all.
            goals: The goals [rad], shape (n,); those of the last command by default.
        """
        asked = self._ctrl[self._drive] if goals is None else goals
        for i in np.flatnonzero(self._late & which).tolist():
            servo = self._drive[i]
            samples = self.model.actuator_history[servo, 0]
            before = self.t + self.model.opt.timestep * np.arange(-samples, 0.0)[:, None]
            held = np.full((samples, 1), asked[i])
            mujoco.mj_initCtrlHistory(self.model, self.data, servo, before, held)

    def drives(self) -> Floats:
        """Angles of all driven joints, in the order of `command` [rad], shape (n,)."""
        return self._qpos[self.places.driven]

    def place_drives(self, angles: Floats) -> None:
        """Put all driven joints at angles [rad], shape (n,), without physics."""
        self._qpos[self.places.driven] = angles
        self.skip_delay(goals=angles)
        mujoco.mj_forward(self.model, self.data)

    def stand_on_tail(self) -> None:
        """Turn and raise the robot so that its last link is level, as high as at the start.

        For what knows the joints alone, of a robot whose links can rise.
        """
        data, root = self.data, self.root
        upright, new = np.zeros(4), np.zeros(4)
        across = data.xmat[self.places.links[-1]].reshape(3, 3)[:, 2]
        axis = np.cross(across, [0.0, 0.0, 1.0])
        sine = float(np.linalg.norm(axis))
        angle = math.atan2(sine, float(across[2]))
        mujoco.mju_axisAngle2Quat(upright, axis / (sine or 1.0), angle)
        mujoco.mju_mulQuat(new, upright, data.qpos[root + 3 : root + 7])
        data.qpos[root + 3 : root + 7] = new
        mujoco.mj_kinematics(self.model, data)
        data.qpos[root + 2] += axle_height(self.robot) - data.xpos[self.places.links[-1], 2]
        mujoco.mj_forward(self.model, data)

    def drive_speeds(self) -> Floats:
        """Speeds of all driven joints [rad/s], shape (n,)."""
        return self._qvel[self.places.turning]

    def drive_torques(self) -> Floats:
        """Torques of all actuators, without what their joints' damping takes [N·m], shape (n,)."""
        return self._torque[self._drive]

    def snapshot(self) -> bytes:
        """Coordinates, speeds and torques as they are, for `measured`."""
        return b"".join(self._shown)

    def measured(self, snapshots: Sequence[bytes]) -> tuple[Floats, Floats]:
        """What `drives`, `drive_speeds` and `drive_torques` gave when snapshots were taken.

        Returns:
            These, shape (n, 3, drives), and all coordinates [m, rad], shape (n, nq).
        """
        rows = np.frombuffer(b"".join(snapshots)).reshape(len(snapshots), -1)
        angles, speeds, torques = np.split(rows, np.cumsum([self.model.nq, self.model.nv]), axis=1)
        places = self.places
        parts = angles[:, places.driven], speeds[:, places.turning], torques[:, places.drives]
        return np.stack(parts, axis=1), angles

    def step(self, count: int) -> None:
        """Advance by `count` physics steps."""
        self.advance(count)
        self.check()

    def advance(self, count: int) -> None:
        """Advance by `count` physics steps as `step` does; `check` looks at them later."""
        self._before = self.data.time
        self._steps += count
        try:
            while self.forces is not None and count:
                self.forces()
                self.gears.step(self.data, 1)
                count -= 1
            self.gears.step(self.data, count)
        except mujoco.FatalError as error:
            raise SimulationError(self._steps, str(error).splitlines()[0]) from error

    def check(self) -> None:
        """Look at the state after `advance`."""
        data = self.data
        warned = [n for n, count in zip(_WARNINGS, data.warning.number, strict=True) if count]
        troubles = (
            f"engine warning {', '.join(warned)}" if warned else "",
            broken(self.head, data.qpos[self.places.bounded], data.qvel, self.height_limit),
            "" if data.time > self._before else f"time stood still at {data.time:.6g} s",
        )
        for trouble in filter(None, troubles):
            raise SimulationError(self._steps, trouble)

    @property
    def heading(self) -> float:
        """Yaw of the head link [rad], within (-pi, pi]."""
        w, x, y, z = self.data.qpos[self.root + 3 : self.root + 7]
        return math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))

    @property
    def overturned(self) -> bool:
        """Whether the undersides of most links point up."""
        up = self.data.xmat[self.places.links, 8]
        return bool(np.count_nonzero(up < 0.0) > 0.5 * len(up))

    def links(self) -> Floats:
        """Plan positions of the links, head first [m], shape (L, 2)."""
        return self.data.xpos[self.places.links, :2]

    def link_places(self) -> Floats:
        """Positions of the links, head first [m], shape (L, 3)."""
        return self.data.xpos[self.places.links].copy()

    def bends(self) -> Floats:
        """Angles of all hinges of the antennae, one antenna after the other [rad], shape (n,)."""
        return self._qpos[self.places.bent]

    def outlines(self) -> tuple[list[Floats], list[Floats]]:
        """Polygons of all obstacles in plan [m], each (n, 2): those fixed, those that can move."""
        solid = np.flatnonzero(self.places.obstacles & (self.model.geom_type != _PLANE))
        fixed = self.model.body_weldid[self.model.geom_bodyid[solid]] == 0
        polygons = [outline(self.model, self.data, geom) for geom in solid.tolist()]
        return (
            [polygon for polygon, still in zip(polygons, fixed, strict=True) if still],
            [polygon for polygon, still in zip(polygons, fixed, strict=True) if not still],
        )

    def parts(self) -> list[Floats]:
        """Polygons of all parts of the robot in plan [m], each (n, 2), legs and antennae too."""
        own = np.flatnonzero(self.places.own)
        return [outline(self.model, self.data, geom) for geom in own.tolist()]

    def obstacle_overlap(self) -> float:
        """How deep the robot is in obstacles at most [m]; 0 if it touches none."""
        return max(0.0, -float(self.data.contact.dist[self._on_obstacles()].min(initial=0.0)))

    def obstacle_force(self) -> float:
        """Sum of the normal forces between robot and obstacles [N] in the last physics step."""
        address = self.data.contact.efc_address[self._on_obstacles()]
        return float(self.data.efc_force[address[address >= 0]].sum())

    def obstacle_contacts(
        self, contacts: Contacts | None = None
    ) -> tuple[Ints, list[str], Floats, Floats]:
        """Where the robot touched obstacles in the last physics step, or in an earlier one.

        Args:
            contacts: All of that step, None for the last.

        Returns:
            Number, part of the robot, place [m], shape (contacts, 3), and normal force [N],
            shape (contacts,), of each contact.
        """
        contacts_then = contacts or Contacts.of(self.data)
        which, force = contacts_then.between(self.places.kinds, ROBOT_AND_OBSTACLE)
        if not len(which):
            return which, [], np.zeros((0, 3)), force
        first, second = contacts_then.geoms[which].T
        robot_geoms = np.where(self.places.own[first], first, second)
        names = [self.places.parts[geom] for geom in robot_geoms.tolist()]
        return which, names, contacts_then.place[which], force

    def _on_obstacles(self) -> Bools:
        """Contacts between the robot and an obstacle, shape (contacts,)."""
        kinds = self.places.kinds[self.data.contact.geom]
        return kinds[:, 0] + kinds[:, 1] == ROBOT_AND_OBSTACLE

    def set_leg_friction(self, friction: Floats) -> None:
        """Give every leg its own sliding friction, shape (2 L,)."""
        self.model.geom_friction[self.places.leg_geoms, 0] = friction


_WARNINGS = tuple(name.removeprefix("mjWARN_") for name in list(mujoco.mjtWarning.__members__)[:-1])
