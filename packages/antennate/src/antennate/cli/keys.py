"""What a person types, on a terminal as from a pipe: single keys, and answers to questions."""

from __future__ import annotations

import contextlib
import os
import select
import signal
import sys
import termios
import time
import tty
from collections.abc import Callable, Iterator

from antennate.cli.terminal import StatusLine
from antennate.errors import BadInputError, ConfigError
from antennate.messages import shortened

_CHUNK = 1024
_ARROWS = {b"A": "up", b"B": "down", b"C": "right", b"D": "left"}
_START = (b"\x1b[", b"\x1bO")
END = "end"
"""In place of a key: no key can come any more."""

ReadKeys = Callable[[float], list[str]]
"""Keys that have come, the first one within a time [s]."""


@contextlib.contextmanager
def typed_keys() -> Iterator[ReadKeys]:
    """Yield what reads keys: characters, and `up`, `down`, `left`, `right` for the arrows.

    A terminal gives each key at once and shows none meanwhile; it is as before afterwards. The end
    of the input is `END`, from then on.
    """
    try:
        handle = sys.stdin.fileno()
    except (AttributeError, OSError, ValueError):
        raise BadInputError("expected keys on a terminal, found no standard input") from None
    with _single_keys(handle) if os.isatty(handle) else contextlib.nullcontext():
        yield lambda wait: _read(handle, wait)


@contextlib.contextmanager
def _single_keys(handle: int) -> Iterator[None]:
    r"""Let a terminal give each key as it is typed, and show none; it is as before afterwards.

    Ctrl-C, Ctrl-\ and Ctrl-Z do what they always do.
    """
    before = termios.tcgetattr(handle)
    ignored = {n: signal.signal(n, signal.SIG_IGN) for n in (signal.SIGTTIN, signal.SIGTTOU)}
    try:
        tty.setcbreak(handle)
        termios.tcflush(handle, termios.TCIFLUSH)
        yield
    finally:
        with contextlib.suppress(termios.error):  # it is gone
            termios.tcsetattr(handle, termios.TCSAFLUSH, before)
        for number, handler in ignored.items():
            signal.signal(number, handler)


@contextlib.contextmanager
def pressed_keys(flag: str) -> Iterator[Callable[[], bool]]:
    r"""Yield a function that says, without waiting, whether a key came since its last call.

    Ctrl-C, Ctrl-\ and Ctrl-Z do what they always do. The terminal is as before afterwards.

    Args:
        flag: What needs the keys, for the error.
    """
    stdin = sys.stdin
    if stdin is None or not stdin.isatty():
        raise ConfigError(
            f"{flag}: expected a terminal as standard input, whose keys can be held, found none"
        )
    handle = stdin.fileno()
    if os.tcgetpgrp(handle) != os.getpgrp():
        raise ConfigError(f"{flag}: expected to run in the foreground of its terminal, without &")
    with _single_keys(handle):
        yield lambda: _came(handle)


def _came(handle: int) -> bool:
    """Whether something was typed; nothing comes from a terminal that is gone."""
    try:
        return bool(select.select([handle], [], [], 0.0)[0]) and bool(os.read(handle, _CHUNK))
    except OSError:
        return False


def _read(handle: int, wait: float) -> list[str]:
    try:
        if not select.select([handle], [], [], max(wait, 0.0))[0]:
            return []
        data = os.read(handle, _CHUNK)
    except OSError:  # the terminal is gone
        data = b""
    return keys_of(data) if data else [END]


def keys_of(data: bytes) -> list[str]:
    """The keys in bytes of a terminal; line breaks and other sequences are none."""
    keys: list[str] = []
    at = 0
    while at < len(data):
        if data[at : at + 2] in _START:
            keys += filter(None, [_ARROWS.get(data[at + 2 : at + 3])])
            at += 3
            continue
        letter = data[at : at + 1].decode("ascii", "ignore")
        keys += [letter] if letter.isprintable() and letter else []
        at += 1
    return keys


PATIENCE = 60.0
"""Longest wait for an answer that is not typed on a terminal [s] (assumed)."""


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
        """Ask and wait: the answer in lower case, empty for Enter alone."""
        if sys.stdin is not None and sys.stdin.isatty():
            termios.tcflush(sys.stdin, termios.TCIFLUSH)
            self._pending = b""
        self.say(text)
        while (answer := self._line(1.0)) is None:
            pass
        return answer

    def answer(self) -> str | None:
        """An answer that has come since `ask` or `say`, without waiting; None so far."""
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
