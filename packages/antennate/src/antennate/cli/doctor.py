"""`antennate doctor`: what is wrong with the real robot, or its twin, and the cure."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import asdict
from pathlib import Path
from typing import Any

from pydantic.dataclasses import dataclass

from antennate.cli.options import option
from antennate.cli.results import ResultOptions, folder_for
from antennate.cli.robot import USUAL, PortOptions, at_hand, key_of, parse_robot, require_two_ports
from antennate.cli.terminal import (
    BAD_INPUT,
    OK,
    console,
    progress,
    stop_signals,
    write_result,
)
from antennate.errors import ConfigError, MissingPackageError
from antennate.hardware.config import DoctorConfig
from antennate.hardware.doctor.check import Opener, Row, opener_of
from antennate.hardware.doctor.checkup import Checkup, examine
from antennate.hardware.doctor.fix import Change, apply, plan
from antennate.hardware.setup.zeros import forgotten
from antennate.host import HostClock
from antennate.lookup import installed
from antennate.messages import INSTALLATION, one_line, typed
from antennate.studies.formats import to_json
from antennate.studies.report import View
from antennate.studies.run_files import log_of
from antennate.studies.tables import Table

DESCRIPTION = """\
Examine the antenna board and the servo bus of a robot at rest, or of its twin: one line for each
check, with the cure for what is not good. Torque never comes on. Either port may be left out.

Nothing is written without --fix, which asks before each change of an id, a speed, an
operating mode or a return delay, and reads it back. The exit code is 2 if anything is bad.

