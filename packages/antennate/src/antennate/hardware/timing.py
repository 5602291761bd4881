"""Whether the loop keeps its period: overruns, ticks left out, and which stage caused them."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from antennate.control.loop import next_tick


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
