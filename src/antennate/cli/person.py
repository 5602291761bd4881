"""A person at a terminal, or a script on standard input: what is asked, shown and answered."""

from __future__ import annotations

import os
import select
import sys
import termios
import time
from collections.abc import Callable

from antennate.cli.status import StatusLine
from antennate.errors import BadInputError
from antennate.messages import shortened

PATIENCE = 60.0
"""Longest wait for an answer that is not typed on a terminal [s] (assumed)."""
_CHUNK = 1024


class TerminalPerson:
    """Writes to stderr and reads lines from stdin, on a terminal as from a pipe.

    On a terminal what was typed before a question is no answer to it.
    """

    def __init__(self, now: Callable[[], float] = time.monotonic) -> None:
        self._status, self._now = StatusLine(), now
        self._pending = b""
        self._asked, self._since = "", now()

    def say(self, text: str) -> None:
        """Tell something that stays to be read."""
        self._asked, self._since = text, self._now()
        self._status.say(text)

    def show(self, text: str) -> None:
        """Show live numbers in place of those shown before."""
        if self._status.due(self._now()):
            self._status.show(text)

    def ask(self, text: str) -> str:
        """Ask and wait: the answer in lower case, empty for Enter alone.

        Raises:
            BadInputError: No answer can come.
        """
        if sys.stdin is not None and sys.stdin.isatty():
            termios.tcflush(sys.stdin, termios.TCIFLUSH)
            self._pending = b""
        self.say(text)
        while (answer := self._line(1.0)) is None:
            pass
        return answer

    def answer(self) -> str | None:
        """An answer that has come since `ask` or `say`, without waiting; None so far.

        Raises:
            BadInputError: No answer can come.
        """
        return self._line(0.0)

    def close(self) -> None:
        """End the line of live numbers."""
        self._status.close()

    def _line(self, wait: float) -> str | None:
        handle = self._handle()
        while b"\n" not in self._pending and select.select([handle], [], [], wait)[0]:
            data = os.read(handle, _CHUNK)
            if not data:
                raise self._unanswered("the end of the input")
            self._pending += data
        if b"\n" not in self._pending:
            if not os.isatty(handle) and self._now() > self._since + PATIENCE:
                raise self._unanswered(f"none in {PATIENCE:g} s on an input that is no terminal")
            return None
        line, _, self._pending = self._pending.partition(b"\n")
        return line.decode("utf-8", "replace").strip().lower()

    def _handle(self) -> int:
        try:
            return sys.stdin.fileno()
        except (AttributeError, OSError, ValueError):
            raise self._unanswered("no standard input") from None

    def _unanswered(self, found: str) -> BadInputError:
        self.close()
        return BadInputError(f"expected an answer to {shortened(self._asked)!r}, found {found}")
