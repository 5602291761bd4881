"""What people see: standard streams that may fail, a line that changes, a bar, signals to stop.

The streams may be closed, full, or know ASCII alone. A run of hours must not lose its figures
because nobody can read its table. So writing never raises here; what went wrong with standard
output is told at the end.
"""

from __future__ import annotations

import codecs
import contextlib
import errno
import io
import logging
import math
import os
import shutil
import signal
import sys
import time
import unicodedata
from collections.abc import Callable, Iterator
from textwrap import fill, wrap
from typing import Any, TextIO

from antennate.host import STOPS, StopOnce
from antennate.messages import one_line

OK, BAD_INPUT, INTERRUPTED = 0, 2, 130
"""Exit codes of every command."""
_ASCII = {"·": ".", "×": "x", "–": "-", "−": "-", "±": "+-", "²": "^2", "→": "->", "…": "..."}
_PLAIN = "antennate.plain"
_COLUMNS, _ROWS = 80, 24


class Output(io.TextIOBase):
    """A text stream that keeps its first error instead of raising it.

    Args:
        file: Where the text goes; None if that was closed from the start.

    Attributes:
        error: What went wrong first, None if nothing did.
        result: The stream of the result: this one, but with --json.
    """

    def __init__(self, file: TextIO | None) -> None:
        self._file = file
        self.error: OSError | None = None
        self.result = self
        if isinstance(file, io.TextIOWrapper):
            file.reconfigure(errors=_PLAIN)

    @property
    def encoding(self) -> str:  # type: ignore[override]
        """Encoding of the stream."""
        return getattr(self._file, "encoding", None) or "utf-8"

    def isatty(self) -> bool:
        """Whether a terminal is there."""
        return self._file is not None and self._file.isatty()

    def fileno(self) -> int:
        """File descriptor of the stream."""
        return io.TextIOBase.fileno(self) if self._file is None else self._file.fileno()

    def write(self, text: str) -> int:  # type: ignore[override]
        """Write, as far as that is possible."""
        if self._file is None:
            self.error = self.error or OSError(errno.EBADF, "it is closed")
        elif self.error is None:
            try:
                self._file.write(text)
            except OSError as error:
                self._fail(error)
        return len(text)

    def flush(self) -> None:
        """Flush, as far as that is possible; the last one comes when all is closed already."""
        if self._file is not None and self.error is None and not self._file.closed:
            try:
                self._file.flush()
            except OSError as error:
                self._fail(error)

    def move(self, descriptor: int) -> None:
        """Write to this file descriptor from now on, if the stream was standard output."""
        if self._file is not None and self._file is sys.__stdout__:
            self._file = os.fdopen(descriptor, "w", encoding=self.encoding, errors=_PLAIN)

    def _fail(self, error: OSError) -> None:
        """Keep the error; what is still in the buffer is written to the null device."""
        self.error = error
        if self._file is not None:
            with contextlib.suppress(OSError):
                os.dup2(os.open(os.devnull, os.O_WRONLY), self._file.fileno())


@contextlib.contextmanager
def safe_streams(result_alone: bool = False) -> Iterator[Output]:
    """Let nothing that is written to the standard streams raise; yield standard output.

    Args:
        result_alone: Whether nothing but the result goes to standard output. What users' code
            prints, in this process and in workers, goes to standard error then.
    """
    for descriptor in range(3):  # so that no file of a run gets the number of a closed stream
        try:
            os.fstat(descriptor)
        except OSError:
            os.set_inheritable(os.open(os.devnull, os.O_RDWR), True)
    for name in ("COLUMNS", "LINES"):  # cron and expect may set a size that is none
        text = os.environ.get(name, "1")
        if not (text.isdecimal() and text.strip("0")):
            del os.environ[name]
    before = sys.stdout, sys.stderr
    out = Output(sys.stdout)
    sys.stdout, sys.stderr = out, Output(sys.stderr)
    try:
        with _aside(out, before[1]) if result_alone else contextlib.nullcontext():
            yield out
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        sys.stdout, sys.stderr = before


@contextlib.contextmanager
def _aside(out: Output, other: TextIO | None) -> Iterator[None]:
    """Let what is printed, also by processes and libraries, go to standard error."""
    out.flush()
    standard = os.dup(1)
    os.dup2(2, 1)
    out.move(os.dup(standard))
    sys.stdout = Output(other)
    sys.stdout.result = out
    try:
        yield
    finally:
        sys.stdout.flush()
        sys.stdout = out
        if sys.__stdout__ is not None:
            sys.__stdout__.flush()
        os.dup2(standard, 1)
        os.close(standard)


