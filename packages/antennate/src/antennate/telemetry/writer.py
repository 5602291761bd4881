"""Writes one log: an MCAP file of ROS 2 messages, chunk by chunk.

A chunk is closed and handed to the operating system, in one piece, `FLUSH` after its first tick. So
a program that is killed loses the ticks of that time and no other. A power cut may lose what the
system still holds: all of the file, or with `sync` no more than the disk is late. Chunks hold whole
ticks and are compressed; each has a CRC.
"""

from __future__ import annotations

import contextlib
import io
import math
import os
import sys
import threading
import time
from collections.abc import Mapping
from itertools import accumulate
from pathlib import Path
from typing import IO, Any, cast

import numpy as np

from antennate import __version__
from antennate.errors import LogError, reason
from antennate.files import require_room
from antennate.telemetry.header import LIBRARY, Header
from antennate.telemetry.ticks import Columns, Tick, messages_of, ticks_of, uniform
from antennate.telemetry.topics import EVENTS, PROTOCOL, Topic, topics_of

LEAST_FREE = 1e9
"""Room for six hours of ticks at 100 Hz [byte] (assumed)."""
FLUSH = 0.2
"""Time after which the next tick closes a chunk [s], so that a tick waits 0.25 s at most."""
SYNC = 0.5
"""Time between two waits for the disk in real time [s], so that a power cut costs less than 1 s."""
_CHUNK = 1 << 20
"""Bytes after which it is closed sooner, as where simulated time runs fast."""
_NUMBERS = 0xFFFFFFFF
"""A message's number has 32 bits."""
_LATEST = (2**31 - 1) * 10**9
"""No message is later [ns]: seconds have 32 bits in ROS 2, up to the year 2038."""
_LONGEST = 1e9
"""Longest time of a tick that is one [s]; a NaN is none either."""
_LEVELS = {"HOLD": 30, "FAULT": 50, "OFF": 20, "DEGRADED": 30}
"""Levels of rcl_interfaces/msg/Log: 20 INFO, 30 WARN, 50 FATAL."""


