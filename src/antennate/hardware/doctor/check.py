"""Rows of the doctor's table: what was found, what would be good, and the cure."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass
from itertools import groupby
from typing import Literal, NamedTuple, TypeVar

from antennate.port import Port

Grade = Literal["ok", "warn", "bad"]
Opener = Callable[[int], AbstractContextManager[Port]]
"""Opens a port at a number of bits per second for as long as the context lasts; PortError."""
Item = TypeVar("Item")


@dataclass(frozen=True, slots=True)
class Row:
    """The result of one check.

    Attributes:
        part: "bus" or "esp32".
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


def worst(grades: Iterable[Grade]) -> Grade:
    """The worst grade; "ok" of none."""
    seen = set(grades)
    return "bad" if "bad" in seen else "warn" if "warn" in seen else "ok"


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
