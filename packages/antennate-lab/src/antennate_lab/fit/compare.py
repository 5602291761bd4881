"""A short log of a protocol beside a fitted robot: whether each joint behaves as fitted.

Each joint that is swept alone in the air is fitted by itself, from the fitted robot on
(`least_squares`). It has changed if one of its numbers is out of its range: the interval of the
robot's file, wider by what the sweep leaves open and by a margin, `ALIKE`. It is as fitted if all
of its numbers have an interval and are in their ranges.
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
from antennate_lab.fit.estimates import Estimate, of_air
from antennate_lab.fit.parameters import BACKLASH, parameters
from antennate_lab.fit.residuals import moving
from antennate_lab.fit.simulated import Course

ALIKE = {"lag": 5.0, "gain": 0.15, "friction": 0.02, "backlash": 0.3}
"""Margins on both sides of the interval of the file [ms], [share of the fitted gain], [N·m], [deg]
(assumed; misses were not counted, false alarms in docs/fit.md). The lag is the time from a goal to
the drive that follows it."""
_UNITS = {"lag": " ms", "gain": "", "friction": " N·m", "backlash": "°"}
_CAUSES = {
    "lag": "return delay, Profile Velocity and load",
    "gain": "Position P Gain, supply and model of the servo",
    "friction": "what rubs: horn, screws, cable",
    "backlash": "the horn, its screws and the gear",
}
_OF_SERVO = {"lag": "delay", "gain": "gain_divisor", "friction": "friction"}
_FACTORS = {"lag": 1e3, "friction": 1.0, "backlash": float(np.degrees(1.0))}


@dataclass(frozen=True)
class Compared:
    """One number of a joint.

    Attributes:
        name: Which one, a key of `ALIKE`, in its unit.
        ends: Range in which it is as fitted, None if the file has no interval.
        found: What the log says, None if it does not tell it.
    """

    name: str
    ends: tuple[float, float] | None
    found: float | None

    @property
    def changed(self) -> bool:
        """Whether it is not as fitted."""
        if self.ends is None or self.found is None:
            return False
        return not self.ends[0] <= self.found <= self.ends[1]

    def expected(self) -> str:
        """The range, in words."""
        if self.ends is None:
            return f"{self.name}: not in the file"
        return f"{self.name} {self.ends[0]:.2g} to {self.ends[1]:.2g}{_UNITS[self.name]}"

    def said(self) -> str:
        """What was found, in words."""
        what = "not told" if self.found is None else f"{self.found:.2g}{_UNITS[self.name]}"
        return f"{self.name} {what}"


@dataclass(frozen=True)
class Row:
    """A row of the doctor's table: `antennate.hardware.doctor.check.Row` has the same fields.

    Attributes:
        part: "log" or "joint".
        grade: "ok"; "note", a number is not told or not in the file, or the joint was not swept;
            "warn", it is not as fitted.
    """

    part: str
    check: str
    expected: str
    found: str
    grade: Literal["ok", "note", "warn"]
    cure: str


def rows(file: Path, log: Path, on_step: OnStep = no_step) -> list[Row]:
    """A row for the log, and one for each joint of the robot.

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
    swept = dict(zip(names, found, strict=True))
    grade, cure = ("warn", "record it again") if read.warnings else ("ok", "")
    wrong = "; ".join(read.warnings) or "whole"
    whole = Row("log", log.name, "whole", wrong, grade, cure)
    return [whole, *(_row(name, swept.get(name)) for name in robot.joint_names)]


def _row(name: str, numbers: list[Compared] | None) -> Row:
    """The row of a joint, None of one that was not swept."""
    if numbers is None:
        cure = f"not compared: `{typed('drive')} --protocol check` sweeps it"
        return Row("joint", name, "a sweep of it alone in the air", "none", "note", cure)
    held = [each for each in numbers if each.ends is not None]
    changed = [each.name for each in held if each.changed]
    unknown = [each.name for each in held if each.found is None]
    absent = [each.name for each in numbers if each.ends is None]
    cures = [f"{' and '.join(changed)} not as fitted: look at {_causes(changed)}"] * bool(changed)
    if unknown:
        cures.append(f"the log does not tell {' and '.join(unknown)}: record longer sweeps")
    if absent:
        cures.append(f"{' and '.join(absent)}: not in the file: fit a log that tells it")
    return Row(
        part="joint",
        check=name,
        expected=", ".join(each.expected() for each in numbers),
        found=", ".join(each.said() for each in held) or "not compared",
        grade="warn" if changed else "note" if cures else "ok",
        cure="; ".join(cures),
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
    absent = []
    if free["friction"][0] not in known:
        free.pop("friction")
        absent = [Compared("friction", None, None)]
    if name in robot.yaw_names and course.gyro.size:
        free["backlash"] = (BACKLASH, robot.yaw_names.index(name))
    problem = least_squares.Problem(robot, [course], parameters(robot, free.values()), Workers(1))
    if not any(each.name in known for each in problem.chosen):
        return [Compared(kind, None, None) for kind in free] + absent
    solution = least_squares.solve(problem, problem.start)
    errors = least_squares.covariances(problem, solution, np.random.default_rng(0))
    found = zip(free, of_air(problem, solution, *errors), strict=True)
    return [_compared(kind, each, known.get(each.parameter.name)) for kind, each in found] + absent


def _compared(kind: str, each: Estimate, fitted: Fitted | None) -> Compared:
    """An estimate beside the interval of the file."""
    if fitted is None:
        return Compared(kind, None, None)
    shown = [
        each.parameter.start / x if kind == "gain" else _FACTORS[kind] * x
        for x in (fitted.low, fitted.high, *each.interval, each.value)
    ]
    wider = ALIKE[kind] + abs(shown[3] - shown[2]) / 2
    low, high = sorted(shown[:2])
    ends = (max(low - wider, 0.0), high + wider)
    return Compared(kind, ends, shown[4] if each.told else None)
