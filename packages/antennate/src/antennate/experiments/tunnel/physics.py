"""A trial of `tunnel`: what decides it, and what is measured while it runs, from the true state.

The controller sees nothing of this. Progress is what the scene says of the head's position. The
robot is stuck when its progress has gained less than STUCK_GAIN on its own maximum for STUCK_TIME;
the episode ends, recovered, with the next such gain.
"""

from __future__ import annotations

from array import array
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar, Union

import numpy as np
from pydantic import field_validator, model_validator

from antennate.control import registry
from antennate.control.knowledge import KNOWABLE, Kind
from antennate.control.readers import HARDWARE_ALONE
from antennate.control.readings import (
    KINDS,
    OWN,
    YOKED,
    check_readings,
    condition,
    require_whole_delay,
)
from antennate.control.registry import (
    CONTROLLERS,
    KEPT_BY_CLIMBERS,
    USUAL,
    unread_by_all,
    unread_limits,
)
from antennate.errors import SceneError
from antennate.params.base import number, require_different, require_whole_steps
from antennate.params.control import ControlParams
from antennate.sim.episode import Episode, Outcome, require_times
from antennate.sim.scenes import geometry
from antennate.sim.scenes.scene import TIME_LIMIT
from antennate.sim.trial import TrialConfig, require_own_curves
from antennate.sim.world import World
from antennate.studies.columns import CONDITION, column, tabular, tabular_row
from antennate.studies.pooling import largest, mean, smallest, total
from antennate.types import Floats, Maneuver

if TYPE_CHECKING:
    from antennate.antenna.load import SpringLoad
    from antennate.sim.warp.robot import WarpRow


class TunnelConfig(TrialConfig):
    """Everything that decides the outcome of `antennate tunnel`."""

    unread: ClassVar[tuple[str, ...]] = tuple(
        path for path in HARDWARE_ALONE if path not in KEPT_BY_CLIMBERS
    )
    offered: ClassVar[Mapping[str, Collection[str]]] = {
        **TrialConfig.offered,
        "controllers": registry.KINDS,
    }
    trials: int = number(10, "1", "paper: 10 trials with feedback, 10 without", ge=1, le=100000)
    """Trials of every controller."""
    controllers: tuple[str, ...] = number(
        USUAL,
        "1",
        "assumed: without touch, with the published rule and with ours",
        min_length=1,
    )
    """Controllers to run: {offered}, MODULE:NAME or FILE.py:NAME of your own, or FILE.onnx, a
    learned policy."""
    readings: tuple[str, ...] = number(
        (OWN,), "1", "assumed: what the robot reads", min_length=1, examples=[*KINDS]
    )
    """What each controller is given to read: own, none, swapped, delayed:S or yoked."""
    knows: tuple[Kind, ...] = number(
        (), "1", "assumed: a robot knows nothing but its readings", examples=list(KNOWABLE)
    )
    """What the simulation gives to controllers that can use it."""
    time_limit: float | None = number(
        None, "s", "paper: 0.04 m/s without feedback; half of that on 2 m, 100 s", gt=0, le=3600
    )
    """Time after which a trial has failed; that of its scene if not given."""
    control: ControlParams = ControlParams()

    @field_validator("controllers")
    @classmethod
    def _names(cls, names: tuple[str, ...]) -> tuple[str, ...]:
        return tuple(map(CONTROLLERS.check, names))

    @field_validator("readings")
    @classmethod
    def _known_readings(cls, names: tuple[str, ...]) -> tuple[str, ...]:
        return tuple(map(check_readings, names))

    @property
    def conditions(self) -> tuple[str, ...]:
        """Each controller with each of the readings, by name."""
        return tuple(condition(name, given) for name in self.controllers for given in self.readings)

    def following(self, trial: int) -> int:
        """The trial after one; the first after the last."""
        return (trial + 1) % self.trials

    def unread_here(self) -> Mapping[str, str]:
        """What this robot does not have, and what none of the controllers reads."""
        control = unread_by_all(self.controllers, self.control, self.robot, self.knows)
        return {**unread_limits(self.controllers), **super().unread_here(), **control}

    @model_validator(mode="after")
    def _agree(self) -> TunnelConfig:
        require_different("controllers", self.controllers)
        require_different("knows", self.knows)
        if {"side", "map"} <= set(self.knows):
            raise ValueError("knows: expected side or map, found both; map tells the side, too")
        require_different("readings", self.readings)
        for name in self.readings:
            require_whole_delay(name, self.control.period)
        if YOKED in self.readings and self.trials < 2:
            raise ValueError(
                f"readings {YOKED} are those of the next trial: expected trials of at least 2, "
                f"found {self.trials}"
            )
        require_whole_steps("control.rate", self.control.rate, self.physics.timestep)
        require_own_curves(self.robot, self.control)
        return self


