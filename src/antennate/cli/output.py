"""Standard output and standard error that may be closed, full, or know ASCII alone.

A run of hours must not lose its figures because nobody can read its table. So writing never raises
here; what went wrong with standard output is told at the end.
"""

from __future__ import annotations

import codecs
import contextlib
import errno
import io
import os
import sys
import unicodedata
from collections.abc import Iterator
from typing import TextIO

_ASCII = {"·": ".", "×": "x", "–": "-", "−": "-", "±": "+-", "²": "^2", "→": "->", "…": "..."}


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
            prints, here and in workers, goes to standard error then.
    """
    _occupy()
    _forget_wrong_sizes()
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
    kept = os.dup(1)
    os.dup2(2, 1)
    out.move(os.dup(kept))
    sys.stdout = Output(other)
    sys.stdout.result = out
    try:
        yield
    finally:
        sys.stdout.flush()
        sys.stdout = out
        if sys.__stdout__ is not None:
            sys.__stdout__.flush()
        os.dup2(kept, 1)
        os.close(kept)


def write_result(text: str) -> None:
    """Write to standard output, also where users' code cannot."""
    getattr(sys.stdout, "result", sys.stdout).write(text)


def _occupy() -> None:
    """Open what is closed of the three standard descriptors, so that no file of a run gets one."""
    for descriptor in range(3):
        try:
            os.fstat(descriptor)
        except OSError:
            os.set_inheritable(os.open(os.devnull, os.O_RDWR), True)


def _forget_wrong_sizes() -> None:
    """Take away a size of the terminal that is none; cron and expect may set COLUMNS to 0."""
    for name in ("COLUMNS", "LINES"):
        text = os.environ.get(name, "1")
        if not (text.isdecimal() and text.strip("0")):
            del os.environ[name]


def _plain(error: UnicodeError) -> tuple[str, int]:
    """What stands for characters that a stream cannot encode."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    text = error.object[error.start : error.end]
    plain = (_ASCII.get(c) or unicodedata.normalize("NFKD", c) for c in text)
    return "".join(c if c.isascii() else "?" for word in plain for c in word), error.end


_PLAIN = "antennate.plain"
codecs.register_error(_PLAIN, _plain)
