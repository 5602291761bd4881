"""One trial of `antennate climb`: what is watched, when it ends, and its row."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from antennate.experiments.climb.config import (
    Cell,
    ClimbConfig,
    cells,
    config_of,
    limit_of,
    seed_of,
)
from antennate.experiments.climb.criterion import Criterion
from antennate.experiments.climb.grounds import FLAT
from antennate.experiments.climb.load import PitchLoad
from antennate.experiments.climb.rows import ClimbRow, Place
from antennate.experiments.climb.sensing import Touch, Verdict
from antennate.experiments.tunnel.batch import run_trials, watched
from antennate.sim.episode import Episode
from antennate.sim.world import World
from antennate.types import Controller, Floats

if TYPE_CHECKING:
    from antennate.telemetry.view.simulation import SimulationView

DRAWN = 1
"""Trials of each cell whose course is kept for the figure."""
_EVERY = 0.2
"""Between two postures that are kept [s]."""
_STRIDE = 2.0
"""Between two places by which the way is summed up [s]: more than a gait cycle."""


@dataclass(frozen=True, slots=True)
class ClimbPath:
    """A course from the side.

    Attributes:
        t: Times [s], shape (n,).
        links: Places of the links, head first [m], shape (n, L, 3).
        plan: Distance of the head past the first edge by the plan [m], NaN without one, shape (n,).
        edge: Where the first edge is along x [m], NaN without one.
        height: Its height [m].
    """

    t: Floats
    links: Floats
    plan: Floats
    edge: float
    height: float


class ClimbMonitor:
    """Watches one trial.

    Args:
        config: The run.
        cell: Its cell.
        row: Row of the batch.
        episode: Its episode.
        controller: controller() gives the one that walks all rows.

    Attributes:
        episode: As given.
    """

    def __init__(
        self,
        config: ClimbConfig,
        cell: Cell,
        row: int,
        episode: Episode,
        controller: Callable[[], Any],
    ) -> None:
        self.episode, scene = episode, episode.scene
        self._config, self._cell, self._row, self._controller = config, cell, row, controller
        edges = getattr(scene, "edges", ())
        self._edge = edges[0] if edges else None
        self._pitch = config.robot.link_pitch
        self._criterion = Criterion(cell, episode, self._pitch)
        self._verdict = Verdict()
        self._touch: Touch | None = None
        self._load: PitchLoad | None = None
        self._ahead: float | None = None
        self._errors: dict[int, float | None] = {}
        self._climbs, self._climbing = 0, False
        self._began: tuple[float, float] | None = None
        self._way, self._walked = 0.0, 0.0
        self._last = (-math.inf, np.zeros(2))
        self._course: list[tuple[float, Floats, float]] = []

    def tick(self, world: World, maneuver: int, failure: object = None) -> str | None:
        """Let a control tick pass; the outcome once there is one."""
        if failure is None:
            self._follow(world)
        return self.episode.tick(world, failure, self._look)

    def _follow(self, world: World) -> None:
        """Follow the climb and what is felt, tick by tick."""
        control = self._controller()
        body, rule = getattr(control, "body", None), getattr(control, "rule", None)
        head = world.link_places()[:, 0]
        if body is not None:
            climbing = bool(np.isfinite(body.progress[self._row]).any())
            self._climbs += climbing and not self._climbing
            self._climbing = climbing
        if rule is not None and hasattr(rule, "stage"):
            self._feel(world, rule)
        if self._edge is None:
            return
        self._cross(head - self._edge.x, body)
        if self._began is None and head[0] > self._edge.x - self._pitch:
            self._began = (world.t, float(head.mean()))
        if self._began is not None and world.robot.pitch_count:
            self._load = self._load or PitchLoad(world)
            self._load.add(world)

    def _feel(self, world: World, rule: Any) -> None:
        """Follow the first thing that is felt."""
        if self._touch is None and self._edge is not None:
            self._touch = Touch(world, self._edge.x, self._edge.rise > 0.0)
        if self._touch is not None:
            self._touch.look(world)
        at = self._row
        before = self._verdict.felt_at
        stage, ground = int(rule.stage[at]), int(rule.ground[at])
        self._verdict.look(stage, ground, float(rule.height[at]), world.t)
        if before is None and self._verdict.felt_at is not None and self._edge is not None:
            self._ahead = self._edge.x - float(world.head[0])

    def _cross(self, past: Floats, body: Any) -> None:
        """Note how wrong the plan is when the centre of a link crosses the edge."""
        for link in np.flatnonzero(past >= 0.0).tolist():
            if link not in self._errors:
                plan = self._plan(past[0], body)
                self._errors[link] = None if math.isnan(plan) else plan - float(past[0])

    def _plan(self, past: float, body: Any) -> float:
        """Where the head is past the edge by the nearest of all plans [m], NaN without one."""
        plans = np.array([]) if body is None else body.progress[self._row]
        plans = plans[np.isfinite(plans)]
        return float(plans[abs(plans - past).argmin()]) if len(plans) else math.nan

    def _look(self, world: World) -> str | None:
        """Keep the way and the course; the outcome once there is one."""
        links, t = world.link_places(), world.t
        middle = links[:, :2].mean(axis=0)
        if t - self._last[0] >= _STRIDE:
            if self._last[0] >= 0.0:
                self._way += float(np.hypot(*(middle - self._last[1])))
                self._walked += t - self._last[0]
            self._last = (t, middle)
        if self.episode.number < DRAWN and (
            not self._course or t - self._course[-1][0] > _EVERY - 1e-6
        ):
            edge = math.nan if self._edge is None else self._edge.x
            plan = self._plan(links[0, 0] - edge, getattr(self._controller(), "body", None))
            self._course.append((t, links, plan))
        return self._criterion.look(world, links, self._verdict)

    def result(self, world: World) -> ClimbRow:
        """The row of the trial, which has ended."""
        felt = self._verdict
        links = world.link_places()
        took = None if self._began is None else max(world.t - self._began[0], 1e-9)
        onset = self._touch.since if self._touch is not None else None
        feels = self._cell.condition == "climb"
        height = felt.height if felt.felt_at is not None and math.isfinite(felt.height) else None
        return ClimbRow(
            **vars(_place(self._config, self._cell, self.episode.number)),
            outcome=self.episode.outcome,
            time_s=round(min(self.episode.limit, world.t), 6),
            climb_time_s=_rounded(took),
            speed_m_s=_rounded(self._speed(links, took)),
            **({} if self._load is None else self._load.columns()),
            climbs=self._climbs,
            walked_m=round(self._way, 6),
            verdict=felt.ground.name if feels else None,
            felt_height_m=_rounded(height),
            ahead_m=_rounded(self._ahead),
            latency_s=_rounded(
                None if onset is None or felt.felt_at is None else felt.felt_at - onset
            ),
            plan_error_m=" ".join(
                f"{link}:{error:.4f}" for link, error in self._errors.items() if error is not None
            ),
            reason=self.episode.reason,
        )

    def _speed(self, links: Floats, took: float | None) -> float | None:
        """Speed over the edge [m/s], on the flat floor that of all its way."""
        if self._cell.scene == FLAT:
            return self._way / self._walked if self._walked else None
        if took is None or self._began is None:
            return None
        return (float(links[:, 0].mean()) - self._began[1]) / took

    def path(self, world: World) -> ClimbPath | None:
        """The course of the first trials of a cell that is climbed."""
        if self.episode.number >= DRAWN or self._cell.part != "climbing" or not self._course:
            return None
        t, links, plan = zip(*self._course, strict=True)
        scene: Any = self.episode.scene
        return ClimbPath(
            np.array(t), np.array(links), np.array(plan), scene.edges[0].x, scene.edges[0].rise
        )


def _rounded(value: float | None) -> float | None:
    return None if value is None or not math.isfinite(value) else round(float(value), 6)


def _place(config: ClimbConfig, cell: Cell, trial: int) -> Place:
    return Place(
        seed=seed_of(config, cell),
        cell=cell.name,
        trial=trial,
        part=cell.part,
        condition=cell.condition,
        ground=cell.ground,
        height_m=cell.height,
        divisor=cell.divisor,
    )


def lost_row(config: ClimbConfig, name: str, trial: int, reason: str) -> ClimbRow:
    """The row of a trial of which there is nothing else."""
    cell = cells(config)[name]
    place, limit = vars(_place(config, cell, trial)), limit_of(config, cell)
    return ClimbRow(**place, outcome="invalid", time_s=limit, reason=reason)


def carry_out(
    config: ClimbConfig,
    name: str,
    trials: Sequence[int],
    emit: Callable[[tuple[ClimbRow, ClimbPath | None]], None],
    view: SimulationView | None = None,
) -> None:
    """Run trials of one cell in lockstep, and emit each as it ends; a page may show them."""
    cell = cells(config)[name]
    apparatus = watched(view)
    made: list[Controller] = []

    def keep(kind: Any, control: Any = None, robot: Any = None, batch: int = 1) -> Controller:
        made.append(apparatus.controller(kind, control, robot, batch))
        return made[-1]

    def monitor(row: int, episode: Episode) -> ClimbMonitor:
        return ClimbMonitor(config, cell, row, episode, lambda: made[-1])

    def take(item: tuple[Any, Any]) -> None:
        row, path = item
        if not isinstance(row, ClimbRow):
            row, path = lost_row(config, name, row.trial, row.reason), None
        emit((row, path))

    simulated = config_of(config, cell)
    with_cell = replace(apparatus, controller=keep, monitor=monitor)
    run_trials(simulated, simulated.controllers[0], trials, take, apparatus=with_cell)
