"""Simulated robots in lockstep on a device: what `SimRobot` is, for a batch of MuJoCo Warp.

The sensors, the disturbances and the clock are those of `SimRobot`; the worlds step in float32.
Warp needs tunnels with one number of cylinders and walls, and sizes for them.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace

import numpy as np

from antennate.antenna.sensor import SensorChain
from antennate.errors import SceneError, SimulationError
from antennate.robots.imu import AXES, measured
from antennate.robots.spec import RobotSpec
from antennate.sim.engine import mujoco
from antennate.sim.imu import Imu
from antennate.sim.places import Places, broken, sound
from antennate.sim.scenes.scene import Scene, SceneInstance
from antennate.sim.scenes.tunnel import Tunnel
from antennate.sim.sim_robot import Disturbance, SimRobot
from antennate.sim.states import HEAD
from antennate.sim.warp.worlds import Limits, RobotWorlds
from antennate.sim.world import World
from antennate.types import AntennaFrame, Floats, JointCommand, joint_angles

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
        """Draw the same instance as the scene itself, filled up with parked cylinders and walls."""
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


class WarpRow:
    """One robot of the batch, as a trial looks at it; the true state, from float32.

    Attributes:
        world: The same world on the CPU; its state is the start until somebody asks for more.
        chance: What chance does to it.
        ticks: Control periods since its start.
        commanded: Whether it was told anything yet.
    """

    def __init__(self, batch: WarpRobot, row: int, world: World, chance: Disturbance) -> None:
        self._batch, self._row = batch, row
        self.world, self.chance = world, chance
        self.ticks = 0
        self.commanded = False

    @property
    def t(self) -> float:
        """Time since the world was made [s]: counted, since float32 would lose some."""
        return self.ticks * self._batch.period

    @property
    def head(self) -> Floats:
        """Position of the head link [m], shape (3,)."""
        root = self.world.places.root
        return self._batch.positions[self._row, root : root + 3]

    @property
    def on_cpu(self) -> World:
        """The world on the CPU, in the state of now; speeds and contacts are not brought there."""
        self._follow()
        return self.world

    def obstacle_force(self) -> float:
        """Sum of the normal forces between robot and obstacles [N] in the last physics step."""
        return float(self._batch.forces()[self._row])

    def bends(self) -> Floats:
        """Angles of all hinges of the antennae, one antenna after the other [rad], shape (n,)."""
        return self._batch.positions[self._row, self.world.places.bent]

    @property
    def robot(self) -> RobotSpec:
        """The robot of this row."""
        return self.world.robot

    @property
    def overturned(self) -> bool:
        """Whether the undersides of most links point up."""
        self._follow()
        return self.world.overturned

    def links(self) -> Floats:
        """Plan positions of the links, head first [m], shape (L, 2)."""
        self._follow()
        return self.world.links()

    def link_places(self) -> Floats:
        """Positions of the links, head first [m], shape (L, 3)."""
        self._follow()
        return self.world.link_places()

    def parts(self) -> list[Floats]:
        """Polygons of all parts of the robot in plan [m], each (n, 2)."""
        self._follow()
        return self.world.parts()

    def outlines(self) -> tuple[list[Floats], list[Floats]]:
        """Obstacles in plan, as `World.outlines` has them, without those that fill the counts."""
        self._follow()
        still, loose = self.world.outlines()
        return _standing(still), _standing(loose)

    def _follow(self) -> None:
        data = self.world.data
        data.qpos[:] = self._batch.positions[self._row]
        mujoco.mj_kinematics(self.world.model, data)


def _head(positions: Floats, speeds: Floats, places: Places) -> Floats:
    """Attitude and velocity of heads as `states.HEAD` says, shape (..., 10)."""
    attitude = positions[..., places.root + 3 : places.root + 7]
    velocity = speeds[..., places.root_speed : places.root_speed + 6]
    return np.concatenate([attitude, velocity], axis=-1)


def _standing(polygons: list[Floats]) -> list[Floats]:
    return [polygon for polygon in polygons if not is_parked(polygon)]


class WarpRobot:
    """B simulated robots on a device; also their clock. Rows never influence one another.

    Args:
        batch: Number of rows B.
        robot: The robot of every row.
        period: Control period [s]; a whole number of physics steps.
        timestep: Physics step [s].
        limits: Sizes on the device.
        device: Name of a device of Warp, as cuda:0 or cpu; a GPU if not given.

    Attributes:
        period: Control period [s].
        positions: Coordinates of all worlds, shape (B, nq).
        worlds: The worlds on the device, from the first command on.
    """

    def __init__(
        self,
        batch: int,
        robot: RobotSpec,
        period: float,
        timestep: float,
        limits: Limits,
        device: str | None = None,
    ) -> None:
        self.period = period
        self._substeps = round(period / timestep)
        self._batch, self._limits, self._device = batch, limits, device
        self._yaws, self._joints = robot.yaw_count, len(robot.joint_names)
        self._parts = list(robot.command_shapes())
        self._sensors = SensorChain(robot.antenna.sensor, (batch, 2), period)
        self._rows = dict[int, WarpRow]()
        self._failures = dict[int, SimulationError]()
        self._new, self._ended = set[int](), set[int]()
        self._imu_params = robot.imu
        self._imu = Imu(robot.imu, batch) if robot.has_imu else None
        self._heads: Floats = np.zeros((batch, HEAD))
        self._missing = np.ones(batch, dtype=bool)
        self._noise: Floats = np.zeros((batch, 2))
        self._ticks = 0
        self.worlds: RobotWorlds | None = None
        self._forces: Floats | None = None
        self.positions: Floats = np.zeros((batch, 0))
        self._controls: Floats = np.zeros((batch, 0))

    @property
    def clock(self) -> WarpRobot:
        """The robot itself keeps the time."""
        return self

    def load(self, row: int, world: World, chance: Disturbance) -> None:
        """Put a fresh world into a row; it reaches the device with its first command."""
        if not self.positions.size:
            self.positions = np.zeros((self._batch, world.model.nq))
            self._controls = np.zeros((self._batch, world.model.nu))
        if world.model.nq != self.positions.shape[1]:
            raise SceneError(
                f"--engine warp: expected {self.positions.shape[1]} coordinates in every world, "
                f"found {world.model.nq}"
            )
        self._rows[row] = WarpRow(self, row, world, chance)
        self._failures.pop(row, None)
        self._new.add(row)
        self._sensors.reset(row)
        if self._imu is not None:
            self._imu.reset(row)
        self._missing[row] = not world.robot.antenna_count
        self.positions[row] = world.data.qpos
        self._heads[row] = _head(world.data.qpos, world.data.qvel, world.places)

    def unload(self, row: int) -> None:
        """Empty a row."""
        if self._rows.pop(row, None) is not None:
            self._ended.add(row)
        self._failures.pop(row, None)
        self._missing[row] = True

    def world(self, row: int) -> WarpRow:
        """The robot in a row, and the world around it."""
        if row not in self._rows:
            raise IndexError(f"row {row} holds no world")
        return self._rows[row]

    def joint_bias(self, row: int) -> Floats:
        """Errors of the zeros of the yaw joints in a row [rad], shape (Y,)."""
        return self._rows[row].chance.joint_bias.copy()

    @property
    def failures(self) -> Mapping[int, SimulationError]:
        """What ended simulations, by row."""
        return self._failures

    def forces(self) -> Floats:
        """Summed normal force on obstacles in the last physics step [N], shape (B,)."""
        if self._forces is None:
            none = np.zeros(self._batch)
            self._forces = self.worlds.forces() if self.worlds is not None else none
        return self._forces

    def now(self) -> float:
        """Time [s] since the batch began."""
        return self._ticks * self.period

    def read(self) -> AntennaFrame:
        """Sample both sensors of every row."""
        t, flex = np.full(self._batch, np.nan), np.zeros((self._batch, 2))
        bends = np.ones((self._batch, 2))
        for i, row in self._rows.items():
            t[i] = row.t
            self._noise[i], bends[i] = row.chance.noise(row.ticks), row.chance.bends
        joints = np.full((self._batch, self._joints), np.nan)
        for row in list(self._rows.values())[:1]:
            hinges = self.positions[:, row.world.places.hinges]
            flex = np.where(self._missing[:, None], 0.0, hinges.sum(axis=2) * bends)
            driven = self.positions[:, row.world.places.driven]
            for i, held in self._rows.items():
                joints[i] = driven[i]
                joints[i, : self._yaws] -= held.chance.joint_bias
        counts = self._sensors.step(flex, self._noise)
        counts[self._missing] = np.nan
        if self._imu is None:
            return AntennaFrame(t, counts, joints)
        errors = np.zeros((self._batch, 2 * AXES))
        for i, row in self._rows.items():
            errors[i] = row.chance.imu_error(row.ticks)
        felt = self._imu.step(np.nan_to_num(t), self._heads, errors)
        felt[self._missing] = np.nan
        return AntennaFrame(t, counts, joints, *measured(self._imu_params, felt))

    def write(self, command: JointCommand) -> None:
        """Command every row's joints."""
        drive = joint_angles(command, self._parts, self._batch)
        for i, row in self._rows.items():
            if i not in self._failures:
                drive[i, : self._yaws] += row.chance.joint_bias
                row.commanded = True
                try:
                    row.world.command(drive[i])
                except SimulationError as error:
                    self._fail(i, error)
                else:
                    self._controls[i] = row.world.data.ctrl
        self._settle()

    def _settle(self) -> None:
        """Bring to the device what was loaded, stop what has ended, and set all targets."""
        if not self._rows:
            return
        if self.worlds is None:
            first = next(iter(self._rows.values())).world
            self.worlds = RobotWorlds(first, self._batch, self._limits, self._device)
        for row in sorted(self._new):
            self.worlds.put_world(row, self._rows[row].world)
        for row in sorted(self._ended - self._rows.keys()):
            self.worlds.rest(row)
            self._controls[row] = 0.0
        self._new.clear()
        self._ended.clear()
        self.worlds.command(self._controls)

    def sleep_until(self, t: float) -> None:
        """Advance the physics of all rows to time t [s]."""
        while self._ticks * self.period < t - 1e-9:
            self._ticks += 1
            moving = {
                i: row for i, row in self._rows.items() if row.commanded and i not in self._failures
            }
            if self.worlds is None or not moving:
                continue
            for i, row in moving.items():
                friction = row.chance.leg_friction(row.ticks)
                if friction is not None:
                    row.world.set_leg_friction(friction)
                    self.worlds.set_friction(i, row.world)
                row.ticks += 1
            self.worlds.step(self._substeps)
            self._take(moving)

    def _take(self, moving: dict[int, WarpRow]) -> None:
        """Take the state of rows from the device, and look for those that are unsound."""
        if self.worlds is None:
            return
        self._forces = None
        positions, speeds = self.worlds.state()
        rows = list(moving)
        self.positions[rows] = positions[rows]
        self._heads[rows] = _head(positions[rows], speeds[rows], moving[rows[0]].world.places)
        dropped = self.worlds.overflows()
        places = moving[rows[0]].world.places
        bounded = positions[:, places.bounded]
        heads = positions[:, places.root : places.root + 3]
        unsound = np.flatnonzero(~sound(heads, bounded, speeds)).tolist()
        for i in moving.keys() & {*unsound, *dropped}:
            trouble = dropped.get(i) or broken(heads[i], bounded[i], speeds[i])
            self._fail(i, SimulationError(moving[i].ticks * self._substeps, trouble))

    def _fail(self, i: int, error: SimulationError) -> None:
        self._failures[i] = error
        self._missing[i] = True
