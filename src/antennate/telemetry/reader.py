"""Reads one log, all its files. What is damaged is left out and counted; the rest is read."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from itertools import chain
from pathlib import Path
from typing import NamedTuple, Never

from antennate.errors import LogError, reason
from antennate.files import in_units, open_regular
from antennate.telemetry.chunks import Fault
from antennate.telemetry.contents import Chunk
from antennate.telemetry.header import Header, refuse_old
from antennate.telemetry.order import in_order
from antennate.telemetry.parts import parts
from antennate.telemetry.records import BESIDE, Record, by_tick, repeats
from antennate.telemetry.summary import End
from antennate.telemetry.survey import Survey, by_summary, span
from antennate.telemetry.ticks import Tick
from antennate.telemetry.topics import (
    EVENTS,
    HEADER_TOPICS,
    MANEUVER,
    TICK_TOPICS,
    TOPICS,
    Topic,
    by_channel,
)

_LISTED = 100
"""Most damaged places that are listed."""
_OURS = dict(enumerate(TOPICS, 1))
"""Channels of a file that declares none, as its first chunk is lost."""
_HELD = 1 << 25
"""Most bytes of messages of one time."""
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

    Raises:
        LogError: The file cannot be read, or has no header; says what can be read of it.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.ticks = self.last = self.bad = self._repeated = 0
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
        self._schemas: dict[int, tuple[str, str]] = {}
        self._first: dict[Topic, bytes] = {}
        self._places: Iterator[Chunk] = self._read()
        try:
            self.header = self._header()
        except LogError:
            self._file.close()
            raise

    @property
    def _channels(self) -> Mapping[int, Topic]:
        """The topics by their channel, as far as they are known."""
        return self._declared or _OURS

    @property
    def missing(self) -> int:
        """Ticks known to have been written or to have happened that were not read."""
        after = 0 if self.end is None else max(0, self.end - self._repeated - self.ticks)
        return max(after, self.last - self.ticks)

    def __iter__(self) -> Iterator[Tick]:
        """The ticks, in order.

        Raises:
            LogError: The disk fails.
        """
        for _, tick in self.groups():
            if tick is not None:
                yield tick

    def require_ticks(self) -> None:
        """Require that some have been read.

        Raises:
            LogError: There are none.
        """
        if not self.ticks:
            why = f": {self.damage[0].reason} at byte {self.damage[0].offset}" if self.bad else ""
            raise LogError(f"{self.path}: expected a log with ticks, found none{why}")

    def groups(self) -> Iterator[tuple[Sequence[Record], Tick | None]]:
        """All messages as they are: those of one tick, with it, then those of none, one by one.

        Raises:
            LogError: The disk fails.
        """
        held, begin, size = list[Record](), 0, 0
        for chunk in self._places:
            self._learn(chunk)
            for message in chunk.messages:
                topic = self._channels.get(message.channel)
                if topic is None or topic in HEADER_TOPICS:
                    continue
                record = Record(topic, message.number, message.time, message.data)
                if held and held[0].time != record.time:
                    yield from self._by_tick(begin, held)
                    held = []
                begin, size = (begin, size) if held else (chunk.offset, 0)
                size += len(record.data) + _EACH
                if size > _HELD:
                    self._refuse_one_time(chunk.offset)
                held.append(record)
            if held and not chunk.foreign:
                yield from self._by_tick(begin, held)
                held = []
        yield from self._by_tick(begin, held)

    def _refuse_one_time(self, offset: int) -> Never:
        raise LogError(
            f"{self._part}: expected at most {in_units(_HELD)} of messages of one time, "
            f"found more at byte {offset}"
        )

    def _by_tick(
        self, offset: int, held: Sequence[Record]
    ) -> Iterator[tuple[Sequence[Record], Tick | None]]:
        """The messages of one time, tick by tick."""
        ticks = by_tick(held, doubled=self._repeated > 0)
        self._repeated += _maneuvers(held) - sum(map(_maneuvers, ticks))
        for tick in ticks:
            yield from self._grouped(offset, tick)

    def survey(self) -> Survey:
        """What all of it holds, and what is damaged or missing.

        Of a log of antennate, closed, in one file, little but events is decoded: its summary tells
        the rest, and the CRC of each chunk is checked. All others are read as by `groups`.

        Raises:
            LogError: The disk fails.
        """
        found = self._summarised()
        if found is not None:
            self.ticks = self.end = found.messages.get(MANEUVER, 0)
            self.last = found.number
            return found
        counts, events, times = Counter[Topic](), list[tuple[int, bytes]](), list[int]()
        for records, tick in self.groups():
            counts.update(record.topic for record in records)
            events += [(record.time, record.data) for record in records if record.topic is EVENTS]
            if tick is not None:
                times = [*times[:1], records[0].time]
        kept = {topic: counts[topic] for topic in TOPICS if counts[topic]}
        return Survey(kept, events, *span(times), self.last)

    def _summarised(self) -> Survey | None:
        if len(self.parts) > 1:
            return None
        try:
            return by_summary(self._file, self._channels)
        except OSError as error:
            raise LogError(f"expected to read {self._part}, found: {reason(error)}") from None

    def _grouped(
        self, offset: int, held: Sequence[Record]
    ) -> Iterator[tuple[Sequence[Record], Tick | None]]:
        """The messages of one tick, with it if it is whole and new.

        Those beside the tick that are not of their type are left out.
        """
        held = [each for each in held if each.topic not in BESIDE or self._is_sound(offset, each)]
        found = {record.topic: record.data for record in held}
        if not any(topic in found for topic in TICK_TOPICS):
            if held:
                yield held, None
            return
        try:
            missing = [topic.name for topic in TICK_TOPICS if topic not in found]
            if missing:
                raise LogError(f"tick without {missing[0]}")
            if repeats(held):
                raise LogError("tick with two messages in a topic")
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

    def _read(self) -> Iterator[Chunk]:
        """The intact chunks of all files; those of later files without their header."""
        closed = None
        try:
            for path in self.parts:
                if path != self.path:
                    self._file.close()
                    self._part, self._before, closed = path, self.ticks, self.end
                    self.end, self._file = None, open_regular(path)
                for place in in_order(self._file):
                    if isinstance(place, Fault):
                        self._note(*place)
                    elif isinstance(place, End):
                        ticks = (
                            count
                            for channel, count in place.counts.items()
                            if self._channels.get(channel) is MANEUVER
                        )
                        self.end = self._before + sum(ticks)
                    elif self._is_of_this_log(place):
                        self.guarded = self.guarded and place.guarded
                        yield place
                    else:
                        self._note(place.offset, "a file of another log")
                        self.end = closed
                        break
        except OSError as error:
            raise LogError(f"expected to read {self._part}, found: {reason(error)}") from None

    def _is_of_this_log(self, chunk: Chunk) -> bool:
        """Whether a later file has the header of the first one, and ticks after its last one."""
        if self._part == self.path:
            return True
        self._learn(chunk)
        found = self._of_header(chunk)
        if any(self._first.get(topic) != data for topic, data in found.items()):
            return False
        if self.ticks > self._before:
            return True
        ticks = [m.data for m in chunk.messages if self._channels.get(m.channel) is MANEUVER]
        with suppress(LogError):  # it is noted where it is read
            return all(MANEUVER.decode(data)["number"] > self.last for data in ticks)
        return True

    def _of_header(self, chunk: Chunk) -> dict[Topic, bytes]:
        found = {self._channels.get(m.channel): m.data for m in chunk.messages}
        return {topic: found[topic] for topic in HEADER_TOPICS if topic in found}

    def _header(self) -> Header:
        """The header, from the first chunks; other programs may divide them in another way."""
        for chunk in self._places:
            self._learn(chunk)
            self._first |= self._of_header(chunk)
            topics = {self._channels.get(message.channel) for message in chunk.messages}
            if topics.difference(HEADER_TOPICS) or len(self._first) == len(HEADER_TOPICS):
                self._places = chain([chunk], self._places)
                break
        if self._first and self._declared:
            try:
                return Header.of_messages(self._first)
            except LogError as error:
                raise LogError(f"{self.path}: {error}") from None
        self._file.seek(0)
        refuse_old(self.path, self._file.read(1 << 16))
        ticks = sum(1 for _ in self)
        found = f"no intact header, {ticks} intact ticks; damaged places: {self.bad}"
        if self.bad:
            found += f", the first at byte {self.damage[0].offset}: {self.damage[0].reason}"
        if self.end is not None and not (self.bad or ticks):
            found = "one of another program"
        raise LogError(f"{self.path}: expected a log of antennate, an MCAP file, found {found}")

    def _learn(self, chunk: Chunk) -> None:
        """Take note of the channels that a chunk declares."""
        self._schemas |= chunk.schemas
        try:
            self._declared |= by_channel(chunk.channels, self._schemas)
        except LogError as error:
            raise LogError(f"{self.path}: {error}") from None

    def _note(self, offset: int, reason: str) -> None:
        self.bad += 1
        if self.bad <= _LISTED:
            self.damage.append(Damage(offset, reason, self._part))


def _maneuvers(held: Sequence[Record]) -> int:
    return sum(record.topic is MANEUVER for record in held)


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
