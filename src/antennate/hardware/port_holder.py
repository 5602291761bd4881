"""Which program holds a device file, as far as Linux tells."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path

_PROC = Path("/proc")


def holder(path: str) -> str:
    """The program that has locked a device, or else one that has it open.

    Returns:
        For instance "held by process 4711 (antennate)"; empty if none is found, as without rights
        to look.
    """
    for what, find in (("held by", _lockers), ("open in", _openers)):
        for process in find(path):
            with contextlib.suppress(OSError):
                name = (_PROC / str(process) / "comm").read_text().strip()
                return f"{what} process {process} ({name})"
    return ""


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
    """Who else has it open."""
    device = str(Path(path).resolve())
    for entry in _PROC.glob("[0-9]*/fd/*"):
        with contextlib.suppress(OSError):
            process = int(entry.parts[2])
            if str(entry.readlink()) == device and process != os.getpid():
                yield process
