"""What flows between a robot and its controller, and the protocols of both.

A robot is simulated (`sim/sim_robot.py`), real (`Session` of
`hardware/safety/session.py`) or replayed from a log
(`telemetry/replay.py`); a controller is not told which. Arrays carry a leading batch axis of B
robots; B is 1 for a single one. "The paper" is arXiv 2603.07795.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields
from enum import IntEnum
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

SIDES = ("l", "r")
"""Left and right: the order of every array with an axis over the two sides."""
LEFT, RIGHT = 0, 1
SIDE_SIGN = (1.0, -1.0)
"""Sign of the lateral (y) coordinate on each side; y points to the robot's left."""


class Contact(IntEnum):
    """State of one antenna: it touches something, it is free, or its reading cannot be used."""

    FREE = 0
    CONTACT = 1
    UNKNOWN = 2


class Maneuver(IntEnum):
    """The four maneuvers of the paper, and HOLD, the answer to UNKNOWN: stand still."""

    FORWARD = 0
    TURN_L = 1
    TURN_R = 2
    REVERSE = 3
    HOLD = 4

    @classmethod
    def label(cls, value: int) -> str:
        """Name of a maneuver; a number that is no maneuver, as text."""
        return cls(value).name if value in set(cls) else str(value)


class State(IntEnum):
    """State of the supervisor, which may stop a real robot; each is safer than the one before.

    OK and DEGRADED walk. HOLD keeps the last joint targets, with the motors on. FAULT is a HOLD
    that lasts until a person arms the robot again. OFF has no torque and lasts likewise.
    """

    OK = 0
    DEGRADED = 1
    HOLD = 2
    FAULT = 3
    OFF = 4


@dataclass(frozen=True, slots=True)
class AntennaFrame:
    """What a robot feels: one reading of both antennae, its joints, and how its head moves.

    A further sensor is a field here, empty by default and NaN where a sample is missing. The robots
    above fill it, and `telemetry/topics.py` logs it.

    Attributes:
        t: Time at which the sensors were sampled [s], shape (B,).
        counts: 12-bit ADC readings, shape (B, 2), left before right; NaN where a sample is missing.
        positions: Joint angles as the servos report them [rad], shape (B, n), in the order of the
            robot's joints, legs counted over full turns; NaN where one did not answer. Shape (B, 0)
            or (0, 0) where a robot cannot tell any. A real robot reads them after it has written
            its targets, so they are those of the control period before.
        angular_velocity: Of the head [rad/s], shape (B, 3), about its axes: x forward, y to the
            left, z up (REP 103). NaN where a sample is missing. Shape (B, 0) or (0, 0) where a
            robot has no inertial sensor.
        linear_acceleration: Specific force on the head [m/s²] along the same axes, with the same
            shapes: at rest the acceleration of gravity upwards, as in ROS' sensor_msgs/Imu.
    """

    t: Floats
    counts: Floats
    positions: Floats = field(default_factory=lambda: np.zeros((0, 0)))
    angular_velocity: Floats = field(default_factory=lambda: np.zeros((0, 0)))
    linear_acceleration: Floats = field(default_factory=lambda: np.zeros((0, 0)))

    def copy(self) -> AntennaFrame:
        """A copy with arrays of its own."""
        return AntennaFrame(*(getattr(self, part.name).copy() for part in fields(self)))


@dataclass(frozen=True, slots=True)
class JointCommand:
    """Joint targets for one control period.

    Attributes:
        yaw: Yaw joint angles [rad], shape (B, Y).
        leg: Leg axle angles [rad], counted over full turns, 0 where the leg stands, shape
            (B, L, 2).
        antenna: Sweep angle of the antenna bases about their mounting angle [rad], positive
            towards the tail, shape (B, 2).
        pitch: Pitch joint angles [rad], shape (B, P), positive where the part in front of the joint
            rises; empty where pitch is not actuated.
        elevation: Elevation of the antenna bases above the plane of the head [rad], shape (B, 2);
            empty for a robot without elevation joints.
    """

    yaw: Floats
    leg: Floats
    antenna: Floats
    pitch: Floats = field(default_factory=lambda: np.zeros((0, 0)))
    elevation: Floats = field(default_factory=lambda: np.zeros((0, 0)))


def joint_angles(command: JointCommand, parts: Iterable[str], batch: int = 1) -> Floats:
    """All angles of a command side by side [rad], shape (B, n), by the names of its parts.

    The parts that a robot has, in the order of its joints, are those of `RobotSpec.command_shapes`.
    """
    return np.concatenate([getattr(command, name).reshape(batch, -1) for name in parts], axis=1)


def joint_command(angles: Floats, shapes: Mapping[str, tuple[int, ...]]) -> JointCommand:
    """The command of one robot with these angles side by side [rad], shape (n,).

    `shapes` are those of its parts, of `RobotSpec.command_shapes`.
    """
    parts = np.split(angles, np.cumsum([math.prod(shape) for shape in shapes.values()])[:-1])
    named = zip(shapes.items(), parts, strict=True)
    return JointCommand(**{name: part.reshape(shape) for (name, shape), part in named})


class Clock(Protocol):
    """Time of a robot, or of a batch. In simulation, sleeping makes the physics advance."""

    def now(self) -> float:
        """Time [s] since the start."""
        ...

    def sleep_until(self, t: float) -> None:
        """Return at time t [s], at once if it has passed."""
        ...


class Robot(Protocol):
    """A batch of B robots: antennae to read, joints to command, one clock."""

    @property
    def clock(self) -> Clock:
        """The robot's clock."""
        ...

    def read(self) -> AntennaFrame:
        """What the robot feels now."""
        ...

    def write(self, command: JointCommand) -> None:
        """Set new joint targets."""
        ...


class Controller(Protocol):
    """Control of B robots at once: row i of every array belongs to robot i.

    The rows never influence one another. A controller answers HOLD in a row where a count of
    either antenna is NaN, and keeps its joint targets; ours also where one is at an end of the
    converter's range (`control/conditioning.py`). NaN elsewhere is no reason to. See
    docs/controllers.md.
    """

    @property
    def maneuver(self) -> Ints:
        """`Maneuver` of the last step, shape (B,)."""
        ...

    @property
    def contact(self) -> Ints:
        """`Contact` of each antenna in the last step, shape (B, 2)."""
        ...

    @property
    def level(self) -> Floats:
        """Bending level b of each antenna in the last step, 0 to 1, shape (B, 2)."""
        ...

    def reset(self, rows: Ints | Bools, phase: Floats | float = 0.0) -> None:
        """Start some rows anew, indices (n,) or a mask (B,), their gait at a phase [rad]."""
        ...

    def step(self, frame: AntennaFrame) -> JointCommand:
        """One control period: the joint targets for this frame."""
        ...
