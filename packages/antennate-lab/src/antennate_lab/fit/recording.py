"""A log of a protocol as courses, and what is wrong with it.

Ticks are laid on a grid of the control period: a command holds until the next one, what is measured
is taken between two ticks.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from antennate.errors import BadInputError
from antennate.params.scene import HookParams
from antennate.robots.spec import RobotSpec
from antennate.telemetry.mocap import Poses
from antennate.telemetry.reader import LogReader
from antennate.telemetry.steps import LoggedStep, protocol_of, steps
from antennate.telemetry.ticks import Tick
from antennate.types import Floats
from antennate_lab.fit import measures
from antennate_lab.fit.residuals import moving
from antennate_lab.fit.simulated import Course
from antennate_lab.servo.drive_log import log_hash

DRIFT = 0.003
"""A clock that runs fast or slow by more of its time is named (assumed: a crystal has 0.0001)."""
FEWEST = 50
"""Fewest ticks of a step that can be compared."""
_LOST = 0.2
"""A step in which a joint lacks a larger share of its measurements is left out (assumed)."""
ODD = 1.3
"""A joint whose lag differs from those of its group by more than this factor is named."""
_MUCH = 0.001
"""And by more than this, a tenth of a tick [s]."""
_PARTS = ("links", "joint_names", "servo_names", "ids")
"""What a log and a robot's file must agree on."""
_SIZES = ("mass", "link_pitch", "leg_radius", "leg_eccentricity", "leg_mass")
"""What a fit takes from the robot's file; that of the log should agree."""


@dataclass(frozen=True)
class Recording:
    """One log of a protocol.

    Attributes:
        name: Name of its file, without the ending.
        sha256: Hash of its bytes.
        courses: Steps that can be compared, the gyroscope less its zero.
        gyro_zero: Mean of the gyroscope where the head came back to where it was [rad/s], shape
            (3,), or (0,) without one.
        left_out: Steps of the protocol that cannot, and why.
        warnings: What else is wrong with the log.
    """

    name: str
    sha256: str
    courses: list[Course]
    gyro_zero: Floats
    left_out: dict[str, str]
    warnings: list[str]


def read(path: Path, robot: RobotSpec, seen: tuple[str, Poses] | None = None) -> Recording:
    """Read a log.

    Args:
        path: Its first file.
        robot: The robot that it is taken for.
        seen: Name of a table of motion capture beside it, and its poses.

    Raises:
        BadInputError: It is a log of another robot, or of no protocol, or holds no whole step, or
            the table has no whole cycle of a walk in it.
    """
    with LogReader(path) as log:
        logged = log.header.robot
        _require_same(path, logged, robot)
        period = log.header.params.period
        protocol = protocol_of(log)
        planned = [step.called for step in protocol.steps]
        ticks = {tick.number: tick for tick in log}
    found = {step.name: step for step in steps(path) if step.whole}
    missing = [name for name in planned if name not in found]
    left_out = dict.fromkeys(missing, "the log does not hold it to its end")
    courses = []
    for step in found.values():
        if step.place == "hand":
            left_out[step.name] = "what a hand did is not in the log"
            continue
        own = [ticks[n] for n in range(step.begin, step.end) if n in ticks]
        course, why = _course(step, own, robot, period, protocol.hook, seen and seen[1])
        if course is None:
            left_out[step.name] = why
        else:
            courses.append(course)
    if not courses:
        raise BadInputError(
            f"{path}: expected whole steps with measured positions, found none of {len(planned)}"
        )
    within = [
        [ticks[n] for n in range(step.begin, step.end) if n in ticks] for step in found.values()
    ]
    warnings = _drift(within, period) + _odd_joints(robot, courses)
    warnings += [
        f"the log is of a robot with {name} {theirs:g}, --robot has {ours:g}: another robot?"
        for name in _SIZES
        if (theirs := getattr(logged, name)) != (ours := getattr(robot, name))
    ]
    warnings += _unseen(path, *seen, courses) if seen else []
    if missing:
        warnings.append(
            f"{len(missing)} of {len(planned)} steps of the protocol are missing, from "
            f"{missing[0]} on; give the folder to `drive --protocol` again to record them"
        )
    zero = _gyro_zero(courses)
    courses = [replace(course, gyro=course.gyro - zero) for course in courses]
    return Recording(path.stem, log_hash(path), courses, zero, left_out, warnings)


def _unseen(path: Path, table: str, poses: Poses, courses: list[Course]) -> list[str]:
    """What is unusual about a table, and cycles with gaps in it; refused if there are no others."""
    rows = [row for course in courses for row in measures.strides(course)[:, 0].tolist()]
    gaps = sum(map(math.isnan, rows))
    if gaps == len(rows):
        raise BadInputError(
            f"{table}: expected poses over a cycle of a walk on the floor of {path}, found none"
            f"{f' in {gaps} cycles' if gaps else ', as the log has no walk'}"
        )
    told = [f"{table}: {text}" for text in poses.warnings()]
    named = f"{table}: {gaps} of {len(rows)} cycles of walks have a gap, and are left out"
    return told + [named] * bool(gaps)


