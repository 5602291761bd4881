"""`antennate record`: readings of an antenna, with the bends at which it was held."""

from __future__ import annotations

import os
import select
import sys
import termios
from array import array
from collections import deque
from collections.abc import Callable, Sequence
from pathlib import Path
from statistics import fmean, pstdev

import numpy as np
from pydantic.dataclasses import dataclass

from antennate.antenna.curves import plateau_of
from antennate.cli.options import option
from antennate.cli.robot import RobotOptions, at_hand, key_of, parse_robot
from antennate.cli.terminal import OK, StatusLine, stop_signals
from antennate.errors import BadInputError, ConfigError
from antennate.hardware.config import RecordConfig, RobotFile
from antennate.hardware.doctor.check import opener_of
from antennate.hardware.esp32.board import BOARD_BAUD, Board
from antennate.hardware.esp32.clock import Timed
from antennate.hardware.esp32.recording import Recorder
from antennate.host import HostClock
from antennate.messages import typed
from antennate.params.hardware import RecordParams

DESCRIPTION = """\
Record an antenna at a bench, into a CSV file that `antennate calibrate` takes. With --marks you
hold the antenna at one place after the other and press Enter at each; with --speed a stage pushes
it at a constant speed from Enter on; with neither, readings of both antennae are written until the
duration is over or Ctrl-C.

Every line is flushed; a file that exists is left alone."""
_SIDES = ("left", "right")
_SHOWN = 100
"""Readings over which mean and noise are shown."""


@dataclass(frozen=True)
class RecordOptions(RobotOptions):
    """Where from and where to."""

    out: Path | None = option(None, "CSV file to make", "FILE")


def command(argv: Sequence[str]) -> int:
    """Record until all marks or pushes are done, or the time is over."""
    sides = _SIDES

    def take(robot: RobotFile) -> RecordConfig:
        nonlocal sides
        sides = _SIDES[: robot.robot.antenna_count or len(_SIDES)]
        return robot.for_record()

    params, options = parse_robot(
        "record", DESCRIPTION, RecordConfig, argv, RecordOptions, take=take
    )
    if not options.esp32:
        raise ConfigError(f"--esp32: expected a serial port, found none{at_hand(options)}")
    if options.out is None:
        raise ConfigError("--out: expected a CSV file to make, found none")
    key, now = key_of(options), HostClock().now
    opener = opener_of(options.esp32, "--esp32", key, params.network)
    with opener(BOARD_BAUD) as port:
        board = Board(port)
        status = Status(board, params, now, sides)
        with Lines(options.out) as lines, stop_signals():
            recorder = Recorder(board, params, now, status.ask, lines.write, status)
            then = "."
            try:
                recorder.run()
                then = f"; {_next(params, options.out)}"
            finally:
                lost = board.clock.sequence.lost
                where = f"are in {options.out}" if recorder.rows else "came, so there is no file"
                status.close()
                sys.stderr.write(f"{recorder.rows} readings {where}, {lost} were lost{then}\n")
                sys.stderr.writelines(status.saturated())
    return OK


class Lines:
    """A file that is made with its first line, and flushed with each."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._count = 0

    def __enter__(self) -> Lines:
        self._file = self._path.open("x", encoding="utf-8", newline="\n")
        return self

    def write(self, line: str) -> None:
        """One line, at once."""
        self._file.write(line + "\n")
        self._file.flush()
        self._count += 1

    def __exit__(self, *_: object) -> None:
        self._file.close()
        if self._count < 2:  # no reading came; an empty file would be in the way
            self._path.unlink()


class Status:
    """One line on stderr now and then: readings, their noise, rate and losses."""

    def __init__(
        self,
        board: Board,
        params: RecordParams,
        now: Callable[[], float],
        sides: Sequence[str] = _SIDES,
    ) -> None:
        self._waiting, self._sides = False, sides
        self._board, self._params, self._now = board, params, now
        self._shown: deque[Timed] = deque(maxlen=_SHOWN)
        both = params.speed is None and not params.marks
        self._codes: dict[str, array[int]] = {
            side: array("H") for side in sides if both or side == params.side
        }
        self._status = StatusLine()

    def __call__(self, reading: Timed) -> None:
        """Take a reading; show the line if it is time."""
        self._shown.append(reading)
        for side, codes in self._codes.items():
            codes.append(getattr(reading.sample, side))
        if self._status.due(self._now()):
            self._status.show(self.line())

    def ask(self, text: str) -> Callable[[], bool]:
        """Ask a person for something; return a function that says whether Enter has come."""
        if sys.stdin.isatty():  # an Enter that was typed too early confirms nothing
            termios.tcflush(sys.stdin, termios.TCIFLUSH)
        self._waiting = True
        self._status.say(text)
        return self._confirmed

    def _confirmed(self) -> bool:
        self._waiting = self._waiting and not _entered()
        return not self._waiting

    def close(self) -> None:
        """End the line."""
        self._status.close()

    def saturated(self) -> list[str]:
        """A line for each antenna whose readings stand at their highest."""
        lines: list[str] = []
        for side, codes in self._codes.items():
            if plateau := plateau_of(np.array(codes, float)):
                lines.append(f"{plateau.text(f'the {side} readings')}\n")
        return lines

    def line(self) -> str:
        """The line."""
        span = self._shown[-1].arrived - self._shown[0].arrived
        rate = (len(self._shown) - 1) / span if span > 0 else 0.0
        parts = ["waiting for Enter" if self._waiting else "recording"]
        for side in self._sides:
            counts = [float(getattr(reading.sample, side)) for reading in self._shown]
            parts.append(f"{side} {fmean(counts):6.1f} ± {pstdev(counts):4.1f}")
        bytes_ = self._board.decoder.counters
        lost = self._board.clock.sequence.lost
        return f"{'  '.join(parts)}  {rate:5.1f} Hz  lost {lost}  crc {bytes_.crc_errors} "


def _entered() -> bool:
    """Whether a line has been typed; takes no more than that line."""
    handle = sys.stdin.fileno()
    while select.select([handle], [], [], 0.0)[0]:
        byte = os.read(handle, 1)
        if not byte:
            raise BadInputError("expected Enter on a terminal, found the end of the input")
        if byte == b"\n":
            return True
    return False


def _next(params: RecordParams, out: Path) -> str:
    """What to do with the file."""
    if not params.marks and params.speed is None:
        return "they show rate, noise and drift; calibrate needs --marks or --speed."
    unit = params.unit if params.marks else "m"
    words = ["calibrate", "--recording", str(out), "--columns.bend-unit", unit]
    return "next: " + typed(*words, "--sensor-id", params.side, "--out", params.side)
