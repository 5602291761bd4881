"""The world of a log: where everything is at a time."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from antennate.params.scene import PhysicsParams
from antennate.sim.world import World, compile_world
from antennate.telemetry.header import Header
from antennate.telemetry.ticks import Tick
from antennate.types import Floats


class LogScene:
    """A world that is put where a log says, without physics.

    Args:
        header: The header of the log.
        arena: The world in which it was simulated, None for a bare floor.
        count: Coordinates of that world that the log tells, 0 for those of joints alone.

    Attributes:
        world: The world.
    """

    def __init__(self, header: Header, arena: World | None, count: int = 0) -> None:
        robot = header.robot
        whole = arena if arena is not None and arena.model.nq == count else None
        self._bare = whole is None
        self.world = whole or World(compile_world(PhysicsParams(), robot), robot)
        self._last: tuple[float, Floats] = (-math.inf, np.zeros(0))
        self._before = self._last

    def take(self, t: float, place: Sequence[float], robot: int) -> None:
        """Coordinates at a time [s], those of the robot from a number on.

        Without the arena these alone are used.
        """
        coordinates = np.array(place)
        if self._bare:
            coordinates = coordinates[robot : robot + self.world.model.nq]
        self._before, self._last = self._last, (t, coordinates)

    def place(self, t: float) -> None:
        """Put all where it is at a time [s], between the last two places known: a little late."""
        (first, before), (last, now) = self._before, self._last
        share = (t - last) / (last - first) if math.isfinite(first) and last > first else 1.0
        place = now if share >= 1.0 else before + max(0.0, share) * (now - before)
        if len(place) == self.world.model.nq:
            self.world.place_all(place)

    def place_joints(self, tick: Tick) -> None:
        """Put the joints where they were measured, or commanded where that is unknown."""
        angles = np.array(tick.positions or tick.angles)
        before = self.world.drives()
        if angles.shape == before.shape:
            self.world.place_drives(np.where(np.isfinite(angles), angles, before))
