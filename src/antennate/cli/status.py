"""A status line on stderr: on a terminal over the last one, elsewhere a line a second."""

from __future__ import annotations

import contextlib
import math
import os
import sys
from textwrap import fill

from antennate.messages import one_line

_EVERY = 0.2
"""Time between two lines on a terminal [s]."""
_EVERY_PLAIN = 1.0
_COLUMNS = 80
_GAP = "... "
_END = 3
"""The end of a line without an instruction gets this part of the width."""
_CLEAR = "\r\x1b[K"


class StatusLine:
    """One line that changes; nobody needs to be there to see it.

    Attributes:
        terminal: Whether it is written over the last one.
    """

    def __init__(self) -> None:
        self.terminal = bool(
            sys.stderr and sys.stderr.isatty() and os.environ.get("TERM", "dumb") != "dumb"
        )
        self._due = -math.inf
        self._open = False

    def due(self, now: float) -> bool:
        """Whether a line is to be shown at a time [s]."""
        if now < self._due:
            return False
        self._due = now + (_EVERY if self.terminal else _EVERY_PLAIN)
        return True

    def show(self, text: str, instruction: str = "") -> None:
        """Show a line; on a terminal shortened to its width, since a line that wraps stays.

        Args:
            text: The line; its middle goes first.
            instruction: What a person is to do, behind the line; it goes last.
        """
        text = f"{text} | {instruction}" if instruction else text
        if self.terminal:
            end = len(one_line(instruction)) or (self._columns() - 1) // _END
            text = _CLEAR + shortened(one_line(text), self._columns() - 1, end)
        self._open = self.terminal
        write(text if self.terminal else text + "\n")

    def say(self, text: str) -> None:
        """Show something that stays, above the line; on a terminal broken between words."""
        if self.terminal:
            width = self._columns() - 1
            text = fill(text, width, break_long_words=False, break_on_hyphens=False)
        write(f"{_CLEAR if self._open else ''}{text}\n")
        self._open = False

    def close(self) -> None:
        """End the line."""
        if self._open:
            write("\n")
        self._open = False

    @staticmethod
    def _columns() -> int:
        """Width of the terminal on stderr; stdout may be a file."""
        try:
            return os.get_terminal_size(sys.stderr.fileno()).columns or _COLUMNS
        except (OSError, ValueError):
            return _COLUMNS


def shortened(text: str, width: int, end: int) -> str:
    """A line of at most so many characters without its middle; of its end so many stay."""
    if len(text) <= width:
        return text
    end = min(end, width)
    begin = max(0, width - end - len(_GAP))
    return f"{text[:begin]}{_GAP if begin else ''}{text[len(text) - end :]}"


def write(text: str) -> None:
    """Write on stderr; that it is closed or full is no error."""
    if sys.stderr is not None:
        with contextlib.suppress(OSError):  # it is closed or full, as with a lost terminal
            sys.stderr.write(text)
            sys.stderr.flush()
