"""Reads one log, all its files. What is damaged is left out and counted; the rest is read."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from antennate.errors import LogError
from antennate.files import open_regular
from antennate.telemetry.framing import SCHEMA, Kind, opened, pieces
from antennate.telemetry.header import Header
from antennate.telemetry.parts import parts
from antennate.telemetry.ticks import Tick

_LISTED = 100
"""Most damaged places that are listed."""


class Damage(NamedTuple):
    """A place that could not be read: where it begins [bytes], what is wrong, in which file."""

    offset: int
    reason: str
    path: Path


class LogReader:
    """The ticks of a log, one after the other; iterate once.

    Args:
        path: Its first file; those that continue it are read too.

    Attributes:
        path: The first file.
        parts: All files.
        header: Its header.
        ticks: Ticks read so far.
        last: Number of the last tick read, 0 before the first.
        bad: Damaged places so far.
        damage: The first of them.
        end: Ticks that were written, if the log was closed and its end is read; else None.

    Raises:
        LogError: The file cannot be read, or has no header; says what can be read of it.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.ticks = self.last = self.bad = 0
        self.damage: list[Damage] = []
        self.end: int | None = None
        try:
            self._file = open_regular(path)
        except OSError as error:
            raise LogError(f"expected a log, found {path}: {error.strerror}") from None
        self.parts = parts(path)
        self._part, self._before = path, 0
        self._records = self._read()
        try:
            self.header = self._header()
        except LogError:
            self._file.close()
            raise

    @property
    def missing(self) -> int:
        """Ticks known to have been written or to have happened that were not read."""
        after = 0 if self.end is None else max(0, self.end - self.ticks)
        return max(after, self.last - self.ticks)

    def __iter__(self) -> Iterator[Tick]:
        """The ticks, in order.

        Raises:
            LogError: The disk fails.
        """
        for offset, piece in self._records:
            content = None if piece is None else opened(piece)
            if content is None:
                self._note(offset, "damaged record")
            elif content[0] == SCHEMA and content[1] == Kind.END and len(content) == 10:
                self.end = self._before + int.from_bytes(content[2:], "little")
            elif self._part != self.path and content == self._first:
                continue
            else:
                try:
                    tick = Tick.unpack(content)
                except LogError as error:
                    self._note(offset, str(error))
                    continue
                if tick.number <= self.last:
                    self._note(offset, f"tick {tick.number} after {self.last}")
                    continue
                self.ticks += 1
                self.last = tick.number
                yield tick

    def __enter__(self) -> LogReader:
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()

    def _read(self) -> Iterator[tuple[int, bytes | None]]:
        try:
            for path in self.parts:
                if path != self.path:
                    self._file.close()
                    self._part, self._before, self.end = path, self.ticks, None
                    self._file = open_regular(path)
                yield from pieces(self._file)
        except OSError as error:
            raise LogError(f"expected to read {self._part}, found: {error.strerror}") from None

    def _header(self) -> Header:
        _, piece = next(self._records, (0, b""))
        content = None if piece is None else opened(piece)
        if content is not None:
            self._first = content
            try:
                return Header.unpack(content)
            except LogError as error:
                raise LogError(f"{self.path}: {error}") from None
        ticks = sum(1 for _ in self)
        raise LogError(
            f"{self.path}: expected a log of `antennate drive`, found no intact header, {ticks} "
            f"intact ticks; damaged places: {self.bad + 1}"
        )

    def _note(self, offset: int, reason: str) -> None:
        self.bad += 1
        if self.bad <= _LISTED:
            self.damage.append(Damage(offset, reason, self._part))


def count(path: Path) -> int:
    """Ticks that can be read from a log, all its files, even if the first was never begun."""
    try:
        with LogReader(path) as log:
            return sum(1 for _ in log)
    except LogError:
        found = 0
    for each in parts(path)[1:]:
        with suppress(LogError), LogReader(each) as log:
            found += sum(1 for _ in log)
    return found
