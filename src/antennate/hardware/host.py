"""The host of the loop: its monotonic clock, and real-time scheduling where that is allowed.

Linux runs a process of the real-time class SCHED_FIFO whenever it has something to do, before all
ordinary ones (sched(7)). That needs a privilege. Without it the loop runs as an ordinary process,
and a busy machine makes it miss ticks.
"""

from __future__ import annotations

import contextlib
import gc
import os
import time
from collections.abc import Iterator
from enum import Enum
from pathlib import Path


class HostClock:
    """Seconds since it was made."""

    def __init__(self) -> None:
        self._begin = time.monotonic()

    def now(self) -> float:
        """Time [s]."""
        return time.monotonic() - self._begin

    def sleep_until(self, t: float) -> None:
        """Return at time t [s], at once if it has passed."""
        left = t - self.now()
        if left > 0:
            time.sleep(left)


LEVEL = 20
"""Real-time level of the loop: above ordinary programs, below the threads of interrupts at 50
(sched(7)). The twin's is one higher."""
_NICEST = 19
_LINUX = hasattr(os, "sched_setscheduler")


class Priority(Enum):
    """How this thread is scheduled."""

    REAL_TIME = "real-time"
    ORDINARY = "ordinary"


@contextlib.contextmanager
def urgent(level: int = LEVEL) -> Iterator[Priority]:
    """Run the block before all ordinary processes if allowed; it must sleep most of the time.

    Processes and threads started inside are ordinary again. Objects made before are left out of
    garbage collection (`gc.freeze`), which would delay single ticks. Yields the scheduling that was
    granted; the real-time level is 1 to 99.
    """
    before = (os.sched_getscheduler(0), os.sched_getparam(0)) if _LINUX else None
    gc.collect()
    gc.freeze()
    try:
        yield claim(level)
    finally:
        gc.unfreeze()
        if before is not None and os.sched_getscheduler(0) != before[0]:
            _give_back(*before)


def _give_back(policy: int, param: os.sched_param) -> None:
    """Set the scheduling back as far as allowed.

    Without CAP_SYS_NICE a process cannot unset SCHED_RESET_ON_FORK (sched(7)). What it starts later
    is then ordinary, as it would be anyway.
    """
    for allowed in (policy, policy | os.SCHED_RESET_ON_FORK):
        with contextlib.suppress(OSError):
            os.sched_setscheduler(0, allowed, param)
            return


def give_way() -> None:
    """Let all threads of this process run only while nothing else wants a core, for good.

    Linux has the class SCHED_IDLE for that; each thread has its own (sched(7)).
    """
    if not _LINUX:
        os.nice(_NICEST)
        return
    for thread in Path("/proc/self/task").iterdir():
        with contextlib.suppress(OSError):  # it has ended
            os.sched_setscheduler(int(thread.name), os.SCHED_IDLE, os.sched_param(0))


def claim(level: int = LEVEL) -> Priority:
    """Ask for a real-time level for this thread, for good; the scheduling granted."""
    if not _LINUX:
        return Priority.ORDINARY
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO | os.SCHED_RESET_ON_FORK, os.sched_param(level))
    except OSError:
        return Priority.ORDINARY
    return Priority.REAL_TIME
