"""What `climb` feels of the ground beside what is there: its first verdict, and the first touch."""

from __future__ import annotations

import numpy as np

from antennate.control.climbing.rule import Ground as Felt
from antennate.control.climbing.rule import Stage
from antennate.sim.world import World

_HIGHER = ("level1", "step")
"""Names of what is higher behind the edge: a level of ground, or the step of a tunnel."""


class Touch:
    """When the antennae first meet the edge of a scene; asked after every tick.

    Args:
        world: The robot in its scene.
        edge: Where the edge is along x [m].
        rises: Whether the ground rises there.
    """

    def __init__(self, world: World, edge: float, rises: bool) -> None:
        places, model = world.places, world.model
        names = np.array(places.parts)
        self._sides = [
            np.flatnonzero(places.own & np.char.startswith(names, f"antenna_{side}_"))
            for side in ("l", "r")
        ]
        ids = [geom.id for geom in map(model.geom, range(model.ngeom)) if geom.name in _HIGHER]
        self._step = ids[0] if rises else -1
        self._edge = edge
        self.since: float | None = None

    def look(self, world: World) -> None:
        """Look at the world after a tick."""
        if self.since is None and (self._touches(world) if self._step >= 0 else self._past(world)):
            self.since = world.t

    def _touches(self, world: World) -> bool:
        pairs = world.data.contact.geom
        on_step = (pairs == self._step).any(axis=1)
        return bool(np.isin(pairs[on_step], np.concatenate(self._sides)).any())

    def _past(self, world: World) -> bool:
        x = world.data.geom_xpos[:, 0]
        return max(float(x[side].max()) for side in self._sides) > self._edge


class Verdict:
    """What `climb` takes the first thing for that it feels: from a probe to the walk after it."""

    def __init__(self) -> None:
        self.ground, self.height = Felt.FLOOR, 0.0
        self.felt_at: float | None = None
        self.told = False

    def look(self, stage: int, ground: int, height: float, t: float) -> None:
        """Take stage and verdict of the rule after a tick at t [s]."""
        if self.told or (self.felt_at is None and stage == Stage.WALK):
            return
        if self.felt_at is None:
            self.felt_at = t
        if ground != Felt.FLOOR:
            self.ground, self.height = Felt(ground), height
        if stage not in (Stage.PROBE_UP, Stage.PROBE_DOWN, Stage.LIFT, Stage.CHECK):
            self.told = True
