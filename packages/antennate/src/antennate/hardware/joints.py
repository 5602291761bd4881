"""Joints as their servos know them: settings, speeds, angles to positions and back.

Servos have to be set before any of them gets torque: one rule for drive, setup and doctor.
Drive Mode has to be 0: the robot's `directions` mirror joints, and bit 3 would let a goal bring
torque. With a homing offset a watchdog makes a servo in extended mode move, and zeros are not what
its description says. Position and velocity limits have to leave room for what is asked for; rolling
legs are in extended mode, where position limits do not act.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from antennate.errors import AntennateError
from antennate.messages import typed
from antennate.params.hardware import ZerosParams
from antennate.robots.spec import RobotSpec
from antennate.types import Floats, Ints, JointCommand, joint_command
from dynamixel_bus.model import (
    MOST_TICKS,
    POSITION_UNIT,
    TICKS_A_TURN,
    VELOCITY_UNIT,
    angle_at,
    position_at,
)
from dynamixel_bus.models import MODELS_BY_NUMBER

_ROOM = 1.25
"""Profile velocity by the fastest that goals move, so that a joint that lags catches up
(assumed)."""


class Setting(NamedTuple):
    """What a register may hold, and the value to set if it holds another."""

    low: int
    high: int
    cure: int

    def allows(self, value: int) -> bool:
        """Whether the value may stay."""
        return self.low <= value <= self.high

    def __str__(self) -> str:
        if self.low == self.high:
            return str(self.low)
        return f"at most {self.high}" if self.cure == self.low else f"at least {self.low}"


def settings(robot: RobotSpec) -> Mapping[str, Mapping[int, Setting]]:
    """Required settings by register and id, in the order in which they are set."""
    zero = dict.fromkeys(robot.ids, Setting(0, 0, 0))
    low, high = _position_limits(robot)
    return {
        "operating_mode": {i: Setting(m, m, m) for i, m in robot.modes.items()},
        "drive_mode": zero,
        "homing_offset": zero,
        "velocity_limit": _velocity_limits(robot),
        "max_position_limit": high,
        "min_position_limit": low,
    }


def all_settings(robot: RobotSpec) -> Mapping[str, Mapping[int, Setting]]:
    """Required settings and the return delay, which makes answers late and forbids no torque."""
    delay = dict.fromkeys(robot.ids, Setting(0, 0, 0))
    return {**settings(robot), "return_delay_time": delay}


def settings_of(rules: Mapping[str, Mapping[int, Setting]], servo: int) -> dict[str, Setting]:
    """Settings of one servo by register."""
    return {name: by_id[servo] for name, by_id in rules.items() if servo in by_id}


def profile_velocities(robot: RobotSpec) -> dict[int, int]:
    """Profile velocity by id [0.229 rev/min]: `fastest` of its group with some room."""
    limits = {
        i: MODELS_BY_NUMBER[model]["velocity_limit"].default or 0
        for i, model in robot.models.items()
    }
    return {
        servo: min(math.ceil(_ROOM * fastest / VELOCITY_UNIT), limits[servo])
        for servo, fastest in zip(robot.ids, robot.fastest, strict=True)
    }


def wrong_settings(known: Mapping[str, Mapping[int, int]], robot: RobotSpec) -> list[str]:
    """What is not as it has to be, in words, of values by register and id."""
    faults: dict[str, list[int]] = {}
    for name, wanted in settings(robot).items():
        for servo, setting in wanted.items():
            value = known[name][servo]
            if not setting.allows(value):
                what = f"{name.replace('_', ' ')} {value} (expected {setting}) in servos"
                faults.setdefault(what, []).append(servo)
    return [f"{what} {ids}" for what, ids in faults.items()]


def _velocity_limits(robot: RobotSpec) -> dict[int, Setting]:
    """A servo refuses a profile that is faster than its velocity limit."""
    velocities = profile_velocities(robot)
    limits = {
        servo: MODELS_BY_NUMBER[robot.models[servo]]["velocity_limit"] for servo in velocities
    }
    return {
        servo: Setting(least, limits[servo].high or 0, limits[servo].default or 0)
        for servo, least in velocities.items()
    }


def _position_limits(robot: RobotSpec) -> tuple[dict[int, Setting], dict[int, Setting]]:
    """Smallest and largest position limits, of joints that do not turn without end."""
    low: dict[int, Setting] = {}
    high: dict[int, Setting] = {}
    for servo, zero, limit in zip(robot.ids, robot.zeros, robot.limits, strict=True):
        if math.isfinite(limit):
            reach, last = limit / POSITION_UNIT, TICKS_A_TURN - 1
            low[servo] = Setting(0, max(round(zero - reach), 0), 0)
            high[servo] = Setting(min(round(zero + reach), last), last, last)
    return low, high


def unmeasured(
    robot: RobotSpec, zeros: ZerosParams, lists: Sequence[str] = ("zeros", "directions")
) -> tuple[str, ...]:
    """Names of the joints that lack a measured or stated value in one of these lists."""
    return tuple(dict.fromkeys((*robot.unstated(*lists), *zeros.missing)))


def zeros_lack(robot: RobotSpec, zeros: ZerosParams) -> str:
    """Why the robot must not walk, in words: zeros or directions are not known; else empty."""
    if not (names := unmeasured(robot, zeros)):
        return ""
    which = f" of {', '.join(names)}" if len(names) < len(robot.ids) else ""
    return (
        f"expected measured zeros and directions of all joints, found none{which}; "
        f"`{typed('zero')}` measures them"
    )


class CommandError(AntennateError):
    """A command that no servo must be sent."""


class Joints:
    """All joints of one robot that servos move, in the order of its description.

    Attributes:
        profiles: Profile velocities by id [0.229 rev/min], above what goals are moved at.
        in_order_of_release: Ids of the groups in the order in which they lose their torque.
        turning: Places in `ids` of the joints that turn without end.
    """

    def __init__(self, robot: RobotSpec) -> None:
        self.robot, self.ids, self.models = robot, robot.ids, robot.models
        self.profiles = profile_velocities(robot)
        self.in_order_of_release = robot.in_order_of_release
        self._shapes = robot.command_shapes()
        self._sign: Floats = np.array(robot.directions, float)
        self._zero: Floats = np.array(robot.zeros, float)
        self._limit: Floats = np.array(robot.limits)
        self._fastest: Floats = np.array(robot.fastest)
        self.turning: Ints = np.flatnonzero(np.isinf(self._limit))

    def ticks(self, command: JointCommand) -> Ints:
        """Goal positions [ticks] of a command of one robot, shape (n,)."""
        parts = (_part(command, name, shape) for name, shape in self._shapes.items())
        angles = np.concatenate([part.ravel() for part in parts])
        with np.errstate(over="ignore"):  # infinite then, and refused
            ticks = np.rint(self.positions(angles))
        turning = np.isinf(self._limit)
        counted = np.where(turning, abs(ticks) <= MOST_TICKS, (ticks >= 0) & (ticks < TICKS_A_TURN))
        bad = ~counted | (abs(angles) > self._limit)
        if bad.any():
            first = int(np.argmax(bad))
            within = "256 turns" if turning[first] else f"{self._limit[first]:.4g} rad"
            raise CommandError(
                f"expected a finite angle within {within} for servo {self.ids[first]}, found "
                f"{angles[first]}"
            )
        return ticks.astype(np.int64)

    def reach(self, time: float) -> Floats:
        """Ticks that each joint may go in a time [s], shape (n,)."""
        return self._fastest * time / POSITION_UNIT

    def align(self, ticks: Ints | Floats, command: JointCommand) -> None:
        """Count whole turns of legs so that a command is nearest to where they stand [ticks]."""
        away = (ticks - self.ticks(command))[self.turning]
        self._zero[self.turning] += TICKS_A_TURN * np.rint(away / TICKS_A_TURN)

    def shift(self, at: int, ticks: float) -> None:
        """Count the position of the joint at a place in `ids` from elsewhere by some ticks."""
        self._zero[at] += ticks

    def positions(self, angles: Floats) -> Floats:
        """Positions, not rounded [ticks], of joint angles [rad], both of shape (n,)."""
        return position_at(angles, self._zero, self._sign)

    def angles(self, ticks: Ints | Floats) -> Floats:
        """Joint angles [rad] at positions [ticks], both of shape (n,)."""
        return angle_at(np.asarray(ticks, float), self._zero, self._sign)

    def command(self, ticks: Ints | Floats) -> JointCommand:
        """The command of one robot at these positions [ticks], shape (n,)."""
        return joint_command(self.angles(ticks), self._shapes)

    def plain(self, command: JointCommand) -> JointCommand:
        """A copy of a command of one robot; CommandError if it is anything else."""
        shapes = self._shapes.items()
        return JointCommand(**{name: _part(command, name, shape) for name, shape in shapes})


def _part(command: JointCommand, name: str, shape: tuple[int, ...]) -> Floats:
    try:
        part = np.array(getattr(command, name), float)
    except KeyboardInterrupt:
        raise
    except BaseException:  # noqa: BLE001 a controller of one's own may say anything
        raise CommandError(
            f"expected a JointCommand with numbers in {name}, found a {type(command).__name__}"
        ) from None
    if part.shape != shape:
        raise CommandError(f"expected {name} of shape {shape}, found shape {part.shape}")
    return part
