"""The log of a simulated robot: what a drive logs, and the physics beside it."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np

from antennate.robots.spec import RobotSpec
from antennate.sim.world import World
from antennate.telemetry.header import Header
from antennate.telemetry.rows import HEAD, RowLog, TickRow
from antennate.telemetry.ticks import numbers_of
from antennate.telemetry.topics import CONTACT_FORCES, COORDINATES
from antennate.types import AntennaFrame, Floats, JointCommand

_LOOK_EVERY = 10
"""Ticks from one look at the contacts to the next: 10 Hz at the usual rate, as in experiments."""


class TickRows:
    """Makes the rows of one simulated robot.

    Args:
        robot: Its description.
        controller: What decides: its `level`, `contact`, `maneuver` and `phase` are read after
            each step.
        world: The simulated robot in its scene.
        row: Row of the batch.
    """

    def __init__(self, robot: RobotSpec, controller: Any, world: World, row: int = 0) -> None:
        self._controller, self._world, self._row = controller, world, row
        self._parts = list(robot.command_shapes())
        angles = len(robot.joint_names)
        self._numbers: Floats = np.empty(HEAD + 4 * angles)
        self._decided = self._numbers[3 : HEAD + angles]
        self._measured = self._numbers[HEAD + angles :].reshape(3, angles)
        self._ticks = 0

    def take(self, frame: AntennaFrame, command: JointCommand) -> TickRow:
        """One tick; its numbers are replaced by those of the next one."""
        row, made, world, numbers = self._row, self._controller, self._world, self._numbers
        phases = numbers_of(made, "phase")
        phase = phases[row] if len(phases) == len(frame.t) else math.nan
        numbers[:3] = frame.t[row], made.maneuver[row], phase
        joints = [getattr(command, name)[row].ravel() for name in self._parts]
        decided = [frame.counts[row], made.level[row], made.contact[row], *joints]
        np.concatenate(decided, out=self._decided)
        world.measure_drives(self._measured)
        self._ticks += 1
        if (self._ticks - 1) % _LOOK_EVERY:
            return TickRow(numbers)
        place = COORDINATES.type.encode(*world.coordinates())
        return TickRow(numbers, _contacts(world), place)


def _contacts(world: World) -> bytes | None:
    names, places, forces = world.obstacle_contacts()
    if not names:
        return None
    return CONTACT_FORCES.type.encode(names, *places.T.tolist(), forces.tolist())


class SimulatedLog(RowLog):
    """The log of one row of a batch, tick by tick; as a context it closes itself.

    Args:
        path: A file that does not exist yet.
        header: What stands at its beginning.
        controller, world, row: As for `TickRows`.

    Raises:
        LogError: The file exists or cannot be written, or the disk is nearly full.
    """

    def __init__(
        self, path: Path, header: Header, controller: Any, world: World, row: int = 0
    ) -> None:
        super().__init__(path, header)
        self._rows = TickRows(header.robot, controller, world, row)

    def take(self, frame: AntennaFrame, command: JointCommand) -> None:
        """Keep one tick.

        Raises:
            LogError: The disk is full or gone.
        """
        self.add(self._rows.take(frame, command))
