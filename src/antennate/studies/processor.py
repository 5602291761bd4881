"""The processor of this machine: the same seed may end differently on another model."""

from __future__ import annotations

import functools
import platform
import re
from pathlib import Path

_CPUINFO = Path("/proc/cpuinfo")


@functools.cache
def processor() -> str:
    """Its model, as the system calls it."""
    try:
        found = re.search(r"^model name\s*:\s*(.+)$", _CPUINFO.read_text(), re.M)
    except OSError:
        found = None
    return found[1].strip() if found else platform.processor() or platform.machine()


class Processor(str):
    """The model of the processor that trials ran on, where it comes among their results."""

    __slots__ = ()