STUCK_GAIN = 0.02
"""Gain of progress that counts as getting on [m]."""
STUCK_TIME = 5.0
"""Time without such a gain after which the robot is stuck [s]."""
_STRETCH = 0.05
"""Length of the pieces of a centre line whose mean offsets count alike [m]."""


Watched = Union[World, "WarpRow"]
"""What is looked at: on the CPU, or in a batch on a device."""


@tabular
class Measured:
    """What is measured of a walk, and of many: pooled over the valid ones."""

    stuck: int = column("stuck episodes", pool=total, form="d", least=0.0, default=0)
    recovered: int = column("  recovered", pool=total, form="d", least=0.0, default=0)
    """Stuck episodes after which the robot got on."""
    force_mean_n: float | None = column("contact force, mean", "N", mean, least=0.0, default=0.0)
    """Summed normal force on robot and antennae, mean over samples at 10 Hz."""
    force_max_n: float | None = column(
        "contact force, largest", "N", largest, form=".1f", least=0.0, default=0.0
    )
    """Largest summed normal force."""
    spring_low_n_m: float | None = column(pool=smallest, default=0.0)
    """Smallest torque of the antenna spring that bore the largest one; negative where it was bent
    the other way, too."""
    spring_high_n_m: float | None = column(
        "spring torque, most", "N·mm", largest, scale=1e3, default=0.0
    )
    """Largest torque of any antenna spring at any tick; the stop of its hinge bounds it."""
    spring_cycles: int | None = column(
        "  load cycles, most", pool=largest, form="d", least=0.0, default=0
    )
    """Load cycles of that spring: half of its reversals larger than a tenth of its range."""


