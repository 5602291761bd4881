"""How far a twin has come in its tunnel, as the monitor of a trial would say."""

from __future__ import annotations

import math

import numpy as np

from antennate.sim import geometry
from antennate.sim.arena import Tunnel
from antennate.sim.world import World

_EVERY = 10
"""Ticks between two looks: 10 Hz at the usual rate, as in a trial."""


class Passage:
    """Follows the head along the centre line.

    Args:
        tunnel: Where the robot walks.

    Attributes:
        progress: Where the head is, along the centre line [m].
        passed: Time of walking at which the head passed the exit [s], inf before.
    """

    def __init__(self, tunnel: Tunnel) -> None:
        self._tunnel = tunnel
        self._ticks = 0
        self.progress = 0.0
        self.passed = math.inf

    def watch(self, world: World) -> None:
        """Look at the world after a tick."""
        self._ticks += 1
        if self._ticks % _EVERY:
            return
        head = np.array([float(world.head[0]), float(world.head[1])])
        self.progress = geometry.progress(self._tunnel.centre, head)
        if self.progress >= self._tunnel.params.length:
            self.passed = min(self.passed, world.t)

    @property
    def said(self) -> str:
        """In words."""
        length = self._tunnel.params.length
        if self.passed < math.inf:
            return f"the head passed the exit after {self.passed:.1f} s of walking"
        return f"the head came {self.progress:.2f} m of {length:.2f} m"
