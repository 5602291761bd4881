"""Reads one log, all its files. What is damaged is left out and counted; the rest is read."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import suppress
from itertools import chain
from pathlib import Path
from typing import NamedTuple

from antennate.errors import LogError
from antennate.files import open_regular
from antennate.telemetry.chunks import Chunk, End, Fault, walk
from antennate.telemetry.header import Header
from antennate.telemetry.parts import parts
from antennate.telemetry.ticks import Tick
from antennate.telemetry.topics import (
    HEADER_TOPICS,
    MANEUVER,
    TICK_TOPICS,
    TOPICS,
    Topic,
)

_LISTED = 100
"""Most damaged places that are listed."""
_OURS = dict(enumerate(TOPICS, 1))
"""Channels of a file whose first chunk is lost."""
_OLD = re.compile(rb"\x00.[\x01-\x09]\x01", re.S)
"""How a log from before MCAP begins: its schema and the kind of its first record."""
_OLD_VERSION = re.compile(rb'"version": "([\w.+-]{1,30})"')


class Damage(NamedTuple):
    """A place that could not be read: where it begins [bytes], what is wrong, in which file."""

    offset: int
    reason: str
    path: Path


class Record(NamedTuple):
    """One message as it is: topic, number of its tick, time [ns], bytes."""

    topic: Topic
    number: int
    time: int
    data: bytes


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
        self._channels = _OURS
        self._first: dict[Topic, bytes] = {}
        self._places: Iterator[Chunk] = self._read()
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
        for _, tick in self.groups():
            if tick is not None:
                yield tick

    def groups(self) -> Iterator[tuple[list[Record], Tick | None]]:
        """All messages as they are: those of one tick, with it, then those of none, one by one.

        Raises:
            LogError: The disk fails.
        """
        for chunk in self._places:
            held: list[Record] = []
            for message in chunk.messages:
                topic = self._channels.get(message.channel)
                if topic is None or topic in HEADER_TOPICS:
                    continue
                record = Record(topic, message.number, message.time, message.data)
                if held and held[0].number != record.number:
                    yield from self._grouped(chunk.offset, held)
                    held = []
                held.append(record)
            if held:
                yield from self._grouped(chunk.offset, held)

    def _grouped(
        self, offset: int, held: list[Record]
    ) -> Iterator[tuple[list[Record], Tick | None]]:
        """The messages of one number in one chunk, as their tick if it is whole and new."""
        found = {record.topic: record.data for record in held}
        if not any(topic in found for topic in TICK_TOPICS):
            yield held, None
            return
        try:
            missing = [topic.name for topic in TICK_TOPICS if topic not in found]
            if missing:
                raise LogError(f"tick without {missing[0]}")
            tick = Tick.of_messages(found)
        except LogError as error:
            self._note(offset, str(error))
            return
        if tick.number <= self.last:
            self._note(offset, f"tick {tick.number} after {self.last}")
            return
        self.ticks += 1
        self.last = tick.number
        yield held, tick

    def __enter__(self) -> LogReader:
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()

    def _read(self) -> Iterator[Chunk]:
        """The intact chunks of all files; those of later files without their header."""
        try:
            for path in self.parts:
                if path != self.path:
                    self._file.close()
                    self._part, self._before, self.end = path, self.ticks, None
                    self._file = open_regular(path)
                for place in walk(self._file):
                    if isinstance(place, Fault):
                        self._note(*place)
                    elif isinstance(place, End):
                        ticks = (
                            count
                            for channel, count in place.counts.items()
                            if self._channels.get(channel) is MANEUVER
                        )
                        self.end = self._before + sum(ticks)
                    elif not (self._first and self._repeats(place)):
                        yield place
        except OSError as error:
            raise LogError(f"expected to read {self._part}, found: {error.strerror}") from None

    def _repeats(self, chunk: Chunk) -> bool:
        """Whether it is a header again, at the begin of a later file; another one is noted."""
        found = {
            topic: message.data
            for message in chunk.messages
            if (topic := self._channels.get(message.channel)) in HEADER_TOPICS
        }
        if found and found != self._first:
            self._note(chunk.offset, "another header")
        return bool(found)

    def _header(self) -> Header:
        chunk = next(self._places, None)
        if chunk is not None and chunk.channels:
            self._channels = self._named(chunk)
            found = {self._channels.get(m.channel): m.data for m in chunk.messages}
            self._first = {topic: found[topic] for topic in HEADER_TOPICS if topic in found}
        if self._first:
            try:
                return Header.of_messages(self._first)
            except LogError as error:
                raise LogError(f"{self.path}: {error}") from None
        self._refuse_old()
        self._places = chain(() if chunk is None else (chunk,), self._places)
        ticks = sum(1 for _ in self)
        raise LogError(
            f"{self.path}: expected a log of antennate, an MCAP file, found no intact header, "
            f"{ticks} intact ticks; damaged places: {self.bad}"
        )

    def _named(self, chunk: Chunk) -> dict[int, Topic]:
        """The topics by their channel.

        Raises:
            LogError: A topic of ours has messages of another definition.
        """
        ours = {topic.name: topic for topic in TOPICS}
        named: dict[int, Topic] = {}
        for channel, (name, kind, schema) in chunk.channels.items():
            topic = ours.get(name)
            if topic is None:
                continue
            if (kind, schema) != (topic.type.name, topic.type.schema):
                raise LogError(
                    f"{self.path}: expected {topic.type.name} as now defined in {name}, found "
                    f"{kind} of another definition; read it with the version that wrote it"
                )
            named[channel] = topic
        return named

    def _refuse_old(self) -> None:
        self._file.seek(0)
        begin = self._file.read(1 << 16)
        if _OLD.match(begin):
            version = _OLD_VERSION.search(begin)
            by = version[1].decode() if version else "of an unknown version"
            raise LogError(
                f"{self.path}: expected an MCAP file, found a log of antennate {by} from before "
                "logs were MCAP; read it with the antennate that wrote it"
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