@tabular_row
class TrialResult(Measured):
    """One trial, a row of trials.csv."""

    seed: int
    trial: int
    controller: str = field(metadata=CONDITION)
    """Name of the controller, with its readings if they are not its own."""
    outcome: Outcome
    """How it ended, see above."""
    time_s: float = column(
        "time, a failure as the limit", "s", form=".1f", least=0.0, most="time_limit"
    )
    """Time to the exit; the limit for every failure."""
    limit_s: float = column("time limit", "s", form=".1f", least=0.0, default=TIME_LIMIT)
    progress_m: float = 0.0
    """How far the head came, within 0 and the length of the scene."""
    offset_m: float | None = column("off the middle", "m", form=".3f", least=0.0, default=None)
    """Mean distance of the head from the centre line over the length that it came: each stretch of
    5 cm counts alike, however long it took; empty in a scene without one."""
    share_forward: float = 0.0
    """Share of ticks in FORWARD; so `share_turn_l` and the others."""
    share_turn_l: float = 0.0
    """Share of ticks in TURN_L."""
    share_turn_r: float = 0.0
    """Share of ticks in TURN_R."""
    share_reverse: float = 0.0
    """Share of ticks in REVERSE."""
    share_hold: float = 0.0
    """Share of ticks in HOLD."""
    overturned: bool = False
    """Whether the robot lies on its back at the end."""
    void_decisions: int = 0
    reason: str = ""
    """Why a trial is invalid, with the physics step."""

    def __post_init__(self) -> None:
        require_times(self.time_s, self.limit_s)


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
    """Watches one trial: bends of the antennae in every tick, the rest where the episode looks.

    Attributes:
        episode: Its episode.
        controller: Name of the controller, with its readings if they are not its own.
        before: Obstacles that can move, at the start, as in `TrialPath`.
    """

    episode: Episode
    controller: str
    before: list[Floats] = field(default_factory=list[Floats])
    _best: float = 0.0
    _best_at: float = 0.0
    _stuck: int = 0
    _recovered: int = 0
    _is_stuck: bool = False
    _forces: list[float] = field(default_factory=list)
    _samples: list[tuple[float, float, float, int]] = field(default_factory=list)
    _bends: array[float] = field(default_factory=lambda: array("d"))
    _offsets: dict[int, list[float]] = field(default_factory=dict[int, list[float]])
    _maneuver: int = 0
    _ticks: list[int] = field(default_factory=lambda: [0] * len(Maneuver))

    def tick(self, world: Watched, maneuver: int, failure: object = None) -> Outcome | None:
        """Let a control tick pass; the outcome once there is one.

        Args:
            world: The robot.
            maneuver: What it does.
            failure: What went wrong with it, None if nothing did.
        """
        if failure is None:
            self._maneuver = maneuver
            self._ticks[maneuver] += 1
            self._bends.frombytes(world.bends().tobytes())
        return self.episode.tick(world, failure, self._look)

    def _look(self, world: Watched) -> Outcome | None:
        head, t = world.head[:2], world.t
        x, y = head.tolist()
        self._samples.append((t, x, y, self._maneuver))
        self._forces.append(world.obstacle_force())
        progress = self.episode.progress_of(head)
        self._note_progress(progress, t)
        self._note_offset(progress, head)
        return self.episode.judge.watch(world)

    def _note_progress(self, progress: float, t: float) -> None:
        if progress > self._best + STUCK_GAIN:
            self._best, self._best_at = progress, t
            self._recovered += self._is_stuck
            self._is_stuck = False
        elif not self._is_stuck and t - self._best_at > STUCK_TIME:
            self._is_stuck = True
            self._stuck += 1

    def _note_offset(self, progress: float, head: Floats) -> None:
        """Note how far the head is from the centre line, if there is one."""
        scene = self.episode.scene
        line = getattr(scene, "route", None)
        if line is None or np.shape(line)[1:] != (2,):
            return
        if 0.0 <= progress < scene.length:
            offset = geometry.distance(np.asarray(line, float), head)
            self._offsets.setdefault(int(progress / _STRETCH), []).append(offset)

    def _load(self, world: Watched) -> SpringLoad:
        """What the springs of the antennae bore; beyond a hinge's range its holders meet."""
        from antennate.antenna.load import SpringLoad, largest_load  # not for a bad flag

        hinges = len(world.bends())
        if not hinges:
            return SpringLoad()
        antenna, right = world.robot.antenna, world.robot.right_antenna
        angles = np.frombuffer(self._bends).reshape(-1, hinges)
        most = np.array(antenna.hinge_ranges + right.hinge_ranges)
        held = np.clip(angles, -most, most)
        return largest_load(held, antenna.spring_stiffness() + right.spring_stiffness())

    def result(self, world: Watched) -> TrialResult:
        """The row of the trial, which has ended."""
        episode, ticks = self.episode, np.array(self._ticks)
        share = ticks / max(1, ticks.sum())
        forces = np.array(self._forces) if self._forces else np.zeros(1)
        offsets = [float(np.mean(piece)) for piece in self._offsets.values()]
        load = self._load(world)
        try:
            progress = episode.progress_of(world.head[:2])
        except SceneError:  # as after a simulation that became invalid
            progress = self._best
        return TrialResult(
            seed=episode.seed,
            trial=episode.number,
            controller=self.controller,
            outcome=episode.outcome,
            time_s=round(world.t, 6) if episode.outcome == "success" else episode.limit,
            progress_m=round(float(np.clip(progress, 0.0, episode.scene.length)), 6),
            stuck=self._stuck,
            recovered=self._recovered,
            **{f"share_{m.name.lower()}": round(float(share[m]), 6) for m in Maneuver},
            force_mean_n=round(float(forces.mean()), 6),
            force_max_n=round(float(forces.max()), 6),
            limit_s=episode.limit,
            offset_m=round(float(np.mean(offsets)), 6) if offsets else None,
            spring_low_n_m=round(load.low, 9),
            spring_high_n_m=round(load.high, 9),
            spring_cycles=load.cycles,
            overturned=world.overturned,
            void_decisions=0,  # known where the controller is
            reason=episode.reason,
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
            exit=self.episode.scene.exit,
            links=world.links().copy(),
            parts=world.parts(),
        )
