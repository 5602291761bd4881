"""How far a simulated course is from the measured one, in units of the noise, channel by channel.

Channels are what does not diverge: the angles of the joints that move, in the air also the
gyroscope about the vertical axis and the readings of the antennae, which swing with what moves.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from antennate.robots.spec import RobotSpec
from antennate.types import Floats, Ints
from antennate_lab.fit.simulated import Course
from dynamixel_bus.model import POSITION_UNIT

MOVES = 0.02
"""A joint that is told to move by less rests [rad]."""
PIECE = 0.5
"""Length of the pieces of a course over which a bootstrap draws [s]."""
NOISE = {"position": POSITION_UNIT / 12**0.5, "gyro": 0.01, "counts": 3.0}
"""Least noise of a channel, by its kind: rounding [rad], [rad/s], [counts] (assumed)."""
FEWEST_COUNTS = 30.0
"""Readings that move by less tell nothing [counts] (assumed: ten times their noise)."""
YAW_AXIS = 2


def moving(course: Course) -> Ints:
    """Places of the joints that are told to move."""
    return np.flatnonzero(np.ptp(course.commands, axis=0) > MOVES)


def merged(robot: RobotSpec, courses: Sequence[Course]) -> list[Course]:
    """Courses in the air, those of legs as one.

    Legs are light beside the body, so that one simulation shows all of them. Antennae are not
    merged: what the head gives to one, the reading of the other feels.
    """
    groups: defaultdict[object, list[Course]] = defaultdict(list)
    for at, course in enumerate(courses):
        legs = {_kind(robot, joint) for joint in moving(course).tolist()} == {"legs"}
        groups["legs" if legs else at, len(course.commands)].append(course)
    return [_one(*group) for group in groups.values()]


def _kind(robot: RobotSpec, joint: int) -> str:
    """Group of a joint; pitch joints and elevations count as yaw joints, which move all others."""
    for name in ("legs", "antennae"):
        places = robot.places(name)
        if places.start <= joint < places.stop:
            return name
    return "yaw"


def _one(first: Course, *others: Course) -> Course:
    """Courses of joints that do not feel one another as one: each angle from its own course."""
    if not others:
        return first
    commands, positions = first.commands.copy(), first.positions.copy()
    for course in others:
        joints = moving(course)
        commands[:, joints] = course.commands[:, joints]
        positions[:, joints] = course.positions[:, joints]
    name = f"{first.name} and {len(others)} others"
    return replace(first, name=name, commands=commands, positions=positions)


def labels(robot: RobotSpec, course: Course) -> list[tuple[str, str]]:
    """Kind and name of each channel of a course in the air, in the order of `channels`."""
    joints = moving(course).tolist()
    names = [("position", robot.joint_names[joint]) for joint in joints]
    kinds = {_kind(robot, joint) for joint in joints}
    if "yaw" in kinds and course.gyro.size:
        names.append(("gyro", "gyro"))
    if kinds - {"legs"} and course.counts.size:
        names += [("counts", side) for side in ("left", "right")]
    return names


def channels(robot: RobotSpec, course: Course, measured: Course) -> Floats:
    """Channels of a course in the air, shape (n, C); gyroscope and readings about their mean.

    A flex sensor remembers how far it was bent before. So its readings count from the first large
    bend of the step on, which makes it forget.

    Args:
        robot: The robot.
        course: The course, measured or simulated.
        measured: The measured one, which tells when readings begin to count.
    """
    kinds = {kind for kind, _ in labels(robot, measured)}
    parts = [course.positions[:, moving(measured)]]
    if "gyro" in kinds:
        turning = course.gyro[:, YAW_AXIS:]
        parts.append(turning - turning.mean(axis=0))
    if "counts" in kinds:
        pairs = zip(course.counts.T, measured.counts.T, strict=True)
        parts.append(np.array([_read(*pair) for pair in pairs]).T)
    return np.nan_to_num(np.concatenate(parts, axis=1))


def _read(counts: Floats, measured: Floats) -> Floats:
    """Readings of one antenna about their mean from the first large bend on, 0 before, (n,)."""
    away = abs(measured - np.median(measured))
    begin = int(np.argmax(away > 0.5 * away.max()))
    heard = np.arange(len(counts)) >= begin
    if not away.max() > FEWEST_COUNTS:
        return np.zeros(len(counts))
    return np.where(heard, counts - counts[heard].mean(), 0.0)


def pieces(course: Course) -> Ints:
    """Number of the piece of each tick, shape (n,)."""
    return np.arange(len(course.commands)) // round(PIECE / course.period)
