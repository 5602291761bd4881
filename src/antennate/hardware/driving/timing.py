"""Whether the loop keeps its pace: due times, overruns, and which stage cost them.

The n-th tick is due at start + n * period. Ticks that come due while another still runs are left
out and counted; they are never made up for in a burst. Nothing here reads a clock or sleeps.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from antennate.errors import ConfigError


@dataclass(slots=True)
class StageTiming:
    """One stage of the tick.

    Attributes:
        worst: Longest time it took [s].
        overruns: Overrun ticks in which it took longer than any other stage.
    """

    worst: float = 0.0
    overruns: int = 0


@dataclass(frozen=True, slots=True)
class TimingReport:
    """How well the pace was kept.

    Attributes:
        ticks: Ticks finished.
        overruns: Ticks that lasted beyond the time the next one was due.
        missed_cycles: Due times left out.
        worst_lateness: Farthest that a tick began behind its due time [s].
        worst_tick: Longest tick [s].
        stages: Worst time [s] and overruns of each stage, by name.
    """

    ticks: int
    overruns: int
    missed_cycles: int
    worst_lateness: float
    worst_tick: float
    stages: dict[str, StageTiming]

    @property
    def missed_share(self) -> float:
        """Share of all due times that were left out."""
        return self.missed_cycles / max(1, self.ticks + self.missed_cycles)


class LoopTiming:
    """Accounts for the time of a loop.

    A tick is `begin`, then `mark` after each stage, then `finish`, which says when the next is due.

    Args:
        start: Time of the first tick [s].
        period: Control period [s].

    Attributes:
        number: Number n of the tick now due or running.

    Raises:
        ConfigError: The period is not a positive number, or the start not a finite one.
    """

    def __init__(self, start: float, period: float) -> None:
        if not (math.isfinite(start) and math.isfinite(period) and period > 0):
            raise ConfigError(
                f"expected a finite start and a period above 0 s, got {start} and {period}"
            )
        self._start = start
        self._period = period
        self.number = 0
        self._began = self._marked = start
        self._spent: dict[str, float] = {}
        self._stages: dict[str, StageTiming] = {}
        self._ticks = 0
        self._overruns = 0
        self._missed = 0
        self._late = 0.0
        self._worst = 0.0

    @property
    def due(self) -> float:
        """Time at which the tick `number` is due [s]."""
        return self._due(self.number)

    def begin(self, now: float) -> float:
        """A tick begins; its lateness [s]."""
        self._began = self._marked = now
        self._spent = {}
        late = max(0.0, now - self.due)
        self._late = max(self._late, late)
        return late

    def mark(self, stage: str, now: float) -> None:
        """A stage of the running tick ends."""
        self._spent[stage] = self._spent.get(stage, 0.0) + now - self._marked
        self._marked = now

    def finish(self, now: float) -> float:
        """The tick ends; the time at which the next one is due [s], never before now."""
        self._ticks += 1
        self._worst = max(self._worst, now - self._began)
        following = self._first_due(now)
        missed = following - self.number - 1
        self._missed += missed
        self._overruns += missed > 0
        self._blame(overrun=missed > 0)
        self.number = following
        return self.due

    def report(self) -> TimingReport:
        """What happened so far."""
        return TimingReport(
            ticks=self._ticks,
            overruns=self._overruns,
            missed_cycles=self._missed,
            worst_lateness=self._late,
            worst_tick=self._worst,
            stages={n: StageTiming(s.worst, s.overruns) for n, s in self._stages.items()},
        )

    def _due(self, number: int) -> float:
        return self._start + number * self._period

    def _first_due(self, now: float) -> int:
        """Number of the first tick after the present one that is not due before now."""
        number = max(self.number + 1, math.floor((now - self._start) / self._period) - 1)
        while self._due(number) < now:
            number += 1
        return number

    def _blame(self, overrun: bool) -> None:
        for stage, spent in self._spent.items():
            known = self._stages.setdefault(stage, StageTiming())
            known.worst = max(known.worst, spent)
        if overrun and self._spent:
            slowest = max(self._spent, key=self._spent.__getitem__)
            self._stages[slowest].overruns += 1