def _plain(error: UnicodeError) -> tuple[str, int]:
    """What stands for characters that a stream cannot encode."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    text = error.object[error.start : error.end]
    plain = (_ASCII.get(c) or unicodedata.normalize("NFKD", c) for c in text)
    return "".join(c if c.isascii() else "?" for word in plain for c in word), error.end


codecs.register_error(_PLAIN, _plain)


def write_result(text: str) -> None:
    """Write to standard output, also where users' code cannot."""
    getattr(sys.stdout, "result", sys.stdout).write(text)


def write(text: str) -> None:
    """Write on stderr; that it is closed or full is no error."""
    if sys.stderr is not None:
        with contextlib.suppress(OSError):  # it is closed or full, as with a lost terminal
            sys.stderr.write(text)
            sys.stderr.flush()


def today() -> str:
    """The date, as files of a robot have it."""
    return time.strftime("%Y-%m-%d")


def is_drawable(stream: Any) -> bool:
    """Whether a stream is a terminal on which a line can be written over the last one."""
    return bool(stream and stream.isatty() and os.environ.get("TERM", "dumb") != "dumb")


def console() -> Any:
    """Standard output as rich writes to it, as wide as the terminal says, also a dumb one."""
    from rich.console import Console  # slow to import

    width = height = None
    if sys.stdout.isatty() and not is_drawable(sys.stdout):  # rich takes 80 columns for it
        width, height = shutil.get_terminal_size()
    return Console(file=sys.stdout, highlight=False, width=width, height=height)


_ERASE = "\x1b[J"
"""Erases what stands from the cursor on."""


def write_below_status(text: str) -> None:
    """Write a line on stderr below the first row of a status line, also one of another process."""
    write(f"\n{_ERASE if is_drawable(sys.stderr) else ''}{text}\n")


class StatusLine:
    """A line on stderr that changes: on a terminal over the last one, elsewhere one a second.

    On a terminal it takes as many rows as it needs. The cursor waits in the first one, so whatever
    another process writes is not erased with it.

    Attributes:
        terminal: Whether it is written over the last one.
    """

    _PERIOD, _PERIOD_PLAIN = 0.2, 1.0
    """Time between two lines on a terminal, and elsewhere [s]."""
    _CLEAR = f"\r{_ERASE}"

    def __init__(self) -> None:
        self.terminal = is_drawable(sys.stderr)
        self._due = -math.inf
        self._rows = 0

    def due(self, now: float) -> bool:
        """Whether a line is to be shown at a time [s]."""
        if now < self._due:
            return False
        self._due = now + (self._PERIOD if self.terminal else self._PERIOD_PLAIN)
        return True

    def show(self, text: str, instruction: str = "") -> None:
        """Show a line; on a terminal broken between words, since a row that wraps stays.

        Args:
            text: The line; its end goes first where the terminal has too few rows.
            instruction: What a person is to do, behind the line; on a terminal in rows of its own.
        """
        if not self.terminal:
            write(f"{text} | {instruction}\n" if instruction else f"{text}\n")
            return
        columns, height = self._size()
        asked = wrap(one_line(instruction), columns - 1, break_on_hyphens=False)
        rows = wrap(
            one_line(text),
            columns - 1,
            break_on_hyphens=False,
            max_lines=max(1, height - 1 - len(asked)),
            placeholder=" ...",
        )
        rows = [*rows, *asked]
        back = f"\x1b[{len(rows) - 1}A" if len(rows) > 1 else ""
        write(self._CLEAR + "\r\n".join(rows) + back + "\r")
        self._rows = len(rows)

    def say(self, text: str) -> None:
        """Show something that stays, above the line; on a terminal broken between words."""
        if self.terminal:
            width = self._size()[0] - 1
            text = fill(text, width, break_long_words=False, break_on_hyphens=False)
        write(f"{self._CLEAR if self._rows else ''}{text}\n")
        self._rows = 0

    def close(self) -> None:
        """End the line."""
        write("\n" * self._rows)
        self._rows = 0

    @staticmethod
    def _size() -> tuple[int, int]:
        """Columns and rows of the terminal on stderr; stdout may be a file."""
        try:
            columns, rows = os.get_terminal_size(sys.stderr.fileno())
        except (OSError, ValueError):
            columns = rows = 0
        return columns or _COLUMNS, rows or _ROWS


