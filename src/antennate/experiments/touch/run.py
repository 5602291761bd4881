"""Touching walls: the sensed state of contact against the engine's, by wall, speed and profile."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, model_validator

from antennate.errors import SceneError
from antennate.experiments.touch import result as touch_result
from antennate.experiments.touch.result import TouchRow
from antennate.experiments.touch.sensing import Verdict
from antennate.experiments.touch.traverse import (
    Course,
    Draw,
    Plan,
    reach,
    run_traverse,
    site,
    steps_fit,
    with_springs,
)
from antennate.params import (
    BenchPhysicsParams,
    ConditioningParams,
    Params,
    RuleParams,
    TouchWallsParams,
    number,
)
from antennate.robots.antenna import AntennaSpec
from antennate.sim import touch_wall
from antennate.sim.touch_wall import WALLS, WallKind
from antennate.studies.pool import run_tasks
from antennate.types import Floats

Profile = Literal["stiff", "descending", "compliant", "matched_uniform", "ascending"]
_Speed = Annotated[float, Field(ge=0.002, le=1.0)]
_CLOSEST = 0.01
"""No wall comes nearer to the line of traverse [m]."""
_MOST_TICKS = 10**7
"""Most ticks of a study: more would not fit into memory."""


class TouchConfig(Params):
    """Everything that decides the outcome of `antennate touch`."""

    trials: int = number(
        5, "1", "assumed: a minute on two cores", "trials of every arm", ge=1, le=10000
    )
    seed: int = number(0, "1", "assumed: any", "seed of all chance", ge=0)
    walls: tuple[WallKind, ...] = number(WALLS, "1", "assumed: all", "walls", min_length=1)
    speeds: tuple[_Speed, ...] = number(
        (0.05, 0.10, 0.15),
        "m/s",
        "paper: speeds of the calibration; its boulder wall ran at 0.008",
        "speeds of the carriage",
        min_length=1,
    )
    profiles: tuple[Profile, ...] = number(
        ("stiff", "descending", "compliant"),
        "1",
        "paper: its three profiles",
        "springs of the antenna; they replace antenna.active_coils",
        min_length=1,
    )
    overlap: float = number(
        0.02, "m", "assumed: a sixth of the antenna", "mean of how far the tip would reach in", gt=0
    )
    overlap_spread: float = number(
        0.015, "m", "assumed: from a brush to a firm press", "half range of the overlap", ge=0
    )
    spring_tolerance: float = number(
        0.1, "1", "assumed: usual for wound springs", "half range of a spring's factor", ge=0, lt=1
    )
    wall_length: float = number(
        0.4, "m", "assumed: three antennae and more", "length of every wall", ge=0.05, le=2
    )
    free_length: float = number(
        0.08, "m", "assumed: free for half a second or more", "free way at both ends", ge=0.01, le=1
    )
    place_spread: float = number(
        0.02, "m", "assumed: more than a tick at any speed", "range of the wall's place", ge=0, le=1
    )
    contact_force: float = number(
        1e-4,
        "N",
        "assumed: a hundredth of the weight of a link",
        "mean force in a tick above which an obstacle presses",
        ge=0,
        le=10,
    )
    merge_time: float = number(
        0.05,
        "s",
        "assumed: half of T_avg; 7.5 mm at 0.15 m/s",
        "gaps between presses shorter than this are contact",
        ge=0,
        le=10,
    )
    averaging_times: tuple[Annotated[float, Field(gt=0, le=5)], ...] = number(
        (0.02, 0.05, 0.1, 0.15, 0.2, 0.3),
        "s",
        "assumed: a fifth of the default to three times it",
        "further T_avg to try on the same readings",
    )
    antenna: AntennaSpec = AntennaSpec()
    conditioning: ConditioningParams = ConditioningParams()
    rule: RuleParams = RuleParams()
    wall: TouchWallsParams = TouchWallsParams()
    physics: BenchPhysicsParams = BenchPhysicsParams()

    @property
    def travel(self) -> float:
        """Way of every traverse [m]."""
        lead = self.antenna.length * math.cos(self.antenna.base_angle)
        return (
            lead + self.place_spread + self.wall_length + self.antenna.length + 2 * self.free_length
        )

    @model_validator(mode="after")
    def _agree(self) -> TouchConfig:
        for name in ("walls", "speeds", "profiles", "averaging_times"):
            values = getattr(self, name)
            if len(set(values)) < len(values):
                raise ValueError(f"{name} must differ, got {', '.join(map(str, values))}")
        if not steps_fit(self.antenna.sensor.rate, self.physics.timestep):
            raise ValueError(
                "antenna.sensor.rate must be a whole fraction of a fifth of the physics rate "
                f"{1 / self.physics.timestep:g} Hz, got {self.antenna.sensor.rate:g} Hz"
            )
        ticks = sum(self.travel / speed * self.antenna.sensor.rate for speed in self.speeds)
        ticks *= self.trials * len(self.walls) * len(self.profiles)
        if ticks > _MOST_TICKS:
            raise ValueError(
                f"trials: expected at most {_MOST_TICKS:,} ticks in all, found {ticks:,.0f}; ask "
                "for fewer trials, walls or profiles, or higher speeds"
            )
        self._walls_stand()
        return self

    def _walls_stand(self) -> None:
        """Every wall can be built at the smallest and the largest overlap."""
        low, high = self.overlap - self.overlap_spread, self.overlap + self.overlap_spread
        if low <= 0:
            raise ValueError(
                f"overlap_spread: expected less than overlap, {self.overlap:g} m, found "
                f"{self.overlap_spread:g} m"
            )
        for kind in self.walls:
            room = reach(self.antenna) - touch_wall.intrusion(self.wall, kind) - _CLOSEST
            if high > room:
                raise ValueError(
                    f"overlap: expected overlap and spread of at most {max(room, 0.0):.3g} m "
                    f"before the wall {kind}, whose antenna reaches {reach(self.antenna):.3g} m "
                    f"to the side, found {high:.3g} m"
                )
            for overlap in (low, high):
                try:
                    touch_wall.outline(
                        self.wall, kind, site(self.antenna, overlap, self.wall_length, 0.0)
                    )
                except SceneError as error:
                    raise ValueError(str(error)) from None


@dataclass(frozen=True, slots=True)
class Traverse:
    """One traverse as it came out of the engine.

    Attributes:
        wall, speed, profile, trial: Which one; speed in [m/s].
        course: What the engine says.
        overlap: Drawn overlap [m].
        outline: Surface of the wall along the traverse, lines of shape (n, 2) [m].
    """

    wall: WallKind
    speed: float
    profile: Profile
    trial: int
    course: Course
    overlap: float
    outline: list[Floats]


@dataclass(frozen=True, slots=True)
class Trace:
    """One traverse with everything a figure of it needs, tick by tick."""

    traverse: Traverse
    verdict: Verdict
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
        verdicts: Those whose physics is valid, in the same order.
        summary: The content of result.json.
    """

    config: TouchConfig
    traverses: list[Traverse]
    verdicts: list[Verdict]
    summary: dict[str, Any]

    def result(self) -> dict[str, Any]:
        """The content of result.json."""
        return self.summary

    @property
    def rows(self) -> list[TouchRow]:
        """The rows of trials.csv."""
        return touch_result.rows(self.traverses, self.verdicts)

    def example(self) -> Trace | None:
        """Trial 0 of one fixed arm: a gap, the middle speed and `descending` where there are."""
        config = self.config
        wall = "gap" if "gap" in config.walls else config.walls[0]
        profile = "descending" if "descending" in config.profiles else config.profiles[0]
        speed = sorted(config.speeds)[len(config.speeds) // 2]
        valid = [one for one in self.traverses if not one.course.reason]
        for one, verdict in zip(valid, self.verdicts, strict=True):
            if (one.wall, one.profile, one.speed, one.trial) == (wall, profile, speed, 0):
                rule = config.rule
                t = np.arange(len(verdict.truth)) / config.antenna.sensor.rate
                b = 1.0 / (1.0 + np.exp(-verdict.level))
                return Trace(one, verdict, t, b, rule.threshold, rule.hysteresis)
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
    on_step: Callable[[int, int], None] = lambda done, total: None,
) -> TouchOutcome:
    """Run all traverses, then let the control read them.

    Args:
        config: What to run.
        workers: Processes to use; the outcome does not depend on it.
        on_step: Called after every traverse with how many of how many are done.

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
    found: list[Traverse] = []

    def take(one: Traverse) -> None:
        found.append(one)
        on_step(len(found), len(tasks))

    run_tasks(_run_task, tasks, workers, take)
    found.sort(key=lambda one: place[one.wall, one.speed, one.profile, one.trial])
    verdicts = touch_result.score(config, found)
    return TouchOutcome(config, found, verdicts, touch_result.result(config, found, verdicts))
