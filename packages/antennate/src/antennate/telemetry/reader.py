"""One log, all its files, read or recovered; what is damaged is left out and counted."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from antennate import __version__
from antennate.errors import LogError, reason
from antennate.files import lock, open_regular, replacing
from antennate.telemetry.header import Header, parts
from antennate.telemetry.survey import Record, Survey, by_summary, tick_by_tick
from antennate.telemetry.ticks import Tick
from antennate.telemetry.topics import (
    CONTACT_FORCES,
    COORDINATES,
    EVENTS,
    HEADER_TOPICS,
    MANEUVER,
    TICK_TOPICS,
    TOPICS,
    Topic,
    by_channel,
)
from antennate.telemetry.writer import LogWriter

if TYPE_CHECKING:
    from mcap.records import Schema

    from antennate.telemetry.chunks import Chunk

_LISTED = 100
"""Most damaged places that are listed."""
_CHANNELS = dict(enumerate(TOPICS, 1))
"""Channels of a file that declares none, as its first chunk is lost."""
_BESIDE = (EVENTS, CONTACT_FORCES, COORDINATES)
"""Topics whose messages are no part of a tick."""
_LARGEST = 1 << 25
"""Most bytes of messages that are taken for those of one tick."""
_EACH = 500
"""Bytes that a message takes in memory beside its content."""


class Damage(NamedTuple):
    """A place that could not be read: where it begins [bytes], what is wrong, in which file."""

    offset: int
    reason: str
    path: Path


class LogReader:
    """The ticks of a log, one after the other; iterate or survey it once.

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
        guarded: Whether all that was read so far has a CRC, as antennate writes it.
        end: Ticks that were written, if the log was closed and its end is read; else None.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.ticks = self.last = self.bad = 0
        self.damage: list[Damage] = []
        self.guarded = True
        self.end: int | None = None
        try:
            self._file = open_regular(path)
        except OSError as error:
            raise LogError(f"expected a log, found {path}: {reason(error)}") from None
        self.parts = parts(path)
        self._part, self._before = path, 0
        self._declared: dict[int, Topic] = {}
        self._schemas: dict[int, Schema] = {}
        self._first: dict[Topic, bytes] = {}
        self._chunks: Iterator[Chunk | None] = self._read()
        try:
            self.header = self._header()
        except LogError:
            self._file.close()
            raise

    @property
    def _channels(self) -> Mapping[int, Topic]:
        """The topics by their channel, as far as they are known."""
        return self._declared or _CHANNELS

    @property
    def missing(self) -> int:
        """Ticks known to have been written or to have happened that were not read."""
        after = 0 if self.end is None else max(0, self.end - self.ticks)
        return max(after, self.last - self.ticks)

    def __iter__(self) -> Iterator[Tick]:
        """The ticks, in order."""
        for _, tick in self.groups():
            if tick is not None:
                yield tick

    def require_ticks(self) -> None:
        """Require that some have been read."""
        if not self.ticks:
            why = f": {self.damage[0].reason} at byte {self.damage[0].offset}" if self.bad else ""
            raise LogError(f"{self.path}: expected a log with ticks, found none{why}")

    def groups(self) -> Iterator[tuple[Sequence[Record], Tick | None]]:
        """All messages as they are: those of one tick, with it, then those of none.

        The messages of one time are a tick; another one begins where a topic of ticks comes again.
        """
        group, begin, size, last = list[Record](), 0, 0, 0
        for chunk in self._chunks:
            if chunk is None:  # the end of a file
                yield from self._grouped(begin, group)
                group, last = [], 0
                continue
            for message in chunk.messages:
                topic = self._channels.get(message.channel_id)
                if topic is None or topic in HEADER_TOPICS:
                    continue
                record = Record(topic, message.sequence, message.log_time, message.data)
                if record.time < last:
                    raise LogError(
                        f"{self._part}: expected messages in the order of their times, found one "
                        f"that goes back at byte {chunk.offset}; `mcap sort` writes them so"
                    )
                if record.time > last or size > _LARGEST or _comes_again(topic, group):
                    yield from self._grouped(begin, group)
                    group = []
                begin, size = (begin, size) if group else (chunk.offset, 0)
                size += len(record.data) + _EACH
                last = record.time
                group.append(record)

    def survey(self) -> Survey:
        """What all of it holds, and what is damaged or missing.

        Of a log of antennate, closed, in one file, little but events is decoded: its summary tells
        the rest, and the CRC of each chunk is checked. All others are read as by `groups`.
        """
        try:
            survey = by_summary(self._file, self._channels) if len(self.parts) == 1 else None
        except OSError as error:
            raise LogError(f"expected to read {self._part}, found: {reason(error)}") from None
        if survey is None:
            return tick_by_tick(self.groups())
        self.ticks = self.end = survey.messages.get(MANEUVER, 0)
        self.last = survey.number
        return survey

    def _grouped(
        self, offset: int, group: Sequence[Record]
    ) -> Iterator[tuple[Sequence[Record], Tick | None]]:
        """The messages of one tick, with it if it is whole and new.

        Those beside the tick that are not of their type are left out.
        """
        group = [
            each for each in group if each.topic not in _BESIDE or self._is_sound(offset, each)
        ]
        data = {record.topic: record.data for record in group}
        if not any(topic in data for topic in TICK_TOPICS):
            if group:
                yield group, None
            return
        try:
            missing = [topic.name for topic in TICK_TOPICS if topic not in data]
            if missing:
                raise LogError(f"tick without {missing[0]}")
            tick = Tick.of_messages(data)
        except LogError as error:
            self._note(offset, str(error))
            return
        if tick.number <= self.last:
            self._note(offset, f"tick {tick.number} after {self.last}")
            return
        self.ticks += 1
        self.last = tick.number
        yield group, tick

    def _is_sound(self, offset: int, record: Record) -> bool:
        try:
            record.topic.decode(record.data)
        except LogError as error:
            self._note(offset, str(error))
            return False
        return True

    def __enter__(self) -> LogReader:
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()

    def _read(self) -> Iterator[Chunk | None]:
        """The intact chunks of all files; None behind those of each file."""
        from antennate.telemetry.chunks import End, Fault, walk  # slow to import

        closed = None
        try:
            for path in self.parts:
                if path != self.path:
                    self._file.close()
                    self._part, self._before, closed = path, self.ticks, self.end
                    self.end, self._file = None, open_regular(path)
                for place in walk(self._file):
                    if isinstance(place, Fault):
                        self._note(*place)
                        continue
                    if isinstance(place, End):
                        topics = self._channels
                        ticks = (
                            n for each, n in place.counts.items() if topics.get(each) is MANEUVER
                        )
                        self.end = self._before + sum(ticks)
                        continue
                    self._schemas |= place.schemas
                    self._declared |= by_channel(place.channels, self._schemas)
                    if self._is_of_this_log(place):
                        self.guarded = self.guarded and place.guarded
                        yield place
                    else:
                        self._note(place.offset, "a file of another log")
                        self.end = closed
                        break
                yield None
        except OSError as error:
            raise LogError(f"expected to read {self._part}, found: {reason(error)}") from None
        except LogError as error:
            raise LogError(f"{self._part}: {error}") from None

    def _is_of_this_log(self, chunk: Chunk) -> bool:
        """Whether a later file has the header of the first one, and ticks after its last one."""
        if self._part == self.path:
            return True
        header = self._of_header(chunk)
        if any(self._first.get(topic) != data for topic, data in header.items()):
            return False
        if self.ticks > self._before:
            return True
        ticks = [m.data for m in chunk.messages if self._channels.get(m.channel_id) is MANEUVER]
        with suppress(LogError):  # it is noted where it is read
            return all(MANEUVER.decode(data)["number"] > self.last for data in ticks)
        return True

    def _of_header(self, chunk: Chunk) -> dict[Topic, bytes]:
        data = {self._channels.get(m.channel_id): m.data for m in chunk.messages}
        return {topic: data[topic] for topic in HEADER_TOPICS if topic in data}

    def _header(self) -> Header:
        """The header, from the first chunks; other programs may divide them in another way."""
        for chunk in self._chunks:
            if chunk is None:
                break
            self._first |= self._of_header(chunk)
            topics = {self._channels.get(message.channel_id) for message in chunk.messages}
            if topics.difference({None, *HEADER_TOPICS}) or len(self._first) == len(HEADER_TOPICS):
                self._chunks = chain([chunk], self._chunks)
                break
        if self._first and self._declared:
            try:
                return Header.of_messages(self._first)
            except LogError as error:
                raise LogError(f"{self.path}: {error}") from None
        ticks = sum(1 for _ in self)
        content = f"no intact header, {ticks} intact ticks; damaged places: {self.bad}"
        if self.bad:
            content += f", the first at byte {self.damage[0].offset}: {self.damage[0].reason}"
        if self.end is not None and not (self.bad or ticks):
            content = "one of another program"
        raise LogError(f"{self.path}: expected a log of antennate, an MCAP file, found {content}")

    def _note(self, offset: int, reason: str) -> None:
        self.bad += 1
        if self.bad <= _LISTED:
            self.damage.append(Damage(offset, reason, self._part))