class LogWriter:
    """One file, new; as a context it closes itself.

    Args:
        path: A file that does not exist yet.
        header: What stands at its beginning.
        least_free: Free space below which it is not begun [byte].
        flush: Time after which ticks are handed to the operating system [s].
        sync: Time after which the disk is asked to have them too, by a thread that `close` ends
            [s]; None for only at the end.
        called: The file that errors name; None for its own path.

    Attributes:
        path: Where it is.
        written: Ticks taken.
        kept: Those of them that the operating system has.
        failure: Why writing has ended, empty while it goes on.

    Raises:
        LogError: The file exists or cannot be written, or the disk is nearly full.
    """

    def __init__(
        self,
        path: Path,
        header: Header,
        least_free: float = LEAST_FREE,
        flush: float = FLUSH,
        sync: float | None = None,
        called: Path | None = None,
    ) -> None:
        from mcap.writer import Writer  # slow to import

        self.path, self._header, self._flush = path, header, flush
        self._names = header.robot.joint_names
        self.written = self.kept = self._size = self._time = 0
        self._since, self._state = math.inf, ""
        self._told: set[str] = set()  # causes of this state
        self.failure = ""
        self._called = called or path
        require_room(self._called, least_free, LogError)
        self._file = _NewFile(path, self._called)
        # `settle` closes its chunks
        self._mcap = Writer(cast(IO[Any], self._file), chunk_size=sys.maxsize)
        self._mcap.start("ros2", f"{LIBRARY}{__version__}")
        self._channels = self._register()
        for topic, data in header.messages().items():
            self.add(topic, 0, header.start, data)
        self.flush()
        if sync is not None and not self.failure:
            self._file.keep_safe(sync)

    def _register(self) -> dict[Topic, int]:
        topics = topics_of(self._header.robot.has_imu)
        kinds = {topic.type.name: topic.type for topic in topics}
        schemas = {
            name: self._mcap.register_schema(name, "ros2msg", kind.schema.encode())
            for name, kind in kinds.items()
        }
        return {
            topic: self._mcap.register_channel(topic.name, "cdr", schemas[topic.type.name])
            for topic in topics
        }

    def write(self, tick: Tick) -> None:
        """Add a tick. After a failure or `close` it does nothing.

        Raises:
            LogError: A number does not fit; or the disk is full or gone, which is raised once, and
                what was written stays readable.
        """
        if self.failure:
            return
        stamp = self._stamp(tick.now)
        messages = [*tick.messages(self._names, stamp)]
        named = {cause.partition(":")[0] for cause in tick.causes}
        if tick.state != self._state:
            self._told.clear()
        if tick.state != self._state or not named <= self._told:
            messages.append((EVENTS, self._event(tick, stamp)))
            self._told |= named
        messages += [(EVENTS, _of_protocol(text, stamp)) for text in tick.events]
        for topic, data in messages:
            self.add(topic, tick.number, stamp, data)
        self._state = tick.state
        self.written += 1
        self.settle()

    def write_many(self, columns: Columns, beside: Mapping[int, Mapping[Topic, bytes]]) -> None:
        """Add ticks as `write` does one by one; their numbers follow the last one's.

        It is much faster where no tick has a supervisor, nor counts what went wrong.

        Args:
            columns: Numbers of the ticks, and texts.
            beside: More messages of a tick's time, by its place in the columns and by topic.

        Raises:
            LogError: As for `write`.
        """
        if self.failure:
            return
        if self._state or not uniform(columns):
            for place, tick in enumerate(ticks_of(columns, self.written + 1)):
                self.write(tick)
                for topic, data in beside.get(place, {}).items():
                    self.add(topic, tick.number, self._time, data)
            return
        self._since = min(self._since, time.monotonic())
        stamps = [*accumulate(map(self._stamp, columns["now"].tolist()), max)]
        numbers = self.written + 1 + np.arange(len(stamps))
        made = messages_of({**columns, "number": numbers}, self._names, np.array(stamps))
        messages = {topic: each for topic, each in made.items() if topic in self._channels}
        channels, add = [self._channels[topic] for topic in messages], self._mcap.add_message
        size = sum(len(each[0]) for each in messages.values())
        for place, (stamp, *row) in enumerate(zip(stamps, *messages.values(), strict=True)):
            self.written += 1
            number = self.written & _NUMBERS
            for channel, data in zip(channels, row, strict=True):
                add(channel, stamp, data, stamp, number)
            self._size += size
            for topic, data in beside.get(place, {}).items():
                self.add(topic, number, stamp, data)
            if self._size >= _CHUNK:
                self.flush()
        self._time = stamps[-1]
        self.settle()

    def add(self, topic: Topic, number: int, stamp: int, data: bytes) -> None:
        """Add a message as it is, of a tick and a time [ns], not before the last one's.

        It is not counted as a tick. One of a topic that its robot has not is left out.
        """
        if self.failure or topic not in self._channels:
            return
        self._since = min(self._since, time.monotonic())
        self._size += len(data)
        self._time = max(self._time, stamp)
        channel, now = self._channels[topic], self._time
        self._mcap.add_message(channel, now, data, now, number & _NUMBERS)

    def event(self, text: str, source: str = "antennate", t: float = 0.0) -> None:
        """Add an event at a time of the loop [s], not before the last tick."""
        stamp = self._stamp(t)
        time = divmod(min(stamp, _LATEST), 10**9)
        data = EVENTS.type.encode(*time, _LEVELS["DEGRADED"], source, text, "", "", 0)
        self.add(EVENTS, self.written, stamp, data)

    def settle(self) -> None:
        """Hand over what has waited long enough; to be called where no tick may follow for a while.

        Raises:
            LogError: The disk is full or gone.
        """
        if time.monotonic() - self._since >= self._flush or self._size >= _CHUNK:
            self.flush()

    def flush(self) -> None:
        """Hand over what waits to the operating system.

        Raises:
            LogError: The disk is full or gone.
        """
        if self.failure:
            return
        try:
            self._mcap.flush()
        except OSError as error:
            self._fail(error)
        self.kept, self._size = self.written, 0
        self._since = math.inf

    def close(self) -> None:
        """Write the summary, and wait until the disk has all.

        Raises:
            LogError: That failed.
        """
        if self.failure:
            return
        self.flush()
        try:
            self._mcap.finish()
            self._file.flush()
            self._file.sync()
        except OSError as error:
            self._fail(error)
        self.failure = "it is closed"
        self._file.close()

    def __enter__(self) -> LogWriter:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _stamp(self, now: float) -> int:
        """Time of messages [ns], never before the last one's."""
        since = round(1e9 * now) if abs(now) < _LONGEST else 0
        return max(self._time, min(max(0, self._header.start + since), _LATEST))

    def _event(self, tick: Tick, stamp: int) -> bytes:
        before = f" after {self._state}" if self._state not in ("", tick.state) else ""
        words = "; ".join([f"{tick.state or 'no state'}{before}", *tick.causes])
        level = _LEVELS.get(tick.state, 20)
        time = divmod(stamp, 10**9)
        return EVENTS.type.encode(*time, level, "supervisor", words, "", "", 0)

    def _fail(self, error: OSError) -> None:
        self.failure, left = reason(error), f"the log ends after {self.kept} ticks"
        if isinstance(error, _GoneError):
            left, self.kept = f"{self.kept} ticks went with it", 0
        with contextlib.suppress(OSError):
            self._file.close()
        raise LogError(f"expected to write {self._called}, found: {self.failure}; {left}") from None


