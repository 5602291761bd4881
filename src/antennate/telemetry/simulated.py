"""The log of a simulated robot: what a drive logs, and the physics beside it."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np

from antennate.sim.world import World
from antennate.telemetry.header import Header
from antennate.telemetry.ticks import Tick
from antennate.telemetry.topics import CONTACT_FORCES
from antennate.telemetry.writer import LogWriter
from antennate.types import AntennaFrame, Floats, JointCommand

_LEAST_FREE = 1e8
"""Room for many trials [byte] (assumed)."""


class SimulatedLog:
    """The log of one row of a batch, tick by tick.

    Args:
        path: A file that does not exist yet.
        header: What stands at its beginning.
        controller: What decides: its `level`, `contact`, `maneuver` and `phase` are read after
            each step.
        world: The simulated robot in its scene.
        row: Row of the batch.

    Raises:
        LogError: The file exists or cannot be written, or the disk is nearly full.
    """

    def __init__(
        self, path: Path, header: Header, controller: Any, world: World, row: int = 0
    ) -> None:
        self._out = LogWriter(path, header, _LEAST_FREE)
        self._controller, self._world, self._row = controller, world, row
        self._parts = list(header.robot.command_shapes())

    def take(self, frame: AntennaFrame, command: JointCommand) -> None:
        """Keep one tick.

        Raises:
            LogError: The disk is full or gone.
        """
        row, made, world = self._row, self._controller, self._world
        parts = [getattr(command, name)[row].ravel() for name in self._parts]
        phase = getattr(made, "phase", None)
        left, right = frame.counts[row].tolist()
        t = float(frame.t[row])
        tick = Tick(
            number=self._out.written + 1,
            t=t,
            now=t,
            counts=(left, right),
            reading=(left, right),
            level=tuple(made.level[row].tolist()),
            contact=tuple(made.contact[row].tolist()),
            maneuver=int(made.maneuver[row]),
            phase=math.nan if phase is None else float(phase[row]),
            angles=tuple(np.concatenate(parts).tolist()),
            positions=tuple(world.drives().tolist()),
            velocities=tuple(world.drive_speeds().tolist()),
            efforts=tuple(world.drive_torques().tolist()),
        )
        names, places, forces = world.obstacle_contacts()
        self._out.write(tick, [(CONTACT_FORCES, _message(names, places, forces))] if names else ())

    def close(self) -> None:
        """End it.

        Raises:
            LogError: The disk is full or gone.
        """
        self._out.close()


def _message(names: list[str], places: Floats, forces: Floats) -> bytes:
    return CONTACT_FORCES.type.encode(names, *places.T.tolist(), forces.tolist())