@contextlib.contextmanager
def progress(
    what: str, table: Callable[[], Any] = lambda: None
) -> Iterator[Callable[[int, int], None]]:
    """How far a run has come, on stderr: a bar for people, ten plain lines for files.

    Yields a function to call after each step with how many of how many are done.

    Args:
        what: What is counted.
        table: How the run stands, None for nothing: below the bar, and after each quarter of a
            long run in lines that stay.
    """
    from rich.console import Console, Group  # slow to import

    pace, console = _Pace(), Console(file=sys.stderr)

    def stay(done: int, total: int) -> None:
        if pace.quarter(done, total) and (stand := table()) is not None:
            console.print(stand)

    if not is_drawable(sys.stderr):

        def line(done: int, total: int) -> None:
            pace.report(what, done, total)
            stay(done, total)

        yield line
        return
    from rich import progress as bars
    from rich.live import Live

    columns = (bars.TextColumn(what), bars.BarColumn(), bars.MofNCompleteColumn())
    rate = bars.TextColumn("{task.fields[rate]}")
    bar = bars.Progress(*columns, rate, bars.TimeRemainingColumn())
    task = bar.add_task(what, total=None, rate="")

    def drawn() -> Any:
        below = table()
        return bar if below is None else Group(bar, below)

    def step(done: int, total: int) -> None:
        bar.update(task, completed=done, total=total, rate=pace.rate(done))
        stay(done, total)

    with Live(console=console, transient=True, get_renderable=drawn, refresh_per_second=2):
        yield step


@contextlib.contextmanager
def told(package: str) -> Iterator[None]:
    """Show on stderr what this package and `antennate` log meanwhile: notes, and warnings."""
    loggers = [logging.getLogger(name) for name in {"antennate", package}]
    levels, handler = [logger.level for logger in loggers], logging.StreamHandler(sys.stderr)
    for logger in loggers:
        logger.addHandler(handler)
        logger.setLevel(logging.INFO)
    try:
        yield
    finally:
        for logger, level in zip(loggers, levels, strict=True):
            logger.removeHandler(handler)
            logger.setLevel(level)


class _Pace:
    """How fast steps come; those that were there at the first call took no time."""

    _LINES = 10
    """Plain lines over a whole run."""
    _LONG = 20
    """Steps from which a run has quarters."""

    def __init__(self) -> None:
        self._start, self._first, self._line, self._quarter = time.monotonic(), -1, 0, 0

    def quarter(self, done: int, total: int) -> bool:
        """Whether another quarter of a long run has ended, but for the last."""
        before, self._quarter = self._quarter, 4 * done // total
        return total >= self._LONG and before < self._quarter < 4

    def rate(self, done: int) -> str:
        """Steps a second or a minute, in words; empty before there is one."""
        if self._first < 0:
            self._first = done if done > 1 else 0
        speed = self._speed(done)
        if done == self._first:
            return ""
        return f"{speed:.1f}/s" if speed >= 1.0 else f"{60 * speed:.1f}/min"

    def report(self, what: str, done: int, total: int) -> None:
        """A line for each tenth of the steps."""
        rate = self.rate(done)
        if done * self._LINES // total > self._line:
            self._line = done * self._LINES // total
            seconds = time.monotonic() - self._start
            left = (total - done) / max(self._speed(done), 1e-9)
            more = f", {rate}, {left:.0f} s left" if rate and done < total else ""
            sys.stderr.write(f"{what}: {done} of {total} after {seconds:.0f} s{more}\n")
            sys.stderr.flush()

    def _speed(self, done: int) -> float:
        return (done - self._first) / max(time.monotonic() - self._start, 1e-9)


@contextlib.contextmanager
def stop_signals(last: bool = False) -> Iterator[None]:
    """Let SIGTERM end the block as Ctrl-C does; a signal that is ignored stays so.

    Args:
        last: Whether all after the first are ignored, even when the block has ended.
    """
    heeded = [number for number in STOPS if signal.getsignal(number) is not signal.SIG_IGN]
    with StopOnce(last, heeded):
        yield
