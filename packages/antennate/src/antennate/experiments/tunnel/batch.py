"""Trials of one condition, so many at once, and those that follow a controller that failed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from antennate.control.loop import Wrapped
from antennate.control.readings import YOKED, parts_of
from antennate.control.registry import make_controller
from antennate.errors import ControllerError
from antennate.experiments.tunnel.lockstep import Apparatus, Donors, Emit, Lockstep
from antennate.experiments.tunnel.physics import TrialResult, TunnelConfig
from antennate.sim.episode import Episode
from antennate.sim.world import World
from antennate.telemetry import Restart
from antennate.types import AntennaFrame, Controller, Floats, JointCommand

if TYPE_CHECKING:
    from antennate.telemetry.view.simulation import SimulationView

BATCH = 24
"""Trials of one process stepped in lockstep. Each pays its share of what all cost together."""
PLAIN = Apparatus()
"""Controllers by name and robots on the CPU, which nobody looks at."""


def run_trials(
    config: TunnelConfig,
    condition: str,
    trials: Sequence[int],
    emit: Emit,
    batch: int = BATCH,
    logs: Path | None = None,
    apparatus: Apparatus = PLAIN,
) -> None:
    """Run trials of one condition; emit each as it ends, and keep its log if there is a folder.

    A trial in which the controller fails is invalid, and the others go on. Angles that are not
    finite, and a maneuver that does not exist, are faults of one row and end that trial alone. An
    exception, or an array of another shape, cannot be told apart by rows: then each trial of the
    batch that has not ended begins again with a controller of its own, and is invalid if that one
    fails too. With robots of another kind, there are no logs and nothing to watch. A trial whose
    scene cannot be drawn has a `TrialResult`, whatever monitors make. Trials of `yoked` are given
    what other trials read, which are run for it, so many at once.

    Args:
        config: What is run.
        condition: Name of the controller, with its readings if they are not its own.
        trials: Their numbers.
        emit: Takes each as it ends.
        batch: Trials at once.
        logs: Folder for their logs.
        apparatus: What they are run with.
    """

    def begin(size: int, donors: Donors) -> Lockstep:
        return Lockstep(config, condition, emit, size, logs, apparatus, donors)

    controller, readings = parts_of(condition)
    if readings != YOKED:
        _run(partial(begin, donors={}), trials, batch)
        return
    for first in range(0, len(trials), batch):
        some = trials[first : first + batch]
        donors = _donors(config, controller, some, batch)
        _run(partial(begin, donors=donors), some, batch)


def _run(begin: Callable[[int], Lockstep], trials: Sequence[int], batch: int) -> None:
    """Run trials in lockstep, and those that a failed controller left one by one."""
    rows = begin(min(batch, len(trials)))
    try:
        rows.run(trials)
    except Restart:
        rows.give_up()
        raise
    except ControllerError as error:
        if len(trials) == 1:
            rows.fail(0, f"controller: {error}")
            return
        rows.give_up()
        for trial in rows.unfinished:
            _run(begin, [trial], 1)


def watched(view: SimulationView | None) -> Apparatus:
    """What `run_trials` is given to show its trials on a page, if there is one."""
    if view is None:
        return PLAIN

    def watch(world: World, frame: AntennaFrame, control: Controller) -> Sequence[str]:
        return view.tick(world.model, world.data, frame, control)

    return Apparatus(view.controller, watch=watch)


class _Taped(Wrapped):
    """A controller, and the counts that it is given, tick by tick."""

    def __init__(self, made: Controller) -> None:
        super().__init__(made)
        self.counts: list[Floats] = []

    def step(self, frame: AntennaFrame) -> JointCommand:
        """Keep the counts of a frame, and let the controller answer it."""
        self.counts.append(frame.counts.copy())
        return super().step(frame)


class _Donor:
    """Watches a trial for what its robot reads: its number and its counts, (ticks, 2), in a row."""

    def __init__(self, row: int, episode: Episode, tapes: Sequence[_Taped]) -> None:
        self.episode, self._row, self._tapes = episode, row, tapes
        self._end = 0

    def tick(self, world: World, maneuver: int, failure: object = None) -> Any:
        """Let a control tick pass; the outcome once there is one."""
        self._end = len(self._tapes[-1].counts)
        return self.episode.tick(world, failure)

    def result(self, world: World) -> tuple[int, Floats]:
        """Number of the trial and its counts."""
        ticks = self._tapes[-1].counts[self._end - self.episode.ticks : self._end]
        return self.episode.number, np.array([counts[self._row] for counts in ticks])

    def path(self, world: World) -> None:
        """Nothing is drawn."""


def _donors(config: TunnelConfig, controller: str, trials: Sequence[int], batch: int) -> Donors:
    """What robots with their own readings read in the trials that follow these, by these."""
    following = {trial: config.following(trial) for trial in trials}
    tapes, read = list[_Taped](), dict[int, Floats]()

    def make(*how: Any) -> Controller:
        tapes.append(_Taped(make_controller(*how)))
        return tapes[-1]

    def take(item: tuple[Any, Any]) -> None:
        if isinstance(item[0], TrialResult):  # its scene could not be drawn
            return
        number, counts = item[0]
        if len(counts):
            read[number] = counts

    apparatus = Apparatus(make, monitor=lambda row, episode: _Donor(row, episode, tapes))
    run_trials(config, controller, [*following.values()], take, batch, apparatus=apparatus)
    return {trial: read[donor] for trial, donor in following.items() if donor in read}


def on_cpu(
    config: TunnelConfig,
    condition: str,
    trials: Sequence[int],
    emit: Emit,
    logs: Path | None = None,
    view: SimulationView | None = None,
) -> None:
    """Run trials of one condition; see `run_trials`. A page may show them."""
    run_trials(config, condition, trials, emit, logs=logs, apparatus=watched(view))