def _odd_joints(robot: RobotSpec, courses: list[Course]) -> list[str]:
    """Legs and antenna bases that follow unlike the others, each alone in the air."""
    told = []
    for group in ("legs", "antennae"):
        names = robot.joint_names[robot.places(group)]
        alone = [course for course in courses if course.hanging and len(moving(course)) == 1]
        lags = {robot.joint_names[moving(c)[0]]: float(measures.lags(c)[0]) for c in alone}
        own = {name: lag for name, lag in lags.items() if name in names}
        usual = float(np.median(list(own.values()))) if own else 0.0
        told += [
            f"{name} follows {1e3 * lag:.0f} ms late, other {group} {1e3 * usual:.0f} ms: a servo "
            "of another model, or a damaged one?"
            for name, lag in own.items()
            if abs(lag - usual) > (ODD - 1.0) * abs(min(lag, usual)) + _MUCH
        ]
    return told


def _gyro_zero(courses: list[Course]) -> Floats:
    """Zero of the gyroscope, from steps in the air and from standing; 0 if there are none."""
    still = [course.gyro.mean(axis=0) for course in courses if not course.cycle]
    return np.median(still, axis=0) if still else np.zeros(courses[0].gyro.shape[1])


def _require_same(path: Path, logged: RobotSpec, robot: RobotSpec) -> None:
    """Refuse the log of a robot with other joints or servos, or another inertial sensor."""
    for name in _PARTS:
        ours, theirs = getattr(robot, name), getattr(logged, name)
        if ours != theirs:
            raise BadInputError(
                f"{path}: expected the robot of the file with {name} {_shown(ours, theirs)}, found "
                f"{_shown(theirs, ours)}; give the file of the robot that was driven"
            )
    if logged.has_imu and not robot.has_imu:
        raise BadInputError(
            f"{path}: the log has an inertial sensor, the robot file none: set imu in it"
        )
    if robot.has_imu and not logged.has_imu:
        raise BadInputError(
            f"{path}: the robot file has an inertial sensor, the log none: take imu out of it"
        )


def _shown(value: object, other: object) -> str:
    """A value; of a list the first entry that the other list has not."""
    if not isinstance(value, tuple) or not isinstance(other, tuple):
        return str(value)
    pairs = zip(value, [*other, *[None] * len(value)], strict=False)
    return next((str(own) for own, theirs in pairs if own != theirs), f"of {len(value)} joints")


def _course(
    step: LoggedStep,
    ticks: list[Tick],
    robot: RobotSpec,
    period: float,
    hook: HookParams,
    poses: Poses | None,
) -> tuple[Course | None, str]:
    """A step on the grid of the control period, or why there is none."""
    if len(ticks) < FEWEST:
        return None, f"it has {len(ticks)} ticks, fewer than {FEWEST}"
    now = np.array([tick.now for tick in ticks])
    positions = np.array([tick.positions for tick in ticks])
    commands = np.array([tick.angles for tick in ticks])
    if positions.ndim < 2 or not positions.shape[1]:
        return None, "no positions were measured"
    known = float(np.isfinite(positions).mean(axis=0).min())
    if known < 1.0 - _LOST or not np.isfinite(commands).all():
        return None, f"positions of a joint are missing in {1.0 - known:.0%} of its ticks"
    grid = np.arange(round((now[-1] - now[0]) / period) + 1) * period + now[0]
    held = np.clip(np.searchsorted(now, grid + period / 2) - 1, 0, None)
    felt = [np.array([getattr(t, what) for t in ticks]) for what in ("angular_velocity", "reading")]
    walks = step.place == "floor" and step.step.maneuver != "HOLD"
    return (
        Course(
            name=step.name,
            hook=hook if step.place == "hanging" else None,
            period=period,
            cycle=1.0 / step.step.frequency if walks else 0.0,
            commands=commands[held],
            positions=_between(grid, now, positions),
            gyro=_between(grid, now, felt[0].reshape(len(ticks), -1)),
            counts=_between(grid, now, felt[1])[:, : robot.antenna_count],
            poses=poses.at(grid) if poses and walks else None,
        ),
        "",
    )


def _between(grid: Floats, now: Floats, values: Floats) -> Floats:
    """Values (n, k) at the times of a grid; those that are not known are taken from the others."""
    columns = [np.full(len(grid), np.nan) for _ in range(values.shape[1])]
    for at, column in enumerate(values.T):
        known = np.isfinite(column)
        if known.sum() > FEWEST // 2:
            columns[at] = np.interp(grid, now[known], column[known])
    return np.array(columns).T.reshape(len(grid), values.shape[1])


def _drift(steps_of: list[list[Tick]], period: float) -> list[str]:
    """What the clocks say of one another, by their paces in the steps of a log."""
    paces, lasting = [], []
    for ticks in steps_of:
        now, board = (np.array([getattr(tick, name) for tick in ticks]) for name in ("now", "t"))
        known = np.isfinite(board)
        lasting += np.diff(now).tolist()
        if known.sum() > FEWEST:
            paces.append(np.polyfit(now[known] - now[0], board[known] - board[known][0], 1)[0])
    told = []
    fast = float(np.median(paces)) - 1.0 if paces else 0.0
    if abs(fast) > DRIFT:
        told.append(
            f"the clock of the antenna board runs {100 * fast:+.1f} % against that of the loop: "
            "speeds and gyroscope are wrong by as much"
        )
    tick = float(np.median(lasting)) if lasting else period
    if abs(tick / period - 1.0) > DRIFT:
        told.append(
            f"a tick lasts {1e3 * tick:.3f} ms, the control period is {1e3 * period:g} ms: the "
            f"clock of the loop runs {100 * (tick / period - 1.0):+.1f} %, or the loop was late"
        )
    return told
