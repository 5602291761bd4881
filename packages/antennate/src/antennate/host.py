r"""The host of a program: its monotonic clock, real-time scheduling, and signals that ask to end.

Linux runs a process of the real-time class SCHED_FIFO whenever it has something to do, before all
ordinary ones (sched(7)). That needs a privilege. Without it the loop runs as an ordinary process,
and a busy machine makes it miss ticks.

Signals that ask to end are Ctrl-C, Ctrl-\, SIGTERM and the loss of the terminal. A controller with
a bare `except`, a destructor or a callback may swallow the exception. So the signal is also kept,
and the loop looks at it.
"""

from __future__ import annotations

import contextlib
import gc
import os
import signal
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from enum import Enum
from pathlib import Path
from types import FrameType
from typing import Any


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
    before = os.sched_getscheduler(0), os.sched_getparam(0)
    gc.collect()
    gc.freeze()
    try:
        yield claim(level)
    finally:
        gc.unfreeze()
        if os.sched_getscheduler(0) != before[0]:
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
    for thread in Path("/proc/self/task").iterdir():
        with contextlib.suppress(OSError):  # it has ended
            os.sched_setscheduler(int(thread.name), os.SCHED_IDLE, os.sched_param(0))


def claim(level: int = LEVEL) -> Priority:
    """Ask for a real-time level for this thread, for good; the scheduling granted."""
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO | os.SCHED_RESET_ON_FORK, os.sched_param(level))
    except OSError:
        return Priority.ORDINARY
    return Priority.REAL_TIME


STOPS = signal.SIGINT, signal.SIGQUIT, signal.SIGTERM, signal.SIGHUP
"""Signals that ask a program to end; a terminal whose connection is lost sends SIGHUP."""


class StopOnce:
    """Makes signals that ask to end raise KeyboardInterrupt inside the block, until it is closed.

    Close it before the torque goes off: a second Ctrl-C must not interrupt that. Python delivers
    signals to the main thread only; a drive in another thread has to be ended otherwise, as by
    `orders.stop`.

    Args:
        last: The program ends after the block: once a signal came, later ones are ignored, so that
            the report is written and shown.
        numbers: The signals.

    Attributes:
        received: A signal came, even if its exception was swallowed.
        insists: Every signal raises, not only the first; for code that may swallow one.
        within: Signals raise only while this function runs, so that of several at once none
            interrupts what the first has begun; None for everywhere.
        closed: Signals do not raise any more; set by the code that owns the block.
    """

    def __init__(self, last: bool = False, numbers: Sequence[int] = STOPS) -> None:
        self.received = self.closed = False
        self.insists = not last
        self._last, self._numbers = last, numbers
        self.within: Callable[..., object] | None = None
        self._before: dict[int, Any] = {}

    def __enter__(self) -> StopOnce:
        if threading.current_thread() is threading.main_thread():
            self._before = {number: signal.signal(number, self.receive) for number in self._numbers}
        return self

    def __exit__(self, *_: object) -> None:
        for number, handler in self._before.items():
            signal.signal(number, signal.SIG_IGN if self._last and self.received else handler)

    def receive(self, number: int, frame: FrameType | None) -> None:
        """Take note of a signal."""
        first, self.received = not self.received, True
        if not self.closed and (first or self.insists) and self._inside(frame):
            raise KeyboardInterrupt

    def _inside(self, frame: FrameType | None) -> bool:
        """Whether `within` runs at this frame."""
        if self.within is None:
            return True
        code = getattr(self.within, "__code__", None)
        while frame is not None and frame.f_code is not code:
            frame = frame.f_back
        return frame is not None
