"""Makes a log that other programs open of one whose program was killed."""

from __future__ import annotations

import math
from pathlib import Path

from antennate import __version__
from antennate.errors import LogError
from antennate.telemetry.reader import LogReader
from antennate.telemetry.topics import EVENTS
from antennate.telemetry.writer import LogWriter

_WARN = 30


def recover(path: Path, target: Path) -> LogReader:
    """Write all that can be read of a log, all its files, to one new file with its summary.

    An event at its end says what was left out.

    Returns:
        The reader, at the end: how many ticks there are, and what is damaged or missing.

    Raises:
        LogError: There is no log, or the target exists or cannot be written; nothing is left then.
    """
    with LogReader(path) as log:
        room = sum(part.stat().st_size for part in log.parts)
        out = LogWriter(target, log.header, 1.5 * room, flush=math.inf)
        try:
            last = 0
            for records, _ in log.groups():
                for record in records:
                    out.add(*record)
                    last = max(last, record.time)
                out.settle()
            words = (
                f"recovered by antennate {__version__}: {log.ticks} ticks; damaged places left "
                f"out: {log.bad}; ticks missing: {log.missing}"
            )
            time = divmod(last, 10**9)
            event = EVENTS.type.encode(*time, _WARN, "antennate log recover", words, "", "", 0)
            out.add(EVENTS, 0, last, event)
            out.close()
        except LogError:
            target.unlink(missing_ok=True)
            raise
    return log
