"""Writes one log, record by record.

Each record goes to the operating system at once: a program that is killed loses none that `write`
has returned from. A power cut may lose what the system still holds.
"""

from __future__ import annotations

import contextlib
import os
import shutil
from pathlib import Path

from antennate.errors import LogError
from antennate.telemetry.framing import SCHEMA, Kind, framed
from antennate.telemetry.header import Header
from antennate.telemetry.ticks import Tick

LEAST_FREE = 1e9
"""Room for seven hours of ticks at 100 Hz [byte], three with many causes (assumed)."""


class LogWriter:
    """One file, new; as a context it closes itself.

    Args:
        path: A file that does not exist yet.
        header: What stands at its beginning.
        least_free: Free space below which it is not begun [byte].

    Attributes:
        path: Where it is.
        written: Ticks written.
        failure: Why writing has ended, empty while it goes on.

    Raises:
        LogError: The file exists or cannot be written, or the disk is nearly full.
    """

    def __init__(self, path: Path, header: Header, least_free: float = LEAST_FREE) -> None:
        self.path = path
        self.written = 0
        self.failure = ""
        self._require_room(least_free)
        try:
            self._file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o644)
        except FileExistsError:
            raise LogError(
                f"expected a log that does not exist yet, found {path}; choose another name"
            ) from None
        except OSError as error:
            raise LogError(f"expected to write {path}, found: {error.strerror}") from None
        self._put(header.pack())

    def write(self, tick: Tick | bytes) -> None:
        """Add a tick, packed or not. After a failure or `close` it does nothing.

        Raises:
            LogError: The disk is full or gone; raised once; what was written stays readable.
        """
        if not self.failure:
            self._put(tick.pack() if isinstance(tick, Tick) else tick)
            self.written += 1

    def close(self) -> None:
        """Say that the log ends here, and wait until the disk has it.

        Raises:
            LogError: That failed.
        """
        if self.failure:
            return
        self._put(bytes((SCHEMA, Kind.END)) + self.written.to_bytes(8, "little"))
        self.failure = "it is closed"
        try:
            os.fsync(self._file)
        except OSError as error:
            raise LogError(f"expected to write {self.path}, found: {error.strerror}") from None
        finally:
            os.close(self._file)

    def __enter__(self) -> LogWriter:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _put(self, content: bytes) -> None:
        data = framed(content)
        try:
            if (count := os.write(self._file, data)) == len(data):
                return
            self.failure = f"only {count} of {len(data)} bytes were taken; the disk is full"
        except OSError as error:
            self.failure = str(error.strerror)
        with contextlib.suppress(OSError):
            os.close(self._file)
        raise LogError(
            f"expected to write {self.path}, found: {self.failure}; the log ends after "
            f"{self.written} ticks"
        )

    def _require_room(self, least: float) -> None:
        try:
            free = shutil.disk_usage(self.path.parent).free
        except OSError as error:
            raise LogError(
                f"expected a folder to write {self.path}, found: {error.strerror}"
            ) from None
        if free < least:
            raise LogError(
                f"expected {1e-9 * least:g} GB free for {self.path}, found {1e-9 * free:.2g} GB"
            )
