"""What is measured on one trial while it runs, from the true state of the simulation.

The controller sees nothing of this. Progress is what the scene says of the head's position. The
robot is stuck when its progress has gained less than STUCK_GAIN on its own maximum for STUCK_TIME;
the episode ends, recovered, with the next such gain.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal, Union

import numpy as np

from antennate.errors import SceneError
from antennate.sim.scenes.scene import TIME_LIMIT, SceneInstance
from antennate.sim.trial import Judge, progress_of
from antennate.sim.world import World
from antennate.types import Floats, Ints, Maneuver

if TYPE_CHECKING:
    from antennate.sim.warp.robot import WarpRow

Outcome = Literal["success", "timeout", "left", "invalid"]

STUCK_GAIN = 0.02
"""Gain of progress that counts as getting on [m]."""
STUCK_TIME = 5.0
"""Time without such a gain after which the robot is stuck [s]."""


Watched = Union[World, "WarpRow"]
"""What is looked at: on the CPU, or in a batch on a device."""


@dataclass(frozen=True, slots=True)
class TrialResult:
    """One row of the table.

    Attributes:
        seed: Seed of the run; with `trial` it decides all chance.
        controller: Name of the controller.
        outcome: success (the head crossed the exit from inside), timeout, left (out another way)
            or invalid.
        time_s: Time to exit [s]; the limit for every failure.
        progress_m: How far the head came, within 0 and the length of the scene [m].
        stuck: Episodes of being stuck; `recovered` of them ended by getting on.
        share_forward: Share of ticks in each maneuver.
        force_mean_n: Mean over 10 Hz samples of the summed normal force on robot and antennae [N].
        force_max_n: Their maximum [N].
        limit_s: Time limit of the trial [s].
        reason: Why a trial is invalid, with the physics step; empty otherwise.
    """

    seed: int
    trial: int
    controller: str
    outcome: Outcome
    time_s: float
    progress_m: float = 0.0
    stuck: int = 0
    recovered: int = 0
    share_forward: float = 0.0
    share_turn_l: float = 0.0
    share_turn_r: float = 0.0
    share_reverse: float = 0.0
    share_hold: float = 0.0
    force_mean_n: float = 0.0
    force_max_n: float = 0.0
    limit_s: float = TIME_LIMIT
    reason: str = ""


@dataclass(frozen=True, slots=True)
class TrialPath:
    """What a figure needs of one trial.

    Attributes:
        t: Times of the samples [s], shape (n,).
        head: Head positions [m], shape (n, 2).
        maneuver: `Maneuver` at the samples, shape (n,).
        fixed: Obstacles that stand still, polygons in plan [m], each of shape (k, 2).
        before: Obstacles that can move, likewise, at the start.
        after: The same at the end.
        exit: Ends of the exit line [m], shape (2, 2).
        links: The robot's links at the end [m], shape (L, 2).
        parts: All parts of the robot at the end, legs and antennae included, polygons likewise.
    """

    t: Floats
    head: Floats
    maneuver: Floats
    fixed: list[Floats]
    before: list[Floats]
    after: list[Floats]
    exit: Floats
    links: Floats
    parts: list[Floats]


@dataclass
class TrialMonitor:
    """Watches one trial, a look every LOOK_EVERY ticks and one at the time limit.

    Attributes:
        seed, trial: What decides all chance.
        before: Obstacles that can move, at the start, as in `TrialPath`.
        time_limit: Time after which it has failed [s].
    """

    seed: int
    trial: int
    controller: str
    scene: SceneInstance
    before: list[Floats]
    time_limit: float
    _best: float = 0.0
    _best_at: float = 0.0
    _stuck: int = 0
    _recovered: int = 0
    _is_stuck: bool = False
    _forces: list[float] = field(default_factory=list)
    _samples: list[tuple[float, float, float, int]] = field(default_factory=list)
    _judge: Judge = field(init=False)

    def __post_init__(self) -> None:
        self._judge = Judge(self.scene)

    def look(self, world: Watched, t: float, maneuver: int) -> Outcome | None:
        """Look at the world at time t [s]; the outcome once there is one.

        Raises:
            SceneError: The scene does not answer as its protocol says.
        """
        head = world.head[:2]
        x, y = head.tolist()
        self._samples.append((t, x, y, maneuver))
        self._forces.append(world.obstacle_force())
        self._note_progress(progress_of(self.scene, head), t)
        return self._judge.look(head) or ("timeout" if t >= self.time_limit else None)

    def _note_progress(self, progress: float, t: float) -> None:
        if progress > self._best + STUCK_GAIN:
            self._best, self._best_at = progress, t
            self._recovered += self._is_stuck
            self._is_stuck = False
        elif not self._is_stuck and t - self._best_at > STUCK_TIME:
            self._is_stuck = True
            self._stuck += 1

    def result(self, world: Watched, outcome: Outcome, reason: str, ticks: Ints) -> TrialResult:
        """The row of a trial that ended so, with `ticks` in each maneuver, shape (5,)."""
        share = ticks / max(1, ticks.sum())
        forces = np.array(self._forces) if self._forces else np.zeros(1)
        try:
            progress = progress_of(self.scene, world.head[:2])
        except SceneError:  # as after a simulation that became invalid
            progress = self._best
        return TrialResult(
            seed=self.seed,
            trial=self.trial,
            controller=self.controller,
            outcome=outcome,
            time_s=round(world.t, 6) if outcome == "success" else self.time_limit,
            progress_m=round(float(np.clip(progress, 0.0, self.scene.length)), 6),
            stuck=self._stuck,
            recovered=self._recovered,
            **{f"share_{m.name.lower()}": round(float(share[m]), 6) for m in Maneuver},
            force_mean_n=round(float(forces.mean()), 6),
            force_max_n=round(float(forces.max()), 6),
            limit_s=self.time_limit,
            reason=reason,
        )

    def path(self, world: Watched) -> TrialPath:
        """The trial as a figure draws it."""
        samples = np.array(self._samples).reshape(-1, 4)
        fixed, after = world.outlines()
        return TrialPath(
            t=samples[:, 0],
            head=samples[:, 1:3],
            maneuver=samples[:, 3],
            fixed=fixed,
            before=self.before,
            after=after,
            exit=self.scene.exit,
            links=world.links().copy(),
            parts=world.parts(),
        )
