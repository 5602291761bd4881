"""A terminal of a given width, and what stands on it."""

from __future__ import annotations

import fcntl
import os
import pty
import re
import select
import struct
import subprocess
import termios
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field


@dataclass
class Terminal:
    """A pseudo-terminal that a process writes its stderr to.

    Attributes:
        columns: Its width.
        text: All that was written.
    """

    columns: int
    text: str = ""
    _ends: tuple[int, int] = field(default=(-1, -1))

    def __post_init__(self) -> None:
        self._ends = pty.openpty()
        size = struct.pack("HHHH", 24, self.columns, 0, 0)
        fcntl.ioctl(self._ends[1], termios.TIOCSWINSZ, size)

    def start(
        self, words: Sequence[str], environment: Mapping[str, str] | None = None, **more: object
    ) -> subprocess.Popen[bytes]:
        """Start a process there; what else it needs as for `subprocess.Popen`."""
        known = {**os.environ, "TERM": "xterm", **(environment or {})}
        known.pop("COLUMNS", None)
        options: dict = {"stdout": subprocess.DEVNULL, **more}
        process = subprocess.Popen(words, stderr=self._ends[1], env=known, **options)
        os.close(self._ends[1])
        return process

    def until(self, true: Callable[[str], object], patience: float = 60.0) -> None:
        """Read until something holds of the text, or nobody writes any more."""
        end = time.monotonic() + patience
        while not true(self.text) and time.monotonic() < end:
            if select.select([self._ends[0]], [], [], 0.1)[0]:
                try:
                    self.text += os.read(self._ends[0], 65536).decode()
                except OSError:  # the other end is closed
                    os.close(self._ends[0])
                    return

    @property
    def rows(self) -> list[str]:
        """The rows that were seen, those written over included; long ones as the terminal wraps."""
        lines = re.sub(r"\x1b\[[0-9;]*[A-Za-z]", "", self.text).replace("\r", "\n").split("\n")
        return [
            line[at : at + self.columns]
            for line in lines
            for at in range(0, len(line), self.columns)
        ]


def read_all(end: int, process: subprocess.Popen[bytes], patience: float = 120.0) -> str:
    """All that is written to a pseudo-terminal until its process has ended; closes it."""
    text, limit = b"", time.monotonic() + patience
    while time.monotonic() < limit:
        if select.select([end], [], [], 0.1)[0]:
            try:
                text += os.read(end, 65536)
            except OSError:  # the other end is closed
                break
        elif process.poll() is not None:
            break
    process.wait(patience)
    os.close(end)
    return text.decode(errors="replace")
