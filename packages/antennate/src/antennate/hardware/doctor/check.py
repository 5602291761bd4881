"""Rows of the doctor's table, and those about the ports themselves."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Callable, Iterable, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import Literal, NamedTuple, TypeVar

from antennate.hardware.esp32.board import BOARD_BAUD
from antennate.hardware.ports.errors import OpenError, holders
from antennate.hardware.ports.finder import finder
from antennate.params.hardware import DoctorParams, NetworkParams
from dynamixel_bus.port import Port

Grade = Literal["ok", "note", "warn", "bad"]
Opener = Callable[[int], AbstractContextManager[Port]]
"""Opens a port at a number of bits per second for as long as the context lasts; PortError."""
Item = TypeVar("Item")


@dataclass(frozen=True, slots=True)
class Row:
    """The result of one check.

    Attributes:
        part: "robot", "bus" or "esp32"; "log" or "joint" of a comparison.
        grade: "ok"; "note", a number is assumed; "warn", the robot may walk but not well; "bad",
            it must not.
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
    """The worst grade; "ok" of none, and of notes."""
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


_TIMERS = Path("/sys/bus/usb-serial/devices")
_TERMINALS = Path("/dev/pts")
"""Where the twin's ports are."""
_USUAL_NAME = "ttyUSB0"


def opener_of(
    path: str, flag: str, key: bytes | None = None, network: NetworkParams | None = None
) -> Opener:
    """Opens a port at any speed; `key` and `network` are those of a board behind udp://."""
    return lambda baud: contextlib.closing(finder(path, baud, flag, key, network)())


def port_row(part: str, path: str, opener: Opener, baud: int = BOARD_BAUD) -> Row:
    """Whether a port is there, may be opened, and is used by no other program."""
    try:
        with opener(baud):
            others = ", ".join(holders(path))
        cure = "end that program: two readers take each other's bytes"
        finding = Finding(f"{path}, in use by {others}", "warn", cure) if others else Finding(path)
    except OpenError as error:
        finding = Finding(f"{path}: {error.found}", "bad", error.cure)
    return finding.row(part, "port", "opens, used by no other program")


def latency_row(path: str, slow: bool, params: DoctorParams, timers: Path = _TIMERS) -> Row:
    """The latency timer of the bus's adapter; `slow` if all answers were measured to come late."""
    most, name = params.latency_timer, Path(os.path.realpath(path)).name
    file = timers / name / "latency_timer"
    value = None
    with contextlib.suppress(OSError, ValueError):
        value = int(file.read_text())
    if value is None and not name.startswith("tty"):
        file = timers / _USUAL_NAME / "latency_timer"
    set_it = (
        f"run `echo {most} | sudo tee {file}`, or `setserial {path} low_latency`; again after "
        "every plug-in"
    )
    if Path(os.path.realpath(path)).parent == _TERMINALS:
        cure = "if a twin is there, the computer is too busy: end other programs"
    elif value is None:
        cure = f"if it is an FTDI adapter (U2D2), {set_it}; else use one"
    elif value > most:
        cure = set_it
    else:
        cure = "not the timer: plug the adapter into the computer itself, end busy programs"
    shown = "none is shown" if value is None else f"{value} ms"
    late = ", and answers come late" if slow else ""
    high = value is not None and value > most
    finding = Finding(shown + late, "bad" if high or slow else "ok", cure)
    return finding.row("bus", "latency timer", f"at most {most} ms")


def same(path: str, other: str) -> bool:
    """Whether two paths are one device."""
    return os.path.realpath(path) == os.path.realpath(other)
