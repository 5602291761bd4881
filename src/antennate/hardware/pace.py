"""The pace of the loop: the host's clock, real-time scheduling, ticks that were missed.

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
from dataclasses import dataclass, field, replace
from enum import Enum
from pathlib import Path

from antennate.control.loop import next_tick


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


@dataclass(slots=True)
class StageTiming:
    """One stage of the tick.

    Attributes:
        worst: Longest time it took [s].
        overruns: Overrun ticks in which it took longer than any other stage.
    """

    worst: float = 0.0
    overruns: int = 0


@dataclass(slots=True)
class LoopTiming:
    """Measures the time of a loop and its stages.

    A tick is `begin`, then `mark` after each stage, then `finish`.

    Attributes:
        start: Time of the first tick [s].
        period: Control period [s].
        number: Number n of the tick now due or running; it is due at start + n * period.
        ticks: Ticks finished.
        overruns: Ticks that lasted beyond the time the next one was due.
        missed_cycles: Due times left out.
        worst_lateness: Farthest that a tick began behind its due time [s].
        worst_tick: Longest tick [s].
        stages: Worst time [s] and overruns of each stage, by name.
    """

    start: float
    period: float
    number: int = 0
    ticks: int = 0
    overruns: int = 0
    missed_cycles: int = 0
    worst_lateness: float = 0.0
    worst_tick: float = 0.0
    stages: dict[str, StageTiming] = field(default_factory=dict[str, StageTiming])
    _began: float = 0.0
    _marked: float = 0.0
    _spent: dict[str, float] = field(default_factory=dict[str, float])

    @property
    def missed_share(self) -> float:
        """Share of all due times that were left out."""
        return self.missed_cycles / max(1, self.ticks + self.missed_cycles)

    def begin(self, now: float) -> None:
        """A tick begins."""
        self._began = self._marked = now
        self._spent = {}
        self.worst_lateness = max(self.worst_lateness, now - self._due())

    def mark(self, stage: str, now: float) -> None:
        """A stage of the running tick ends."""
        self._spent[stage] = self._spent.get(stage, 0.0) + now - self._marked
        self._marked = now

    def finish(self, now: float) -> float:
        """The tick ends; the time at which the next one is due [s]."""
        self.ticks += 1
        self.worst_tick = max(self.worst_tick, now - self._began)
        following = next_tick(self.number, now - self.start, self.period)
        missed = following - self.number - 1
        self.number = following
        self.missed_cycles += missed
        self.overruns += missed > 0
        for name, spent in self._spent.items():
            stage = self.stages.setdefault(name, StageTiming())
            stage.worst = max(stage.worst, spent)
        if missed and self._spent:
            self.stages[max(self._spent, key=self._spent.__getitem__)].overruns += 1
        return self._due()

    def report(self) -> LoopTiming:
        """A copy of what happened so far."""
        return replace(self, stages={name: replace(s) for name, s in self.stages.items()})

    def _due(self) -> float:
        return self.start + self.number * self.period
