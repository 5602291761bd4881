"""Touching walls: the sensed state of contact against the engine's, by wall, speed and profile."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from antennate.antenna.statics import Profile
from antennate.experiments.touch import result as touch_result
from antennate.experiments.touch.config import TouchConfig
from antennate.experiments.touch.result import TouchRow
from antennate.experiments.touch.sensing import Comparison
from antennate.experiments.touch.traverse import (
    Draw,
    Plan,
    Traverse,
    reach,
    run_traverse,
    site,
    with_springs,
)
from antennate.sim import touch_wall
from antennate.sim.touch_wall import WallKind
from antennate.studies.experiment import OnStep, no_step
from antennate.studies.pool import gather
from antennate.types import Floats


@dataclass(frozen=True, slots=True)
class Trace:
    """One traverse with everything a figure of it needs, tick by tick."""

    traverse: Traverse
    comparison: Comparison
    t: Floats
    b: Floats
    threshold: float
    hysteresis: float


@dataclass(frozen=True, slots=True)
class TouchOutcome:
    """All traverses in the order of walls, speeds, profiles and trials, and what was sensed.

    Attributes:
        config: What was run.
        traverses: All of them.
        comparisons: Those whose physics is valid, in the same order.
        summary: The content of result.json.
    """

    config: TouchConfig
    traverses: list[Traverse]
    comparisons: list[Comparison]
    summary: dict[str, Any]

    def result(self) -> dict[str, Any]:
        """The content of result.json."""
        return self.summary

    @property
    def rows(self) -> list[TouchRow]:
        """The rows of trials.csv."""
        return touch_result.rows(self.config.seed, self.traverses, self.comparisons)

    def example(self) -> Trace | None:
        """Trial 0 of one traverse: a gap, the middle speed and `descending` where there are."""
        config = self.config
        wall = "gap" if "gap" in config.walls else config.walls[0]
        profile = "descending" if "descending" in config.profiles else config.profiles[0]
        speed = sorted(config.speeds)[len(config.speeds) // 2]
        valid = [one for one in self.traverses if not one.course.reason]
        for one, comparison in zip(valid, self.comparisons, strict=True):
            if (one.wall, one.profile, one.speed, one.trial) == (wall, profile, speed, 0):
                rule = config.rule
                t = np.arange(len(comparison.truth)) / config.antenna.sensor.rate
                b = 1.0 / (1.0 + np.exp(-comparison.level))
                return Trace(one, comparison, t, b, rule.threshold, rule.hysteresis)
        return None


def draw(config: TouchConfig, trial: int) -> Draw:
    """What chance decides about a trial besides noise: it depends on seed and trial alone."""
    rng = np.random.default_rng([config.seed, trial])
    shift, phase = rng.random(2)
    overlap = config.overlap + config.overlap_spread * rng.uniform(-1.0, 1.0)
    springs = 1.0 + config.spring_tolerance * rng.uniform(-1.0, 1.0, config.antenna.hinges)
    return Draw(shift * config.place_spread, phase, overlap, springs)


def plan(config: TouchConfig, wall: WallKind, speed: float, profile: Profile, trial: int) -> Plan:
    """One traverse with its draws."""
    drawn = draw(config, trial)
    antenna = with_springs(config.antenna, profile, drawn.springs)
    lead = antenna.length * math.cos(antenna.base_angle)
    return Plan(
        antenna=antenna,
        physics=config.physics,
        walls=config.wall,
        kind=wall,
        site=site(antenna, drawn.overlap, config.wall_length, drawn.phase),
        wall_start=lead + config.free_length + drawn.shift,
        speed=speed,
        travel=config.travel,
    )


_Task = tuple[TouchConfig, WallKind, float, Profile, int]


def traverse(
    config: TouchConfig, wall: WallKind, speed: float, profile: Profile, trial: int
) -> Traverse:
    """Run one traverse; the joints of trial 0 are kept for figures."""
    one = plan(config, wall, speed, profile, trial)
    course = run_traverse(one, keep_joints=trial == 0)
    lines = touch_wall.outline(config.wall, wall, one.site)
    shifted = [line + np.array([one.wall_start, 0.0]) for line in lines]
    overlap = reach(config.antenna) - one.site.near
    return Traverse(wall, speed, profile, trial, course, overlap, shifted)


def _run_task(task: _Task, emit: Callable[[Traverse], None]) -> None:
    emit(traverse(*task))


def run(
    config: TouchConfig,
    workers: int = 1,
    on_step: OnStep = no_step,
) -> TouchOutcome:
    """Run all traverses, then let the control read them.

    Raises:
        WorkerError: A worker died.
    """
    tasks: Sequence[_Task] = [
        (config, wall, speed, profile, trial)
        for wall in config.walls
        for speed in config.speeds
        for profile in config.profiles
        for trial in range(config.trials)
    ]
    place = {task[1:]: i for i, task in enumerate(tasks)}
    found = gather(_run_task, tasks, workers, on_step)
    found.sort(key=lambda one: place[one.wall, one.speed, one.profile, one.trial])
    comparisons = touch_result.score(config, found)
    return TouchOutcome(config, found, comparisons, touch_result.result(config, found, comparisons))
