"""A check: what is measured, what would be good, and the cure. The rows of the doctor's tables."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass
from itertools import groupby
from typing import Generic, Literal, NamedTuple, TypeVar

from antennate.hardware.doctor.config import DoctorConfig
from antennate.hardware.ports.port import Port

Grade = Literal["ok", "warn", "bad"]
Opener = Callable[[int], AbstractContextManager[Port]]
"""Opens a port at a number of bits per second for as long as the context lasts; PortError."""
Survey = TypeVar("Survey")
Item = TypeVar("Item")


@dataclass(frozen=True, slots=True)
class Row:
    """The result of one check.

    Attributes:
        part: "bus" or "esp32".
        check: Name of the check.
        expected: What would be good.
        found: What was found.
        grade: "ok"; "warn", the robot may walk but not well; "bad", it must not.
        cure: What to do, empty if all is well.
    """

    part: str
    check: str
    expected: str
    found: str
    grade: Grade
    cure: str = ""


class Finding(NamedTuple):
    """What a check found; the cure is shown only if the grade is not "ok"."""

    found: str
    grade: Grade = "ok"
    cure: str = ""

    def row(self, part: str, check: str, expected: str) -> Row:
        """The result of the check that found this."""
        cure = "" if self.grade == "ok" else self.cure
        return Row(part, check, expected, self.found, self.grade, cure)


@dataclass(frozen=True, slots=True)
class Check(Generic[Survey]):
    """One check of what a survey has found.

    Attributes:
        name: Its name.
        expected: What would be good.
        measure: The finding in a survey, for a robot.
    """

    name: str
    expected: Callable[[Survey, DoctorConfig], str] | str
    measure: Callable[[Survey, DoctorConfig], Finding]

    def row(self, part: str, survey: Survey, robot: DoctorConfig) -> Row:
        """The result."""
        expected = self.expected if isinstance(self.expected, str) else self.expected(survey, robot)
        return self.measure(survey, robot).row(part, self.name, expected)


def worst(grades: Iterable[Grade]) -> Grade:
    """The worst grade; "ok" of none."""
    found = set(grades)
    return "bad" if "bad" in found else "warn" if "warn" in found else "ok"


def ids_text(ids: Iterable[int]) -> str:
    """Ids with runs of three and more drawn together: `1-5, 7, 9, 10`."""
    texts: list[str] = []
    for _, run in groupby(enumerate(sorted(ids)), key=lambda pair: pair[1] - pair[0]):
        names = [servo for _, servo in run]
        texts += map(str, names) if len(names) < 3 else [f"{names[0]}-{names[-1]}"]
    return ", ".join(texts)


def grouped(values: Mapping[int, Item], text: Callable[[Item], str] = str) -> str:
    """Values by id, equal ones once: `0 (1-6, 8-19), 250 (7)`; `0` if all are equal."""
    groups: dict[str, list[int]] = {}
    for servo, value in values.items():
        groups.setdefault(text(value), []).append(servo)
    if len(groups) < 2:
        return next(iter(groups), "-")
    common = sorted(groups.items(), key=lambda item: (-len(item[1]), item[0]))
    return ", ".join(f"{value} ({ids_text(ids)})" for value, ids in common)