def _of_protocol(text: str, stamp: int) -> bytes:
    """An event of a protocol: a step that begins or ends."""
    time = divmod(stamp, 10**9)
    return EVENTS.type.encode(*time, _LEVELS["OFF"], PROTOCOL, text, "", "", 0)


class _GoneError(OSError):
    """A file that is written has lost its name: what it takes, nobody can read."""


class _NewFile(io.BufferedIOBase):
    """A new file that takes what was written to it in one piece, once it is flushed."""

    def __init__(self, path: Path, called: Path) -> None:
        self._held, self._at, self._file = bytearray(), 0, -1
        self._path, self._over, self._lost = path, threading.Event(), ""
        self._syncing: threading.Thread | None = None
        try:
            self._file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o644)
        except FileExistsError:
            raise LogError(
                f"expected a log that does not exist yet, found {called}; choose another name"
            ) from None
        except OSError as error:
            raise LogError(f"expected to write {called}, found: {reason(error)}") from None

    def write(self, data: bytes) -> int:  # type: ignore[override]
        """Hold it until the next flush."""
        self._held += data
        return len(data)

    def tell(self) -> int:
        """Where the next byte comes."""
        return self._at + len(self._held)

    def flush(self) -> None:
        """Hand over what is held."""
        data, self._held = self._held, bytearray()
        if self._lost:
            raise OSError(self._lost)
        self._require_name()
        if not data:
            return
        count = os.write(self._file, data)
        self._at += count
        if count < len(data):
            raise OSError(f"only {count} of {len(data)} bytes were taken; the disk is full")

    def _require_name(self) -> None:
        """Whether it is still where it was made; a file that was removed goes on to take bytes."""
        try:
            there = os.path.samestat(self._path.stat(), os.fstat(self._file))
        except (FileNotFoundError, NotADirectoryError):
            there = False
        if not there:
            raise _GoneError("it was removed or renamed meanwhile")

    def sync(self) -> None:
        """Wait until the disk has it."""
        os.fsync(self._file)

    def keep_safe(self, period: float) -> None:
        """From now on let a thread wait for the disk every period [s], until it is closed."""
        self._syncing = threading.Thread(target=self._sync_always, args=(period,), daemon=True)
        self._syncing.start()

    def _sync_always(self, period: float) -> None:
        with contextlib.suppress(OSError):  # not every file system can
            folder = os.open(self._path.parent, os.O_RDONLY | os.O_CLOEXEC)
            try:
                os.fsync(folder)  # the name of the file
            finally:
                os.close(folder)
        try:
            while not self._over.wait(period):
                os.fdatasync(self._file)  # the bytes, if not its times
        except OSError as error:
            self._lost = reason(error)

    def close(self) -> None:
        """Close it; what is held is lost."""
        self._held.clear()
        self._over.set()
        if self._syncing is not None:
            self._syncing.join()
        if self._file >= 0:
            file, self._file = self._file, -1
            os.close(file)
