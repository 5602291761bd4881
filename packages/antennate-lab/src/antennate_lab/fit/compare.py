"""A short log of a protocol beside a fitted robot: whether each joint behaves as fitted.

Each joint that is swept alone in the air is fitted by itself, from the fitted robot on
(`least_squares`). It has changed if one of its numbers is out of its range: the interval of the
robot's file, wider by what the sweep leaves open and by what joints of one model differ, `ALIKE`.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from antennate.errors import BadInputError
from antennate.messages import typed
from antennate.robots.spec import Fitted, RobotSpec
from antennate.studies.pool import Workers, core_count, gather
from antennate.studies.trials import OnStep, no_step
from antennate_lab.fit import least_squares, recording
from antennate_lab.fit.config import FitConfig
from antennate_lab.fit.estimates import SHORTEST, Estimate, of_air
from antennate_lab.fit.parameters import BACKLASH, parameters
from antennate_lab.fit.residuals import moving
from antennate_lab.fit.simulated import Course

ALIKE = {"lag": 5.0, "gain": 0.15, "friction": 0.02, "backlash": 0.3}
"""Differences that are none, between joints of one model and between two days [ms], [share of the
fitted gain], [N·m], [deg] (assumed). The lag is the time from a goal to the drive that follows."""
_UNITS = {"lag": " ms", "gain": "", "friction": " N·m", "backlash": "°"}
_CAUSES = {
    "lag": "return delay, Profile Velocity and load",
    "gain": "Position P Gain, supply and model of the servo",
    "friction": "what rubs: horn, screws, cable",
    "backlash": "the horn, its screws and the gear",
}
_OF_SERVO = {"lag": "delay", "gain": "gain_divisor", "friction": "friction"}
_FACTORS = {"lag": 1e3, "friction": 1.0, "backlash": float(np.degrees(1.0))}
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
        return f"{self.name} {self.low:.2g} to {self.high:.2g}{_UNITS[self.name]}"

    def said(self) -> str:
        """What was found, in words."""
        what = "not told" if self.found is None else f"{self.found:.2g}{_UNITS[self.name]}"
        return f"{self.name} {what}"


@dataclass(frozen=True)
class Row:
    """A row of the doctor's table: `antennate.hardware.doctor.check.Row` has the same fields.

    Attributes:
        part: "log" or "joint".
        grade: "ok"; "note", a number is not told; "warn", it is not as fitted.
    """

    part: str
    check: str
    expected: str
    found: str
    grade: Literal["ok", "note", "warn"]
    cure: str


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
    free: dict[str, tuple[str, int | None]] = {
        kind: (f"servos.{servo}.{path}", None) for kind, path in _OF_SERVO.items()
    }
    if free["friction"][0] not in known:
        free.pop("friction")
    if name in robot.yaw_names and course.gyro.size:
        free["backlash"] = (BACKLASH, robot.yaw_names.index(name))
    problem = least_squares.Problem(robot, [course], parameters(robot, free.values()), Workers(1))
    solution = least_squares.solve(problem, problem.start, _ROUNDS)
    errors = least_squares.covariances(problem, solution, np.random.default_rng(0))
    found = zip(free, of_air(problem, solution, *errors), strict=True)
    beside = [_compared(kind, each, known.get(each.parameter.name)) for kind, each in found]
    return [each for each in beside if each is not None]


def _compared(kind: str, each: Estimate, fitted: Fitted | None) -> Compared | None:
    """An estimate beside the interval of the file; None where it has none.

    A delay that no log told is the one of the file, within a timestep.
    """
    start = each.parameter.start
    if fitted is None and kind == "lag":
        fitted = Fitted(low=start, high=start + SHORTEST)
    if fitted is None:
        return None
    shown = [
        start / x if kind == "gain" else _FACTORS[kind] * x
        for x in (fitted.low, fitted.high, *each.interval, each.value)
    ]
    wider = ALIKE[kind] + abs(shown[3] - shown[2]) / 2
    low, high = sorted(shown[:2])
    return Compared(kind, max(low - wider, 0.0), high + wider, shown[4] if each.told else None)