def _comes_again(topic: Topic, group: Sequence[Record]) -> bool:
    """Whether a group already has the message of this topic that a tick has once."""
    return topic not in _BESIDE and any(record.topic is topic for record in group)


def count(path: Path) -> int:
    """Ticks that can be read from a log, all its files, even if the first was never begun."""
    try:
        with LogReader(path) as log:
            return sum(1 for _ in log)
    except LogError:
        ticks = 0
    for later in parts(path)[1:]:
        with suppress(LogError), LogReader(later) as log:
            ticks += sum(1 for _ in log)
    return ticks


def recover(path: Path, target: Path, overwrite: bool = False) -> LogReader:
    """Write all that can be read of a log, all its files, to one new file with its summary.

    An event at its end says what was left out.

    Args:
        path: The log.
        target: The new file; it is there once all of it is written.
        overwrite: Whether it may replace a file.

    Returns:
        The reader, at the end: how many ticks there are, and what is damaged or missing.
    """
    with LogReader(path) as log, replacing(target, overwrite) as fresh:
        room = 1.5 * sum(part.stat().st_size for part in log.parts)
        out = LogWriter(fresh, log.header, room, flush=math.inf, called=target)
        with fresh.open("rb") as file:
            lock(file)
            for records, _ in log.groups():
                for record in records:
                    out.add(*record)
                out.settle()
            words = f"recovered by antennate {__version__}: {log.ticks} ticks; {left_out(log)}"
            out.event(words, "antennate log recover")
            out.close()
        if not log.ticks and log.bad:
            raise LogError(f"{path}: expected intact ticks, found none; {left_out(log)}")
    return log


def left_out(log: LogReader) -> str:
    """What could not be taken of a log that is read."""
    return f"damaged places left out: {log.bad}; ticks missing: {log.missing}"
