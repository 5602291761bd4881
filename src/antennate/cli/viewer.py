"""The other process of `antennate drive`: it keeps the log and shows one line.

It reads from its standard input what a `Feed` sends, and nobody waits for it. On its standard
output it says once whether the log has begun, and why it cannot be written any more.
"""

from __future__ import annotations

import contextlib
import math
import os
import re
import signal
import socket
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from antennate.cli.status import StatusLine, write
from antennate.errors import AntennateError, LogError
from antennate.hardware.driving.stopping import STOPS
from antennate.messages import one_line
from antennate.telemetry.feed import KEPT, NOT_KEPT, Message, messages
from antennate.telemetry.header import Header
from antennate.telemetry.ticks import Tick
from antennate.telemetry.view.channel import HEADER, STATE, TICK, Channel
from antennate.telemetry.view.pace import RATE
from antennate.telemetry.writer import SYNC, LogWriter
from antennate.types import Maneuver

REQUIRED, PAGE = "required", "page="
_STDOUT = 1
_BEFORE = re.compile(r"(HOLD|FAULT|OFF) (?!NOT_READY|UNKNOWN_CONTACT|UNDECIDED)")
"""A cause that is also shown while the robot is not armed."""
_ASKED = re.compile(r"touch=\((.*)\)(?= drift=|$)")
"""What a person is to do, within the note of a tick."""


class Display:
    """The ticks as they come: a status line, and above it what a person is to do."""

    def __init__(self) -> None:
        self.status = StatusLine()
        self._asked = ""

    def show(self, tick: Tick, unlogged: int) -> None:
        """Show a tick, if one is due or if something new is asked."""
        match = _ASKED.search(tick.note)
        asked = match[1] if match else ""
        if asked not in ("", self._asked) and self.status.terminal:
            self.status.say(f"{asked[0].upper()}{asked[1:]}.")
        self._asked = asked
        if self.status.due(tick.now):
            text = line(tick, unlogged)
            self.status.show(text.replace(f"({asked})", "asked") if asked else text, asked)


def line(tick: Tick, unlogged: int) -> str:
    """All counters of a tick in one line."""
    left, right = ("-" if math.isnan(counts) else f"{counts:.0f}" for counts in tick.reading)
    state = tick.state or "-"
    why = f" ({_why(state, tick.causes)})" if tick.causes else ""
    maneuver = Maneuver.label(tick.maneuver)
    return (
        f"{tick.now:7.1f} s {state}{why} maneuver={maneuver} counts={left},{right} "
        f"age={1e3 * tick.age:.0f}ms {tick.note} missed_ticks={tick.missed} "
        f"missed_answers={tick.misses} stale={tick.stale} frames={tick.frames} crc={tick.crc} "
        f"lost={tick.lost} sent={tick.sent} refused={tick.refused} unlogged={unlogged}"
    )


def _why(state: str, causes: Sequence[str]) -> str:
    """The first cause; of a robot that is not armed yet also what is wrong."""
    first, *others = causes
    why = first.removeprefix(f"{state} ")
    if why.startswith("NOT_ARMED"):
        why = "; ".join([why, *filter(_BEFORE.match, others)][:2])
    return why


class _Page:
    """Sends ticks on to the process of a live view, which is never waited for.

    Args:
        file: Number of the file that leads there.
        folder: That of the results.
    """

    def __init__(self, file: int, folder: Path) -> None:
        self._folder = folder
        self._channel = Channel(socket.socket(fileno=file))
        self._due = -math.inf

    def begin(self, first: Message) -> None:
        """The header of a log; nothing on the page can change anything."""
        with contextlib.suppress(LogError):
            header = Header.unpack(first.content)
            title = f"{header.controller} on the robot"
            theta = header.params.rule.threshold
            self._channel.tell(STATE, title=title, theta=theta, results=str(self._folder))
            self._channel.send(HEADER, first.content)

    def show(self, message: Message) -> None:
        """A tick, if a picture is due."""
        now = time.monotonic()
        if now >= self._due:
            self._due = now + 1.0 / RATE
            self._channel.send(TICK, message.content)


