"""One episode: a controller in one draw of a scene, with a time limit for each decision.

A decision has to be there before the readings are stale. Its time is that of the processor, with
that of programs that it began, so that a machine with other work to do judges alike; none may run
on after it. Who waits or sleeps in a decision is stopped by the clock, after `WAITING` times as
long. The first decision, in which libraries are loaded, and a reset may take so long on the
processor, too. Episodes run in lockstep, and a step of all that stays within the limit of one is
within it for each. After one that does not, each episode runs alone, and is INVALID where its own
decision takes too long.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from antennate import __version__
from antennate.control.readings import condition
from antennate.control.registry import make_controller
from antennate.experiments.tunnel.batch import run_trials
from antennate.experiments.tunnel.lockstep import Apparatus
from antennate.experiments.tunnel.physics import TrialResult
from antennate.sim.episode import Outcome, time_limit_of
from antennate.sim.scenes.scene import TIME_LIMIT
from antennate.sim.trial import draw_scene, scene_of
from antennate.studies.columns import tabular
from antennate.studies.work import processor
from antennate.telemetry.header import versions
from antennate.types import Controller
from antennate_lab.compete.apart import Apart
from antennate_lab.compete.scenes import tunnel_config


@tabular
class EpisodeRow:
    """One episode, a row of trials.csv."""

    controller: str
    scene: str
    """Scene, with its other parameters if it has some, as `uturn+variation.broken=random`."""
    seed: int
    """Seed of the run; with `trial` and `scene` it decides all chance."""
    trial: int
    """Number of the draw."""
    outcome: Outcome
    """Outcome: success, timeout, left, overturned, fell, or invalid, which counts as a failure."""
    time_s: float
    """Time to the exit; the limit for every failure."""
    limit_s: float = TIME_LIMIT
    """Time limit."""
    progress_m: float = 0.0
    """Where the head ended along the route."""
    overturned: bool = False
    """Whether the robot lies on its back at the end."""
    void_decisions: int = 0
    given: str = ""
    """What the simulation gave to the controller, in words; empty for its readings alone."""
    drawn: bool = False
    """Whether the seed was drawn when the run began, so that nobody knew it."""
    version: str = __version__
    """Version of antennate."""
    engine: str = ""
    """Version of MuJoCo."""
    processor: str = ""
    """Model of the processor."""
    reason: str = ""


@dataclass(frozen=True)
class Draw:
    """What an episode is run from: its key and what decides beside it.

    `decision_limit` is in s; `drawn` is that of its row.
    """

    controller: str
    scene: str
    seed: int
    trial: int
    decision_limit: float
    drawn: bool = False


def run_episodes(draws: Sequence[tuple[Draw]], emit: Callable[[int, Any], None]) -> None:
    """Run episodes of one controller in one scene with one seed, in this process and in lockstep.

    Args:
        draws: What they are run from, each as the only argument of a task.
        emit: Takes the place of each and its row as it ends.
    """
    first = draws[0][0]
    config = tunnel_config(first.scene, first.controller, first.seed)
    places = {draw.trial: place for place, (draw,) in enumerate(draws)}
    made: list[Apart] = []

    def take(item: tuple[TrialResult, Any]) -> None:
        place = places[item[0].trial]
        emit(place, _row_of(draws[place][0], item[0], " ".join(made[-1].needs) if made else ""))

    def make(*how: Any) -> Controller:
        for former in made:
            former.close()
        made[:] = [Apart(functools.partial(make_controller, *how), first.decision_limit)]
        return made[0]

    name = condition(config.controllers[0], config.readings[0])
    try:
        run_trials(config, name, [*places], take, apparatus=Apparatus(make))
    finally:
        for last in made:
            last.close()


def _row_of(draw: Draw, row: TrialResult, given: str) -> EpisodeRow:
    return _ended(
        draw,
        outcome=row.outcome,
        time_s=row.time_s,
        limit_s=row.limit_s,
        progress_m=row.progress_m,
        overturned=row.overturned,
        void_decisions=row.void_decisions,
        given=given,
        reason=row.reason,
    )


def lost(draw: Draw, reason: str) -> EpisodeRow:
    """The row of an episode whose process died, failed, or did not end."""
    config = tunnel_config(draw.scene, draw.controller, draw.seed)
    limit = time_limit_of(draw_scene(config, scene_of(config), draw.trial), config.time_limit)
    return _ended(draw, outcome="invalid", time_s=limit, limit_s=limit, reason=reason)


def _ended(draw: Draw, **ended: Any) -> EpisodeRow:
    return EpisodeRow(
        controller=draw.controller,
        scene=draw.scene,
        seed=draw.seed,
        trial=draw.trial,
        drawn=draw.drawn,
        engine=versions()["mujoco"],
        processor=processor(),
        **ended,
    )


def restricted(rows: Iterable[EpisodeRow]) -> list[float]:
    """Time of each row as a share of its limit; 1 of a failure."""
    return [row.time_s / row.limit_s if row.outcome == "success" else 1.0 for row in rows]


def all_drawn(rows: Sequence[EpisodeRow]) -> bool:
    """Whether the seed of each row was drawn when its run began; False without rows."""
    return bool(rows) and all(row.drawn for row in rows)
