"""Which programs hold a device file, as far as Linux tells this user."""

from __future__ import annotations

import contextlib
import os
import re
from collections.abc import Iterator
from pathlib import Path

_PROC = Path("/proc")
_MASTER = "/dev/ptmx"


def holders(path: str) -> list[str]:
    """Other programs that have locked a port or have it open, as `pid 12 (name)`.

    The process that made a pseudo-terminal holds both its ends, and is left out.
    """
    found: dict[int, str] = {}
    for process in (*_lockers(path), *_openers(path)):
        with contextlib.suppress(OSError):
            name = re.sub(r"\s+", " ", (_PROC / str(process) / "comm").read_text().strip())
            found[process] = f"pid {process} ({name})"
    return [found[process] for process in sorted(found) if process != os.getpid()]


def _lockers(path: str) -> Iterator[int]:
    """Who holds a lock on it, by device and inode of the file."""
    try:
        there = Path(path).stat()
        locks = (_PROC / "locks").read_text().splitlines()
    except OSError:
        return
    device = f"{os.major(there.st_dev):02x}:{os.minor(there.st_dev):02x}:{there.st_ino}"
    for lock in locks:
        fields = lock.split()
        if device in fields and fields[fields.index(device) - 1].isdigit():
            yield int(fields[fields.index(device) - 1])


def _openers(path: str) -> Iterator[int]:
    """Who has it open."""
    device = os.path.realpath(path)
    for process in _PROC.glob("[0-9]*"):
        with contextlib.suppress(OSError):
            opened = {str(link.readlink()) for link in (process / "fd").iterdir()}
            if device in opened and _MASTER not in opened:
                yield int(process.name)
