"""The simulated robot: a batch of worlds stepped in lockstep, whose states one look serves.

A row holds one world or none. An empty row, one whose simulation failed, and an antenna that the
robot does not have read NaN, which the controller takes for UNKNOWN. Rows never influence one
another.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from antennate.antenna.sensor import SensorChain, reading_noise
from antennate.errors import ConfigError, SimulationError
from antennate.params.scene import VariationParams
from antennate.robots.imu import AXES, bias_of, measured, noise_of
from antennate.robots.spec import RobotSpec
from antennate.sim.states import States
from antennate.sim.world import World
from antennate.types import AntennaFrame, Bools, Floats, Ints, JointCommand, joint_angles

if TYPE_CHECKING:
    from antennate.sim.imu import Imu

NOISE_BLOCK = 1024
"""Ticks whose noise is drawn at once."""


class Disturbance:
    """What chance does to one trial: sensor noise, slipping legs, joints off their zero.

    An antenna that is broken off is one whose flex sensor stays straight.

    Attributes:
        joint_bias: Error of the zero of each yaw joint [rad], shape (Y,).
        slip_ticks: Ticks from one friction of the legs to the next.
        bends: What each flex sensor feels of the bend of its antenna, 0 for one that stays
            straight, shape (2,).
        imu_bias: Zeros of the inertial sensor [rad/s], then [m/s²], shape (6,); empty without one.
    """

    def __init__(
        self,
        rng: np.random.Generator,
        variation: VariationParams,
        robot: RobotSpec,
        period: float,
    ) -> None:
        self._rng = rng
        self._robot, self._variation = robot, variation
        self.slip_ticks = max(1, round(variation.slip_time / period))
        self._noise = np.zeros((0, 2))
        self.joint_bias: Floats = rng.normal(0.0, variation.joint_bias, robot.yaw_count)
        self.bends: Floats = np.array([1.0, robot.antennae.right_gain])
        if variation.broken != "none":
            random = variation.broken == "random"
            side = int(rng.integers(2)) if random else ("left", "right").index(variation.broken)
            self.bends[side] = 0.0
        self._period = period
        self._imu_rng = rng.spawn(1)[0] if robot.has_imu else None  # draws nothing from `rng`
        self._imu_noise = np.zeros((0, 2 * AXES))
        self.imu_bias: Floats = np.zeros(0)
        if self._imu_rng is not None:
            self.imu_bias = bias_of(robot.imu, self._imu_rng)

    def noise(self, tick: int) -> Floats:
        """Reading noise of one tick [counts], shape (2,)."""
        at = tick % NOISE_BLOCK
        if at == 0:
            self._noise = self.noise_block()
        return self._noise[at]

    def noise_block(self) -> Floats:
        """Reading noise of the next NOISE_BLOCK ticks [counts], shape (NOISE_BLOCK, 2)."""
        noise = reading_noise(self._robot.antenna.sensor, self._rng, (NOISE_BLOCK, 2))
        return self._variation.reading_noise * noise

    def imu_error(self, tick: int) -> Floats:
        """Bias and noise of the inertial sensor in one tick [rad/s], then [m/s²], shape (6,)."""
        at = tick % NOISE_BLOCK
        if at == 0 or not len(self._imu_noise):
            self._imu_noise = self.imu_error_block()
        return self._imu_noise[at]

    def imu_error_block(self) -> Floats:
        """Errors of the inertial sensor in the next NOISE_BLOCK ticks, shape (NOISE_BLOCK, 6)."""
        if self._imu_rng is None:
            return np.zeros((NOISE_BLOCK, 2 * AXES))
        noise = noise_of(self._robot.imu, self._imu_rng, NOISE_BLOCK, self._period)
        return self.imu_bias + noise

    def leg_friction(self, tick: int) -> Floats | None:
        """New friction of all legs where this tick draws one, else None."""
        if tick % self.slip_ticks:
            return None
        factor = np.exp(self._rng.normal(0.0, self._variation.slip_log_sd, self._robot.leg_count))
        return np.clip(np.array(self._robot.leg_frictions) * factor, 0.02, 2.0)


def _imu(robot: RobotSpec, batch: int) -> Imu:
    """The inertial sensors of the heads of B robots."""
    from antennate.sim.imu import Imu  # few robots have one

    return Imu(robot.imu, batch)


class _Row:
    """One world of the batch with its disturbance and its tick count."""

    __slots__ = ("chance", "commanded", "tick", "world")

    def __init__(self, world: World, chance: Disturbance) -> None:
        self.world = world
        self.chance = chance
        self.tick = 0
        self.commanded = False


class SimRobot:
    """B simulated robots; also their clock.

    Args:
        batch: Number of rows B.
        robot: The robot of every row.
        period: Control period [s]; a whole number of physics steps.
        timestep: Physics step [s].
    """

    def __init__(self, batch: int, robot: RobotSpec, period: float, timestep: float) -> None:
        self._rows: dict[int, _Row] = {}
        self._failures: dict[int, SimulationError] = {}
        self._batch = batch
        self._yaws, self._antennae = robot.yaw_count, robot.antenna_count
        self._parts = list(robot.command_shapes())
        self._sensors = SensorChain(robot.antenna.sensor, (batch, 2), period)
        self._period = period
        self._substeps = round(period / timestep)
        if abs(self._substeps * timestep - period) > 1e-9:
            raise ConfigError(
                f"the control period must be a whole number of physics steps of {timestep:g} s, "
                f"found {period:g} s"
            )
        self._ticks = 0
        sensed = robot.antenna.sensed_hinges if robot.antenna_count else 0
        self._states = States(batch, sensed, len(robot.joint_names))
        self._bias: Floats = np.zeros((batch, robot.yaw_count))
        self._bends: Floats = np.ones((batch, 2))
        self._noise: Floats = np.zeros((batch, NOISE_BLOCK, 2))
        self._imu_params = robot.imu
        self._imu = _imu(robot, batch) if robot.has_imu else None
        blocks = NOISE_BLOCK if robot.has_imu else 0
        self._imu_error: Floats = np.zeros((batch, blocks, 2 * AXES))
        self._every: Ints = np.arange(batch)
        self._empty, self._missing = np.ones((2, batch), dtype=bool)
        self._moved: set[int] = set()

    @property
    def clock(self) -> SimRobot:
        """The robot itself keeps the time."""
        return self

    def load(self, row: int, world: World, chance: Disturbance) -> None:
        """Put a fresh world into a row."""
        self.unload(row)
        self._rows[row] = _Row(world, chance)
        self._states.put(row, world)
        self._bias[row], self._bends[row] = chance.joint_bias, chance.bends
        self._reset_sensors(row)
        self._empty[row], self._missing[row] = False, not world.robot.antenna_count

    def put_back(self, row: int, state: Floats) -> None:
        """Let the world of a row go on from a state of its own; its sensors forget."""
        if self._moved:
            self._look()
        self._rows[row].world.restore(state)
        self._reset_sensors(row)

    def _reset_sensors(self, row: int) -> None:
        self._sensors.reset(row)
        if self._imu is not None:
            self._imu.reset(row)

    def unload(self, row: int) -> None:
        """Empty a row."""
        self._rows.pop(row, None)
        self._failures.pop(row, None)
        self._moved.discard(row)
        self._states.remove(row)
        self._empty[row] = self._missing[row] = True

    def world(self, row: int) -> World:
        """The world in a row."""
        if row not in self._rows:
            raise IndexError(f"row {row} holds no world")
        return self._rows[row].world

    def joint_bias(self, row: int) -> Floats:
        """Errors of the zeros of the yaw joints in a row [rad], shape (Y,)."""
        return self._bias[row].copy()

    @property
    def failures(self) -> Mapping[int, SimulationError]:
        """What ended simulations, by row."""
        if self._moved:
            self._look()
        return self._failures

    def now(self) -> float:
        """Time [s] since the batch began."""
        return self._ticks * self._period

    def read(self, rows: Bools | None = None) -> AntennaFrame:
        """Sample the sensors of every row, or of these alone, shape (B,).

        The sensors of other rows do not remember it; the frame holds no reading of them.
        """
        self._look()
        at = [0] * self._batch
        for i, row in self._rows.items():
            at[i] = row.tick % NOISE_BLOCK
            if not at[i] and (rows is None or rows[i]):
                self._noise[i] = row.chance.noise_block()
                if self._imu is not None:
                    self._imu_error[i] = row.chance.imu_error_block()
        noise = self._noise[self._every, at]
        flex = self._states.hinges.sum(axis=2) * self._bends
        counts = self._sensors.step(flex, noise, rows)
        counts[self._missing] = np.nan
        counts[:, self._antennae :] = np.nan
        joints = self._states.joints
        joints[:, : self._yaws] -= self._bias  # a servo reports angles about its own zero
        joints[self._empty] = np.nan
        t = np.where(self._empty, np.nan, self._states.times)
        if self._imu is None:
            return AntennaFrame(t, counts, joints)
        error = self._imu_error[self._every, at]
        felt = self._imu.step(self._states.times, self._states.heads, error, rows)
        felt[self._missing] = np.nan
        return AntennaFrame(t, counts, joints, *measured(self._imu_params, felt))

    def write(self, command: JointCommand) -> None:
        """Command every row's joints."""
        drive = joint_angles(command, self._parts, self._batch)
        drive[:, : self._yaws] += self._bias
        finite = bool(np.isfinite(drive).all())
        for i, row in self._rows.items():
            if i not in self._failures:
                row.commanded = True
                if finite:
                    row.world.command_finite(drive[i])
                    continue
                try:
                    row.world.command(drive[i])
                except SimulationError as error:
                    self._fail(i, error)

    def sleep_until(self, t: float) -> None:
        """Advance the physics of every row that has been commanded to time t [s].

        What has become of the rows is looked at with the next tick, reading or question for
        failures, all of them at once: a physics step pushes everything else out of the cache.
        For the same reason rows are stepped to and fro: the last of a tick are the first of the
        next, while the cache still has them. Until the look a world is changed by hand through
        `put_back` only.
        """
        while self._ticks * self._period < t - 1e-9:
            if self._moved:
                self._look()
            self._ticks += 1
            rows = list(self._rows.items())
            for i, row in rows if self._ticks % 2 else reversed(rows):
                if row.commanded and i not in self._failures:
                    if not row.tick % row.chance.slip_ticks:
                        friction = row.chance.leg_friction(row.tick)
                        if friction is not None:
                            row.world.set_leg_friction(friction)
                    row.tick += 1
                    try:
                        row.world.advance(self._substeps)
                    except SimulationError as error:
                        self._fail(i, error)
                    else:
                        self._moved.add(i)

    def _look(self) -> None:
        """Take the states of all rows, and find those whose last advance failed."""
        moved, self._moved = self._moved, set[int]()
        for i in self._states.look():
            if i in moved and i not in self._failures:
                try:
                    self._rows[i].world.check()
                except SimulationError as error:
                    self._fail(i, error)

    def _fail(self, i: int, error: SimulationError) -> None:
        self._failures[i] = error
        self._missing[i] = True
