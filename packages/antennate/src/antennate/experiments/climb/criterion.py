"""How a trial of `antennate climb` ends: the criterion of each part and ground."""

from __future__ import annotations

from typing import Any

from antennate.control.climbing.rule import Ground as Felt
from antennate.experiments.climb.config import CLIFF, LEVEL, Cell
from antennate.experiments.climb.grounds import FLAT
from antennate.experiments.climb.sensing import Verdict
from antennate.sim.episode import Episode, has_fallen, in_time
from antennate.sim.world import World
from antennate.types import Floats

HALF_WIDTH = 2.5
"""Farther to the side, or behind the start, a robot has left [m]: the ground ends at 3 m."""
AFTER = 15.0
"""Time for which a robot at a drop is watched on after it felt it [s]: it backs off and turns in
7 s, and could still fall."""


def is_over(links: Floats, edge: float, landing: float, pitch: float) -> bool:
    """Whether all links stand behind an edge and above the ground there.

    Args:
        links: Places of the links [m], shape (L, 3).
        edge: Where the last edge is along x [m].
        landing: Height of the ground behind it [m].
        pitch: Distance by which each link has to be past it [m].
    """
    past = links[:, 0].min() > edge + pitch
    return bool(past and abs(links[:, 1]).max() < HALF_WIDTH and links[:, 2].min() > landing)


def has_left(links: Floats) -> bool:
    """Whether a robot is beside or behind the ground of its trial; places of shape (L, 3) [m]."""
    return bool(abs(links[:, 1]).max() > HALF_WIDTH or links[:, 0].min() < -HALF_WIDTH)


class Criterion:
    """Says how a trial ends, from one look to the next.

    Args:
        cell: Its cell.
        episode: Its episode; at its time limit a flat floor is walked.
        pitch: Distance between two links [m].
    """

    def __init__(self, cell: Cell, episode: Episode, pitch: float) -> None:
        self._cell, self._trial, self._pitch = cell, episode, pitch
        self._scene: Any = episode.scene

    def look(self, world: World, links: Floats, verdict: Verdict) -> str | None:
        """The outcome, None if the trial goes on.

        Args:
            world: The robot.
            links: Places of its links [m], shape (L, 3).
            verdict: What it feels.
        """
        late = "timeout"
        if world.overturned:
            ended = "overturned"
        elif self._cell.part == "ground":
            late = "walked" if self._cell.scene == FLAT else late
            ended = self._on_ground(world, links, verdict)
        elif has_left(links):
            ended = "left"
        elif self._cell.part == "climbing":
            ended = self._over(links)
        else:
            late = "felt" if self._cell.ground in LEVEL else late
            ended = self._felt(world.t, links, verdict)
        return in_time(ended, world.t, self._trial.limit, late)

    def _over(self, links: Floats) -> str | None:
        scene = self._scene
        landing = scene.ground + sum(edge.rise for edge in scene.edges)
        return "success" if is_over(links, scene.edges[-1].x, landing, self._pitch) else None

    def _on_ground(self, world: World, links: Floats, verdict: Verdict) -> str | None:
        """Crossed, left, fell or stopped; in a tunnel as its exit says."""
        if self._cell.scene == FLAT:
            return None
        if self._cell.scene == "step_tunnel":
            return self._trial.judge.look(world.head[:2])
        if has_left(links):
            return "left"
        if has_fallen(links, self._scene.ground):
            return "fell"
        before = links[:, 0].max() < self._scene.edges[0].x
        stands = before and verdict.ground == Felt.DROP and _is_past(verdict, world.t)
        return self._over(links) or ("stopped" if stands else None)

    def _felt(self, t: float, links: Floats, verdict: Verdict) -> str | None:
        """Felt, stopped or fell: the trial is there for a verdict."""
        cell, scene = self._cell, self._scene
        if cell.ground in LEVEL:
            past = links[-1, 0] > scene.length if cell.scene == "rubble" else False
            return "felt" if past else None
        if cell.scene == "step_down" and has_fallen(links, scene.ground):
            return "fell"
        if cell.ground == CLIFF:
            return "stopped" if _is_past(verdict, t) else None
        return "felt" if verdict.told or links[0, 0] > scene.edges[0].x + self._pitch else None


def _is_past(verdict: Verdict, t: float) -> bool:
    """Whether something was told, and felt for the first time long ago."""
    return verdict.told and verdict.felt_at is not None and t > verdict.felt_at + AFTER
