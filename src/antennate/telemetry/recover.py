"""Makes a log that other programs open of one whose program was killed."""

from __future__ import annotations

import math
from pathlib import Path

from antennate import __version__
from antennate.errors import LogError
from antennate.files import lock, replacing
from antennate.telemetry.reader import LogReader
from antennate.telemetry.writer import LogWriter

RECOVERED = "-recovered"
"""What the name of a recovered log has behind that of the log."""


def recover(path: Path, target: Path, overwrite: bool = False) -> LogReader:
    """Write all that can be read of a log, all its files, to one new file with its summary.

    An event at its end says what was left out.

    Args:
        path: The log.
        target: The new file; it is there once all of it is written.
        overwrite: Whether it may replace a file.

    Returns:
        The reader, at the end: how many ticks there are, and what is damaged or missing.

    Raises:
        LogError: There is no log, nothing of it is intact, or the disk is full.
        OutputError: The target exists or cannot be written. Nothing is left after an error.
    """
    with LogReader(path) as log, replacing(target, overwrite) as fresh:
        room = 1.5 * sum(part.stat().st_size for part in log.parts)
        out = LogWriter(fresh, log.header, room, flush=math.inf, called=target)
        with fresh.open("rb") as file:
            lock(file)
            for records, _ in log.groups():
                for record in records:
                    out.add(*record)
                out.settle()
            words = f"recovered by antennate {__version__}: {log.ticks} ticks; {left_out(log)}"
            out.event(words, "antennate log recover")
            out.close()
        if not log.ticks and log.bad:
            raise LogError(f"{path}: expected intact ticks, found none; {left_out(log)}")
    return log


def left_out(log: LogReader) -> str:
    """What could not be taken of a log that is read."""
    return f"damaged places left out: {log.bad}; ticks missing: {log.missing}"
