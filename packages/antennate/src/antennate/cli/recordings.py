"""`antennate drive --protocol`: recordings step by step, and going on where they ended."""

from __future__ import annotations

import contextlib
import json
import os
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from antennate.cli.keys import END, typed_keys
from antennate.control.protocol import Protocol
from antennate.errors import BadInputError, ConfigError, LogError, reason
from antennate.hardware.config import DriveConfig
from antennate.hardware.driving.protocol import Course, ProtocolController
from antennate.hardware.safety.session import Session
from antennate.messages import typed
from antennate.params.scene import HookParams
from antennate.studies.run_directory import RunDirectory
from antennate.studies.run_files import LOG
from antennate.telemetry.header import MOST_PARTS, Header
from antennate.telemetry.reader import LogReader
from antennate.telemetry.steps import steps
from antennate.telemetry.ticks import Tick

NAME = "protocol"
"""Name of the controller in the log."""


@dataclass
class Recordings:
    """A drive through a protocol, and what the log of its folder holds already.

    Attributes:
        protocol: The protocol, made for the robot.
        confirmed: Whether a person has confirmed a task; None where each takes its time.
        tell: Told the order of each task.
        header: Header of the log that it goes on with, None for a new one.
        files, ticks, number: Files and ticks of that log, and the number of its last tick.
        done: Names of the steps that it holds whole.
    """

    protocol: Protocol
    confirmed: Callable[[], bool] | None
    tell: Callable[[str], None]
    header: Header | None = None
    files: int = 0
    ticks: int = 0
    number: int = 0
    done: tuple[str, ...] = ()

    def identity(self, header: Header) -> dict[str, Any]:
        """What a folder is begun with, so that no other robot and protocol go on in it."""
        known = json.loads(header.model_dump_json(exclude={"start", "versions"}))
        return {"command": "drive", "config": known, "versions": dict(header.versions)}

    def go_on(self, folder: RunDirectory) -> None:
        """Find what a folder holds already; it stays then, whatever comes.

        Raises:
            BadInputError: All steps are recorded, or its log can have no further file.
        """
        if (log := folder.path / LOG).exists():
            folder.kept, self.done = True, _whole(log)
            with LogReader(log) as reader:
                self.ticks = sum(1 for _ in reader)
            self.header, self.files, self.number = reader.header, len(reader.parts), reader.last
        if not self.result(folder.path)["interrupted"]:
            raise BadInputError(f"{folder.path}: expected steps that are left, found none")
        if self.files >= MOST_PARTS:
            raise BadInputError(
                f"{folder.path}: expected a log of fewer than {MOST_PARTS} files, found "
                f"{self.files}; choose another folder"
            )

    def continued(self, tick: Tick, start: int) -> Tick:
        """A tick as the log goes on with it, of a session whose time 0 is a Unix time [ns]."""
        later = 0.0 if self.header is None else 1e-9 * (start - self.header.start)
        number = tick.number + self.number
        return replace(tick, number=number, now=tick.now + later, t=tick.t + later)

    def controller(self, session: Session, config: DriveConfig) -> ProtocolController:
        """The controller of a session: the steps that are left."""
        robot, control = config.robot, config.control
        course = Course(self.protocol, robot, control, self.done, self.confirmed, self.tell)
        return ProtocolController(control, robot, course, session)

    def result(self, folder: Path) -> dict[str, Any]:
        """What result.json says of the steps that the log of a folder holds."""
        names, done = [step.called for step in self.protocol.steps], _whole(folder / LOG)
        left = [name for name in names if name not in done]
        told = {"steps": len(names), "recorded": list(done), "left": left}
        return {"protocol": told, "interrupted": bool(left)}


def _whole(log: Path) -> tuple[str, ...]:
    """Names of the steps that a log holds whole; none if it cannot be read."""
    with contextlib.suppress(LogError):
        return tuple(step.name for step in steps(log) if step.whole)
    return ()


@contextlib.contextmanager
def recordings(config: DriveConfig, tell: Path | None) -> Iterator[Recordings]:
    """Yield the recordings that a configuration names.

    A person confirms each task by a key, on a terminal, if no file is told of them and no key has
    to be held.

    Args:
        config: The robot and its protocol.
        tell: File or named pipe for the orders of the tasks, if wanted.
    """
    given = Protocol.named(config.protocol)
    try:
        protocol = given.made_for(config.robot, config.control)
    except ConfigError as error:
        raise ConfigError(f"{config.protocol}: {error}") from None
    if tell is not None and protocol.hook != HookParams():
        raise ConfigError(
            f"{config.protocol}: hook: expected the hook of the twin beside --tell, found another"
        )
    by_time = tell is not None or config.hold_to_run
    with teller(tell) as told, _confirmations(by_time) as confirmed:
        yield Recordings(protocol, confirmed, told)


@contextlib.contextmanager
def _confirmations(by_time: bool) -> Iterator[Callable[[], bool] | None]:
    """Yield what says whether a key came since its last call; None where there are no keys."""
    keys = None if by_time else sys.stdin
    foreground = keys and keys.isatty() and os.tcgetpgrp(keys.fileno()) == os.getpgrp()
    if not foreground:
        yield None
        return
    with typed_keys() as read:
        yield lambda: any(key != END for key in read(0.0))


@contextlib.contextmanager
def teller(path: Path | None) -> Iterator[Callable[[str], None]]:
    """Yield what writes orders to a file or a named pipe, without waiting for who reads them."""
    if path is None:
        yield lambda order: None
        return
    fifo = path.is_fifo()
    try:
        more = os.O_NONBLOCK if fifo else os.O_CREAT | os.O_APPEND
        file = os.open(path, os.O_WRONLY | os.O_CLOEXEC | more, 0o644)
    except OSError as error:
        found = "a pipe that nobody reads" if fifo else reason(error)
        raise ConfigError(
            f"--tell: expected a file, or a named pipe that `{typed('twin')} --orders` reads, "
            f"found {path}: {found}"
        ) from None

    def tell(order: str) -> None:
        with contextlib.suppress(OSError):  # nobody reads any more
            os.write(file, f"{order}\n".encode())

    try:
        yield tell
    finally:
        os.close(file)
