"""A joint of a robot as a recording of its servo: goals and positions of the log of `drive`."""

from __future__ import annotations

import hashlib
import math
from pathlib import Path

import numpy as np

from antennate.errors import BadInputError
from antennate.experiments.servo.config import ServoConfig
from antennate.experiments.servo.recording import FEWEST, Recording, check
from antennate.files import open_regular
from antennate.messages import nearest, shown
from antennate.robots.spec import RobotSpec
from antennate.telemetry.parts import parts
from antennate.telemetry.reader import LogReader
from antennate.telemetry.ticks import Tick
from antennate.types import Bools

_MAGIC = b"\x89MCAP"
_ARRIVED = 0.1
"""A servo that was this near to its goal once has come from where it stood at first [rad]."""
_WITHOUT_TORQUE = ("FAULT", "OFF", "")
"""States of the supervisor."""


def is_log(path: Path) -> bool:
    """Whether a file is a log, by its first bytes; False if it cannot be read."""
    try:
        with open_regular(path) as file:
            return file.read(len(_MAGIC)) == _MAGIC
    except OSError:
        return False


def read(path: Path, config: ServoConfig) -> Recording:
    """A joint of a log as a recording; the load is what the configuration says, by default none.

    Goals are what the controller decided. The supervisor lets them come near slowly at first, so
    torque counts from the first tick on that finds the servo at its goal. The log tells neither
    drive nor supply.

    Raises:
        BadInputError: No such joint, another servo, or a log without measured positions.
        LogError: It cannot be read.
    """
    with LogReader(path) as log:
        robot = log.header.robot
        place = _place(path, robot, config)
        ticks = [tick for tick in log if tick.positions and math.isfinite(_error(tick, place))]
    if len(ticks) < FEWEST:
        raise BadInputError(
            f"{path}: expected at least {FEWEST} ticks with a measured position of {config.joint}, "
            f"found {len(ticks)}; simulated trials and dry runs have none"
        )
    t = np.array([tick.now for tick in ticks])
    position = np.array([tick.positions[place] for tick in ticks])
    goal = np.array([tick.angles[place] for tick in ticks])
    check(path, t, position, goal)
    unknown = np.full(len(t), math.nan)
    return Recording(
        name=f"{path.name}: {config.joint}",
        sha256=_hash(path),
        p_gain=robot.servos.of(config.servo).p_gain,
        mass=config.mass or 0.0,
        length=config.length or 0.0,
        t=t - t[0],
        position=position,
        goal=goal,
        torque=_torque(path, ticks, place),
        supply=unknown,
        drive=unknown,
    )


def _place(path: Path, robot: RobotSpec, config: ServoConfig) -> int:
    """Place of the joint among all; rolling legs turn without end and cannot be taken."""
    rolling = set(robot.leg_names if robot.legs.kind == "rolling" else ())
    names = [name for name in robot.joint_names if name not in rolling]
    if config.joint not in names:
        found = "none" if config.joint is None else shown(config.joint)
        raise BadInputError(
            f"{path}: a log needs --joint, one of {', '.join(names)}"
            f"{nearest(config.joint or '', names)}, found {found}"
        )
    place = robot.joint_names.index(config.joint)
    servo = robot.servo_names[place]
    if servo != config.servo:
        raise BadInputError(
            f"{path}: expected --servo {servo}, the servo of {config.joint}, found {config.servo}"
        )
    return place


def _error(tick: Tick, place: int) -> float:
    """Goal less position of a joint [rad]."""
    return tick.angles[place] - tick.positions[place]


def _torque(path: Path, ticks: list[Tick], place: int) -> Bools:
    """Whether goals counted, at each tick."""
    driven = np.array([tick.state not in _WITHOUT_TORQUE and tick.sent > 0 for tick in ticks])
    near = np.array([abs(_error(tick, place)) < _ARRIVED for tick in ticks])
    arrived = np.logical_or.accumulate(driven & near)
    if not arrived.any():
        raise BadInputError(
            f"{path}: expected a joint that follows its goals, found it within {_ARRIVED:g} rad of "
            "them nowhere while torque was on"
        )
    return driven & arrived


def _hash(path: Path) -> str:
    """Hash of all files of a log."""
    whole = hashlib.sha256()
    for part in parts(path):
        with part.open("rb") as file:
            for piece in iter(lambda: file.read(1 << 20), b""):
                whole.update(piece)
    return whole.hexdigest()