def _page_of(folder: Path, words: Sequence[str]) -> _Page | None:
    files = [word.removeprefix(PAGE) for word in words if word.startswith(PAGE)]
    return _Page(int(files[0]), folder) if files else None


class _Log:
    """The log, while it can be written; why it cannot is said once, here and to the loop.

    Args:
        path: Its file.
        required: Whether the robot walks only with it.

    Attributes:
        keeps: Whether it takes ticks.
    """

    def __init__(self, path: Path, required: bool) -> None:
        self._path, self._required = path, required
        self._writer: LogWriter | None = None
        self._taken, self.keeps = 0, False

    def begin(self, first: Message) -> None:
        """Begin it; the robot walks on without one that cannot be written."""
        try:
            self._writer = LogWriter(self._path, Header.unpack(first.content), sync=SYNC)
        except LogError as error:
            follows = "no command is sent" if self._required else "the robot walks on"
            say(LogError(f"{error}; {follows} without a log"))
            _answer(NOT_KEPT + str(error).encode())
        else:
            self.keeps = True
            _answer(KEPT)

    @property
    def unkept(self) -> int:
        """Ticks that came and that it lacks; those that it holds back for a moment are none."""
        kept = 0 if self._writer is None else self._writer.kept
        return 0 if self.keeps else self._taken - kept

    def write(self, tick: Tick) -> None:
        """Take one tick."""
        self._taken += 1
        self._carry_out(lambda writer: writer.write(tick))

    def settle(self) -> None:
        """Let no tick wait while none follows."""
        self._carry_out(LogWriter.settle)

    def close(self) -> None:
        """End it."""
        self._carry_out(LogWriter.close)

    def fail(self, error: LogError) -> None:
        """Take nothing more. It is not closed: so a reader sees that something went wrong."""
        say(error)
        _answer(str(error).encode())
        self.keeps = False
        if self._writer is not None:
            with contextlib.suppress(LogError):
                self._writer.flush()

    def _carry_out(self, act: Callable[[LogWriter], None]) -> None:
        if self._writer is not None and self.keeps:
            try:
                act(self._writer)
            except LogError as error:
                self.fail(error)


def _answer(data: bytes) -> None:
    """Tell the loop; if it is gone, the ticks tell it."""
    with contextlib.suppress(OSError):
        os.write(_STDOUT, data)


def main() -> int:
    """Keep and show ticks until they end; 0 if all of them are kept.

    With the word `required` after the log's path it ends with the log, and shows nothing more. With
    `page=NUMBER` it sends them on to the file of that number.
    """
    for number in (*STOPS, signal.SIGTTOU):  # the other end decides when it is over
        signal.signal(number, signal.SIG_IGN)
    display = Display()
    required = REQUIRED in sys.argv[2:]
    log = _Log(Path(sys.argv[1]), required)
    page = _page_of(Path(sys.argv[1]).parent, sys.argv[2:])
    stream = messages(sys.stdin.buffer.raw, log.settle)  # type: ignore[attr-defined]
    try:
        first = next(stream, None)
        if first is not None:
            log.begin(first)
        if page is not None and first is not None:
            page.begin(first)
        for message in stream:
            tick = Tick.unpack(message.content)
            log.write(tick)
            display.show(tick, message.dropped + log.unkept)
            if page is not None:
                page.show(message)
            if required and not log.keeps:
                break
        log.close()
    except LogError as error:  # the loop was killed
        log.fail(error)
    display.status.close()
    return int(not log.keeps)


def say(error: AntennateError) -> bool:
    """Show an error of the log on stderr, below the status line; always False."""
    write(f"\nantennate drive: {one_line(str(error))}\n")
    return False


if __name__ == "__main__":
    sys.exit(main())