--compare FILE LOG looks whether each joint still behaves as fitted, after a repair for example:
FILE is the robot of `antennate fit`, LOG what `antennate drive --protocol check` has recorded. A
joint whose lag, gain, friction or backlash is out of its range warns. No port is needed."""
_STYLES = {"ok": "green", "note": "cyan", "warn": "yellow", "bad": "bold red"}
_LOGGED = ("log", "joint")
"""Parts of the rows of --compare."""
_RECORD = f"`{typed('drive')} --protocol check` records one"
_ROUNDS = 4
"""Servos that change their id or speed are looked at anew before the rest is put right."""


@dataclass(frozen=True)
class DoctorOptions(ResultOptions, PortOptions):
    """What to do about it."""

    fix: bool = option(False, "put right what can be, asking before each change")
    yes: bool = option(False, "answer yes to all that --fix asks", needs=["--fix"])
    out: Path | None = option(None, "folder for result.json; none if not given", "FOLDER")
    compare: Path | None = option(None, "robot that was fitted; LOG is held against it", "FILE")
    log: Path | None = option(
        None,
        "log of a protocol, or the folder of its drive",
        "RUN|LOG",
        ["--compare"],
        positional=True,
        optional=True,
    )


def command(argv: Sequence[str]) -> int:
    """Examine, put right what was asked for, and tell."""
    config, options = parse_robot("doctor", DESCRIPTION, DoctorConfig, argv, DoctorOptions)
    if options.compare and not options.log:
        raise ConfigError(f"--compare: expected FILE and LOG, found no log; {_RECORD}")
    if not (options.esp32 or options.bus or options.compare):
        raise ConfigError(
            f"expected --esp32 PORT, --bus PORT or both, found none{at_hand(options)}"
        )
    require_two_ports(options)
    if options.fix and not options.bus:
        raise ConfigError("--fix: expected --bus PORT with it, found none")
    if options.fix and not options.yes and not sys.stdin.isatty():
        raise ConfigError("--fix: expected a terminal to ask on, found none; or give --yes")
    robot = config.calibrated()
    key = key_of(options)
    with folder_for(VIEW, options, config, argv) if options.out else nullcontext() as folder:
        checkup, changes = _examine(robot, options, key)
        if options.compare and options.log:
            checkup.rows += _compared(options.compare, log_of(options.log, _RECORD))
        result = checkup.result(changes)
        if folder is not None:
            folder.finish(result)
        if options.json:
            write_result(to_json(result))
        else:
            _show(checkup.rows, checkup.walks)
    return BAD_INPUT if checkup.grade == "bad" else OK


def _examine(
    robot: DoctorConfig, options: DoctorOptions, key: bytes | None
) -> tuple[Checkup, list[str]]:
    """The examination, the last one if something was changed, and the changes."""
    bus = esp32 = None
    if options.bus:
        bus = (options.bus, opener_of(options.bus, "--bus"))
    if options.esp32:
        esp32 = (options.esp32, opener_of(options.esp32, "--esp32", key, robot.network))
    now = HostClock().now
    with stop_signals():
        checkup = examine(robot, bus, esp32, now)
        if not options.fix or bus is None:
            return checkup, []
        sys.stderr.write("examined; now what can be put right\n")
        file = options.config or (USUAL if USUAL.exists() and not options.no_config else None)
        robot, changes = _fix(robot, bus, options.yes, now, checkup, file)
        if changes:
            checkup = examine(robot, bus, esp32, now)
        else:
            sys.stderr.write("nothing was changed\n")
    return checkup, changes


def _compared(file: Path, log: Path) -> list[Row]:
    """A row for each joint of a log, which the laboratory holds against a fitted robot."""
    points = list(installed("antennate.doctor"))
    if not points:
        raise MissingPackageError(
            "--compare: expected the package antennate-lab, which has fit, found none; install it "
            f"with {INSTALLATION}"
        )
    rows: Callable[..., list[Any]] = points[0].load()
    with stop_signals(), progress("joints") as step:
        return [Row(**asdict(row)) for row in rows(file, log, step)]


def _fix(
    robot: DoctorConfig,
    bus: tuple[str, Opener],
    yes: bool,
    now: Callable[[], float],
    checkup: Checkup,
    file: Path | None,
) -> tuple[DoctorConfig, list[str]]:
    """The robot after changes, and these; a servo with another id or speed is examined anew."""
    made: list[str] = []
    refused: set[Change] = set()
    for _ in range(_ROUNDS):
        if checkup.bus is None:
            break
        todo = [change for change in plan(checkup.bus, robot.robot) if change not in refused]
        if not todo:
            break
        for change in todo:
            if not _agreed(change, yes):
                refused.add(change)
                continue
            if change.unmeasured is not None:  # before a servo is changed, as by `setup`
                zeros = forgotten(robot.robot, robot.zeros, change.unmeasured, file)
                robot = robot.model_copy(update={"zeros": zeros})
            apply(bus[1], change, now)
            made.append(str(change))
            sys.stderr.write(f"changed, read back: {change}\n")
        checkup = examine(robot, bus, None, now)
    return robot, made


def _agreed(change: Change, yes: bool) -> bool:
    if yes:
        return True
    anew = "" if change.unmeasured is None else "; its zero is to be measured anew"
    sys.stderr.write(f"{change}{anew}; torque goes off first. Change it? [y/N] ")
    sys.stderr.flush()
    return sys.stdin.readline().strip().lower() in ("y", "yes")


def _show(rows: Sequence[Row], walks: bool) -> None:
    """Print one line for each row, then the cures."""
    from rich.box import SIMPLE_HEAD  # slow to import
    from rich.table import Table
    from rich.text import Text

    output, table = console(), Table(box=SIMPLE_HEAD, pad_edge=False)
    for head in ("", "check", "expected", "found"):
        table.add_column(head, overflow="fold", no_wrap=not head)
    for row in rows:
        grade = Text(row.grade, _STYLES[row.grade])
        words = (f"{row.part}: {row.check}", row.expected, row.found)
        table.add_row(grade, *(Text(one_line(word)) for word in words))
    output.print(table)
    wrong = [row for row in rows if row.grade != "ok"]
    for row in sorted(wrong, key=lambda row: ("bad", "warn", "note").index(row.grade)):
        line = Text.assemble(
            (f"{row.grade:<4} ", _STYLES[row.grade]),
            (f"{row.part}: {row.check}: ", "bold"),
            one_line(row.cure),
        )
        output.print(line, soft_wrap=True)
    sentence = Text(_sentence([(row.part, row.grade) for row in rows], walks))
    output.print(sentence, soft_wrap=not output.is_terminal)


def _sentence(rows: Sequence[tuple[str, str]], walks: bool) -> str:
    """What came out of checks, by part and grade, in a sentence on ports and one on joints."""
    grades = [grade for part, grade in rows if part not in _LOGGED]
    joints = [grade for part, grade in rows if part == "joint"]
    said = [_driven(grades, walks)] if grades else []
    if joints:
        fitted, changed = joints.count("ok"), joints.count("warn")
        rest = len(joints) - fitted - changed
        said.append(
            f"Of {len(joints)} joints {fitted} behave as fitted"
            f"{f', {changed} do not' if changed else ''}"
            f"{f', {rest} were not compared in full' if rest else ''}."
        )
    return " ".join(said)


def _driven(grades: Sequence[str], walks: bool) -> str:
    """Whether the robot may be driven, or the servos of a bench moved."""
    what, done = ("robot", "driven") if walks else ("bench", "moved")
    checks, bad, warnings, notes = len(grades), *map(grades.count, ("bad", "warn", "note"))
    assumed = f"; numbers assumed: {notes}" if notes else ""
    if bad:
        return (
            f"The {what} must not be {done} yet: {bad} of {checks} checks are bad, {warnings} warn."
        )
    if warnings:
        return f"The {what} may be {done}: no check is bad, {warnings} of {checks} warn{assumed}."
    return f"The {what} may be {done}: all {checks} checks are good{assumed}."


def _tables(result: Mapping[str, Any]) -> Sequence[Table]:
    """A row for each check, with the cure."""
    columns = ("grade", "expected", "found", "cure")
    rows = [(f"{r['part']}: {r['check']}", [r[name] for name in columns]) for r in result["rows"]]
    return (Table("Checks", columns, rows, "\n\n".join(result["changes"])),)


def _sentence_of(result: Mapping[str, Any]) -> str:
    rows = [(row["part"], row["grade"]) for row in result["rows"]]
    return _sentence(rows, result.get("walks", True))


VIEW = View("doctor", DESCRIPTION, DoctorConfig, _tables, _sentence_of)
