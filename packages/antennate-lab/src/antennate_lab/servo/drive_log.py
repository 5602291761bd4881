"""A joint of a robot as a recording of its servo: goals and positions of the log of `drive`."""

from __future__ import annotations

import hashlib
import math
from pathlib import Path

import numpy as np

from antennate.errors import BadInputError
from antennate.files import open_regular
from antennate.messages import nearest, shown
from antennate.robots.spec import RobotSpec
from antennate.telemetry.header import parts
from antennate.telemetry.reader import LogReader
from antennate.telemetry.ticks import Tick
from antennate.types import Bools, Floats
from antennate_lab.servo.recording import FEWEST, Recording, ServoConfig, check_course

_MAGIC = b"\x89MCAP"
_ARRIVED = 0.1
"""A servo that was this near to its goal once has come from where it stood at first [rad]."""
_WITHOUT_TORQUE = ("OFF", "")
"""States of the supervisor."""
_FAULT = "FAULT"
"""A state in which the last goals are held; it ends by an arm event, as if torque were off."""
_LOST = (
    *("DISARMED", "WATCHDOG", "SERVO_ERROR"),
    *("NOT_FOLLOWING", "IMPOSSIBLE_SPEED", "WRONG_MODE"),
)
"""Causes in whose ticks nobody knows whether a servo holds its goal."""


def is_log(path: Path) -> bool:
    """Whether a file is a log, by its first bytes; False if it cannot be read."""
    try:
        with open_regular(path) as file:
            return file.read(len(_MAGIC)) == _MAGIC
    except OSError:
        return False


def read(path: Path, config: ServoConfig) -> Recording:
    """A joint of a log as a recording; the load is what the configuration says, by default none.

    A goal is what the controller decided in the last tick whose command was sent. Whenever torque
    comes on, the supervisor lets goals come near slowly; what it tells the servo meanwhile is not
    known, so that torque counts from the first tick on that finds the servo at its goal. The log
    tells neither drive nor supply.
    """
    with LogReader(path) as log:
        robot = log.header.robot
        place = _place(path, robot, config)
        ticks = [
            tick
            for tick in log
            if tick.positions and math.isfinite(tick.angles[place] + tick.positions[place])
        ]
    if len(ticks) < FEWEST:
        raise BadInputError(
            f"{path}: expected at least {FEWEST} ticks with a measured position of {config.joint}, "
            f"found {len(ticks)}; simulated trials and dry runs have none"
        )
    t = np.array([tick.now for tick in ticks])
    position = np.array([tick.positions[place] for tick in ticks])
    goal = _goals(ticks, place)
    check_course(path, t, position, goal, config.given)
    torque, known = _torque(path, ticks, abs(goal - position) < _ARRIVED)
    unknown = np.full(len(t), math.nan)
    return Recording(
        name=f"{path.name}: {config.joint}",
        sha256=log_hash(path),
        p_gain=robot.servos.of(config.servo).p_gain,
        mass=config.mass or 0.0,
        length=config.length or 0.0,
        t=t - t[0],
        position=position,
        goal=goal,
        torque=torque,
        known=known,
        supply=unknown,
        drive=unknown,
    )


def _place(path: Path, robot: RobotSpec, config: ServoConfig) -> int:
    """Place of the joint among all; rolling legs turn without end and cannot be taken."""
    rolling = set(robot.leg_names if robot.legs.kind == "rolling" else ())
    names = [name for name in robot.joint_names if name not in rolling]
    if config.joint not in names:
        joint = "none" if config.joint is None else shown(config.joint)
        raise BadInputError(
            f"{path}: a log needs --joint, one of {', '.join(names)}"
            f"{nearest(config.joint or '', names)}, found {joint}"
        )
    place = robot.joint_names.index(config.joint)
    servo = robot.servo_names[place]
    if servo != config.servo:
        raise BadInputError(
            f"{path}: expected --servo {servo}, the servo of {config.joint}, found {config.servo}"
        )
    return place


def _goals(ticks: list[Tick], place: int) -> Floats:
    """Goals of a joint [rad], each held while no command is sent, as in HOLD and FAULT."""
    sent = np.array([tick.sent for tick in ticks])
    news = np.diff(sent, prepend=0) > 0
    last = np.maximum.accumulate(np.where(news, np.arange(len(ticks)), 0))
    return np.array([tick.angles[place] for tick in ticks])[last]


def _torque(path: Path, ticks: list[Tick], near: Bools) -> tuple[Bools, Bools]:
    """Whether goals counted, and whether it is known what the servo was told, at each tick."""
    on = np.array([tick.state not in _WITHOUT_TORQUE for tick in ticks])
    lost = np.array(
        [any(c.partition(":")[0].endswith(_LOST) for c in tick.causes) for tick in ticks]
    )
    follows, before = np.zeros(len(ticks), bool), 0
    for i, tick in enumerate(ticks):
        faulty = tick.state == _FAULT
        if not on[i] or lost[i] or (i and ticks[i - 1].state == _FAULT and not faulty):
            before = tick.sent  # torque is off, or comes on in this tick
        elif tick.sent > before:
            follows[i] = near[i] or follows[i - 1]
    if not follows.any():
        raise BadInputError(
            f"{path}: expected a joint that follows its goals, found it within {_ARRIVED:g} rad of "
            "them nowhere while torque was on"
        )
    return follows, follows | ~(on | lost)


def log_hash(path: Path) -> str:
    """SHA-256 of all files of a log, as hexadecimal digits."""
    whole = hashlib.sha256()
    for part in parts(path):
        with part.open("rb") as file:
            for piece in iter(lambda: file.read(1 << 20), b""):
                whole.update(piece)
    return whole.hexdigest()
