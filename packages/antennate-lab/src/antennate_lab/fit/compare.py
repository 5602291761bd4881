"""A short log of a protocol beside a fitted robot: whether each joint behaves as fitted.

Each joint that is swept alone in the air is fitted by itself, from the fitted robot on
(`least_squares`). It has changed if one of its numbers is out of its range: the interval of the
robot's file, wider by what the sweep leaves open and by what joints of one model differ, `ALIKE`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from antennate.errors import BadInputError
from antennate.hardware.doctor.check import Row
from antennate.messages import typed
from antennate.robots.spec import Fitted, RobotSpec
from antennate.studies.pool import Workers, core_count, gather
from antennate.studies.trials import OnStep, no_step
from antennate_lab.fit import least_squares, measures, recording
from antennate_lab.fit.config import FitConfig
from antennate_lab.fit.estimates import SHORTEST, Estimate, of_air
from antennate_lab.fit.parameters import BACKLASH, parameters
from antennate_lab.fit.residuals import moving
from antennate_lab.fit.simulated import Course, simulated

ALIKE = {"lag": 5.0, "gain": 0.15, "friction": 0.02, "backlash": 0.3}
"""Differences that are none, between joints of one model and between two days [ms], [share of the
fitted gain], [N·m], [deg] (assumed)."""
_UNITS = {"lag": " ms", "gain": "", "friction": " N·m", "backlash": "°"}
_CAUSES = {
    "lag": "return delay, Profile Velocity and load",
    "gain": "Position P Gain, supply and model of the servo",
    "friction": "what rubs: horn, screws, cable",
    "backlash": "the horn, its screws and the gear",
}
_OF_SERVO = {"gain": "gain_divisor", "delay": "delay", "friction": "friction"}
_ROUNDS = 10


@dataclass(frozen=True)
class Compared:
    """One number of a joint.

    Attributes:
        name: Which one, a key of `ALIKE`, in its unit.
        low, high: Range in which it is as fitted.
        found: What the log says, None if it does not tell it.
    """

    name: str
    low: float
    high: float
    found: float | None

    @property
    def changed(self) -> bool:
        """Whether it is not as fitted."""
        return self.found is not None and not self.low <= self.found <= self.high

    def expected(self) -> str:
        """The range, in words."""
        return f"{self.name} {self.low:.3g} to {self.high:.3g}{_UNITS[self.name]}"

    def said(self) -> str:
        """What was found, in words."""
        what = "not told" if self.found is None else f"{self.found:.3g}{_UNITS[self.name]}"
        return f"{self.name} {what}"


def rows(file: Path, log: Path, on_step: OnStep = no_step) -> list[Row]:
    """A row for each joint that is swept alone, and one for the log.

    Args:
        file: The fitted robot, as `antennate fit` writes it.
        log: The log of a protocol, of that robot.
        on_step: Told of each joint.

    Raises:
        BadInputError: The file has no intervals of servos, or the log is that of another robot or
            sweeps no joint alone.
    """
    robot = FitConfig(log=(str(log),), robot=str(file)).described
    if not any(each.name.startswith("servos.") for each in robot.fitted):
        raise BadInputError(
            f"{file}: expected intervals of servos, tables [[fitted]] as `{typed('fit')}` writes "
            f"them, found {'none' if not robot.fitted else robot.fitted[0].name + ' and the like'}"
        )
    read = recording.read(log, robot)
    alone = [c for c in read.courses if c.hanging and len(moving(c)) == 1]
    if not alone:
        raise BadInputError(
            f"{log}: expected steps that sweep one joint in the air, found none; "
            f"`{typed('drive')} --protocol check` records them"
        )
    tasks = [(robot, course) for course in alone]
    found = gather(_joint, tasks, Workers(min(core_count(), len(tasks))), on_step)
    names = [robot.joint_names[int(moving(course)[0])] for course in alone]
    missed = [name for name in robot.joint_names if name not in names]
    wrong = [*read.warnings, *([f"no sweep of {', '.join(missed)}"] if missed else [])]
    grade, cure = ("warn", "record it again") if wrong else ("ok", "")
    whole = Row("log", log.name, "all joints, whole", "; ".join(wrong) or "whole", grade, cure)
    return [whole, *map(_row, names, found)]


def _row(name: str, numbers: list[Compared]) -> Row:
    changed = [each.name for each in numbers if each.changed]
    unknown = [each.name for each in numbers if each.found is None]
    cure = f"{' and '.join(changed)} not as fitted: look at {_causes(changed)}" if changed else ""
    if unknown and not changed:
        cure = (
            f"the log does not tell {' and '.join(unknown)}: record it again, other programs ended"
        )
    return Row(
        part="joint",
        check=name,
        expected=", ".join(each.expected() for each in numbers),
        found=", ".join(each.said() for each in numbers),
        grade="warn" if changed else "note" if unknown else "ok",
        cure=cure,
    )


def _causes(changed: list[str]) -> str:
    return "; ".join(_CAUSES[each] for each in changed)


def _joint(robot: RobotSpec, course: Course) -> list[Compared]:
    """The numbers of the joint that moves in a course, as fitted and as they are."""
    place = int(moving(course)[0])
    servo, name = robot.servo_names[place], robot.joint_names[place]
    known = {each.name: each for each in robot.fitted}
    paths = {kind: f"servos.{servo}.{key}" for kind, key in _OF_SERVO.items()}
    free: list[tuple[str, int | None]] = [(paths["gain"], None), (paths["delay"], None)]
    free += [(paths["friction"], None)] if paths["friction"] in known else []
    if name in robot.yaw_names and course.gyro.size:
        free.append((BACKLASH, robot.yaw_names.index(name)))
    problem = least_squares.Problem(robot, [course], parameters(robot, free), Workers(1))
    solution = least_squares.solve(problem, problem.start, _ROUNDS)
    errors = least_squares.covariances(problem, solution, np.random.default_rng(0))
    estimates = {each.parameter.path: each for each in of_air(problem, solution, *errors)}
    lag = _lag(robot, course, known.get(paths["gain"]), known.get(paths["delay"]))
    return [lag, *_compared(estimates, known, paths)]


def _lag(robot: RobotSpec, course: Course, gain: Fitted | None, delay: Fitted | None) -> Compared:
    """The time by which a joint is late: what the drive takes goes with 1 / gain, then a delay."""
    measured, fitted = (
        float(measures.lags(each)[0]) for each in (course, simulated(robot, course))
    )
    servo = robot.servos.of(robot.servo_names[int(moving(course)[0])])
    drive = fitted - servo.delay
    late = (0.0, SHORTEST) if delay is None else (delay.low - servo.delay, delay.high - servo.delay)
    ends = (
        (1.0, 1.0)
        if gain is None
        else tuple(end / servo.gain_divisor for end in (gain.low, gain.high))
    )
    low, high = (
        1e3 * (fitted + drive * (share - 1.0) + more)
        for share, more in zip(ends, late, strict=True)
    )
    return Compared("lag", low - ALIKE["lag"], high + ALIKE["lag"], 1e3 * measured)


def _compared(
    estimates: dict[str, Estimate], known: dict[str, Fitted], paths: dict[str, str]
) -> Iterator[Compared]:
    """Estimates of a joint beside the intervals of the file, where it has one."""
    for path, each in estimates.items():
        fitted = known.get(each.parameter.name)
        kind = "backlash" if path == BACKLASH else next(k for k, p in paths.items() if p == path)
        if fitted is None or kind not in ALIKE:
            continue
        start = each.parameter.start
        if kind == "gain":
            numbers = [start / x for x in (fitted.low, fitted.high, *each.interval, each.value)]
        else:
            factor = float(np.degrees(1.0)) if kind == "backlash" else 1.0
            numbers = [factor * x for x in (fitted.low, fitted.high, *each.interval, each.value)]
        ends, own, found = sorted(numbers[:2]), abs(numbers[3] - numbers[2]) / 2, numbers[4]
        wider = ALIKE[kind] + own
        low, high = max(ends[0] - wider, 0.0), ends[1] + wider
        yield Compared(kind, low, high, found if each.told else None)
