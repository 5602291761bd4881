"""The other process of `antennate drive`: it keeps the log and shows one line.

It reads from its standard input what a `Feed` sends, and nobody waits for it. On its standard
output it says once that the log has begun.
"""

from __future__ import annotations

import contextlib
import math
import os
import shutil
import signal
import sys
from pathlib import Path

from antennate.errors import LogError
from antennate.hardware.driving.signals import STOPS
from antennate.messages import one_line
from antennate.telemetry.feed import Message, messages
from antennate.telemetry.header import Header
from antennate.telemetry.ticks import Tick
from antennate.telemetry.writer import LogWriter
from antennate.types import Maneuver

REQUIRED = "required"
_STDOUT = 1
_LINES_A_SECOND = 5


class StatusLine:
    """One line on stderr now and then, over the last one on a terminal."""

    def __init__(self) -> None:
        self._terminal = sys.stderr.isatty()
        self._every = 1.0 / _LINES_A_SECOND if self._terminal else 1.0
        self._due = -math.inf

    def show(self, message: Message) -> None:
        """Show a tick, if one is due; nobody needs to be there to see it."""
        tick = Tick.unpack(message.content)
        if tick.now >= self._due:
            self._due = tick.now + self._every
            said = line(tick, message.dropped)
            if self._terminal:  # a line that wraps could not be written over
                said = "\r\x1b[K" + said[: shutil.get_terminal_size().columns - 1]
            _write(said if self._terminal else said + "\n")


def _write(text: str) -> None:
    """Say it on stderr, or nowhere if that is gone, as with a lost terminal."""
    with contextlib.suppress(OSError):
        sys.stderr.write(text)
        sys.stderr.flush()


def line(tick: Tick, dropped: int) -> str:
    """All counters of a tick in one line."""
    left, right = ("-" if math.isnan(counts) else f"{counts:.0f}" for counts in tick.reading)
    state = tick.state or "-"
    why = " (" + tick.causes[0].removeprefix(f"{state} ") + ")" if tick.causes else ""
    return (
        f"{tick.now:7.1f} s {state}{why} maneuver={_name(tick.maneuver)} counts={left},{right} "
        f"age={1e3 * tick.age:.0f}ms {tick.note} missed_ticks={tick.missed} "
        f"missed_answers={tick.misses} stale={tick.stale} frames={tick.frames} crc={tick.crc} "
        f"lost={tick.lost} sent={tick.sent} refused={tick.refused} unlogged={dropped}"
    )


def _name(maneuver: int) -> str:
    """Of a maneuver; somebody's own controller may say anything."""
    return Maneuver(maneuver).name if maneuver in set(Maneuver) else str(maneuver)


def main() -> int:
    """Keep and show ticks until they end; 0 if all of them are kept.

    With the word `required` after the log's path it ends with the log, and shows nothing more.
    """
    for number in STOPS:  # the other end decides when it is over
        signal.signal(number, signal.SIG_IGN)
    status = StatusLine()
    kept, required = False, REQUIRED in sys.argv[2:]
    stream = messages(sys.stdin.buffer)
    try:
        first = next(stream, None)
        log = None if first is None else _begin(Path(sys.argv[1]), first)
        kept = log is not None
        if kept:
            with contextlib.suppress(OSError):  # the other end is gone; the ticks tell it
                os.write(_STDOUT, b"begun\n")
        for message in stream:
            kept = kept and _keep(log, message.content)
            status.show(message)
            if required and not kept:
                break
        if log is not None and kept:
            log.close()
    except LogError as error:
        kept = _say(error)
    return int(not kept)


def _begin(path: Path, first: Message) -> LogWriter | None:
    """The log, None if it cannot be written: the robot walks on without it."""
    try:
        return LogWriter(path, Header.unpack(first.content))
    except LogError as error:
        _say(error)
        return None


def _keep(log: LogWriter | None, content: bytes) -> bool:
    """Write one tick; a disk that fails is said once."""
    try:
        if log is not None:
            log.write(content)
    except LogError as error:
        return _say(error)
    return log is not None


def _say(error: LogError) -> bool:
    _write(f"\nantennate drive: {one_line(str(error))}\n")
    return False


if __name__ == "__main__":
    sys.exit(main())
