"""One line of an examination, and how numbers of many servos are said in few words."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass
from itertools import groupby
from typing import Literal, TypeVar

from antennate.hardware.ports.port import Port

Verdict = Literal["ok", "warn", "bad"]
Opener = Callable[[int], AbstractContextManager[Port]]
"""Opens a port at a number of bits per second for as long as the context lasts; PortError."""


@dataclass(frozen=True, slots=True)
class Row:
    """One check.

    Attributes:
        part: "bus" or "esp32".
        check: What was looked at.
        expected: What would be good.
        found: What was found.
        verdict: "ok"; "warn", it may walk but not well; "bad", it must not.
        cure: What to do, empty if all is well.
    """

    part: str
    check: str
    expected: str
    found: str
    verdict: Verdict
    cure: str = ""


def row(
    part: str, check: str, expected: str, found: str, verdict: Verdict | None, cure: str
) -> Row:
    """A row whose cure is left out if all is well; a verdict of None is "ok"."""
    if verdict is None or verdict == "ok":
        return Row(part, check, expected, found, "ok")
    return Row(part, check, expected, found, verdict, cure)


def worst(rows: Iterable[Row]) -> Verdict:
    """The worst verdict; "ok" of no rows."""
    found = {one.verdict for one in rows}
    return "bad" if "bad" in found else "warn" if "warn" in found else "ok"


def ids_text(ids: Iterable[int]) -> str:
    """Ids with runs of three and more drawn together: `1-5, 7, 9, 10`."""
    said: list[str] = []
    for _, run in groupby(enumerate(sorted(ids)), key=lambda pair: pair[1] - pair[0]):
        names = [servo for _, servo in run]
        short = len(names) < 3
        said += map(str, names) if short else [f"{names[0]}-{names[-1]}"]
    return ", ".join(said)


Item = TypeVar("Item")


def grouped(values: Mapping[int, Item], text: Callable[[Item], str] = str) -> str:
    """Values by id, equal ones said once: `0 (1-6, 8-19), 250 (7)`; `0` if all are equal."""
    said: dict[str, list[int]] = {}
    for servo, value in values.items():
        said.setdefault(text(value), []).append(servo)
    if len(said) < 2:
        return next(iter(said), "-")
    common = sorted(said.items(), key=lambda item: (-len(item[1]), item[0]))
    return ", ".join(f"{value} ({ids_text(ids)})" for value, ids in common)
