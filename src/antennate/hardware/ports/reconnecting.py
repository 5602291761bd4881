"""A port that comes back: whatever was unplugged is looked for, and the loop never waits for it."""

from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Callable
from queue import Empty, SimpleQueue
from typing import TypeVar

from antennate.errors import reason
from antennate.port import Line, Port, PortError

RETRY = 0.2
"""Time between two looks for a port that is gone [s]; short beside the handling of a plug
(assumed)."""
_FAREWELL = 1.0
"""Longest that closing waits for a look that is under way [s]; one takes a tenth (assumed)."""


_Result = TypeVar("_Result")


def in_background(work: Callable[[], None]) -> threading.Thread:
    """Do it in a thread that does not keep the program alive."""
    thread = threading.Thread(target=work, name="port", daemon=True)
    thread.start()
    return thread


class Reconnecting(Port):
    """A port that is opened again after it was lost; for one thread.

    While it is gone each call raises PortError at once, and so does the constructor if it cannot be
    opened the first time. Opening and closing may take long, so they happen in the background.

    Args:
        find: Finds and opens it.
        clock: Monotonic time [s].
        start: Does work in the background.
    """

    def __init__(
        self,
        find: Callable[[], Line],
        clock: Callable[[], float] = time.monotonic,
        start: Callable[[Callable[[], None]], threading.Thread | None] = in_background,
    ) -> None:
        self._find, self._clock, self._start = find, clock, start
        self._line: Line | None = find()
        self._old: Line | None = None
        self._results: SimpleQueue[Line | PortError] = SimpleQueue()
        self._looking = self._closed = False
        self._lock = threading.Lock()
        self._thread: threading.Thread | None = None
        self._due = 0.0
        self._why = ""

    def write(self, data: bytes) -> None:
        """Send all of it."""
        self._use(lambda line: line.write(data))

    def read(self, most: int, timeout: float) -> bytes:
        """What has come, empty if nothing comes within `timeout` [s]."""
        return self._use(lambda line: line.read(most, timeout))

    def drain(self) -> int:
        """Throw away what has come; how many bytes that was."""
        return self._use(lambda line: line.drain())

    def _use(self, action: Callable[[Line], _Result]) -> _Result:
        line = self._there()
        try:
            return action(line)
        except PortError as error:
            self._old, self._line = line, None
            self._due = self._clock() + RETRY
            self._why = reason(error)
            raise

    def close(self) -> None:
        """Let it go for good; a look that lasts longer lets go of what it finds by itself."""
        with self._lock:
            self._closed = True
        if self._thread is not None:
            self._thread.join(_FAREWELL)
        self._collect()
        for line in (self._line, self._old):
            _close(line)
        self._line = self._old = None
        self._due = float("inf")

    def _there(self) -> Line:
        """The port, if it is there; looks for it now and then if not."""
        if self._looking:
            self._collect()
        if self._line is not None:
            return self._line
        if not self._looking and self._clock() >= self._due:
            self._looking = True
            self._thread = self._start(self._look)
            self._collect()
        if self._line is None:
            raise PortError(self._why)
        return self._line

    def _look(self) -> None:
        """In the background: let go of the old one, find the new one."""
        old, self._old = self._old, None
        try:
            _close(old)
            found: Line | PortError = self._find()
        except PortError as error:
            found = error
        except Exception as error:  # noqa: BLE001 a thread that ends would never look again
            found = PortError(f"could not look for the port: {type(error).__name__}: {error}")
        with self._lock:
            if not self._closed:
                self._results.put(found)
                return
        if not isinstance(found, PortError):
            _close(found)

    def _collect(self) -> None:
        with contextlib.suppress(Empty):
            found = self._results.get_nowait()
            self._looking = False
            if isinstance(found, PortError):
                self._due = self._clock() + RETRY
                self._why = str(found)
            else:
                self._line = found


def _close(line: Line | None) -> None:
    if line is not None:
        with contextlib.suppress(PortError):
            line.close()
