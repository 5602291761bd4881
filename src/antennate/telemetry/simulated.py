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


class Decisions:
    """What is read, decided and commanded in each tick, of all rows of a batch at once.

    Args:
        robot: Its description.
        controller: What decides: its `level`, `contact`, `maneuver` and `phase` are read after
            each step.
    """

    def __init__(self, robot: RobotSpec, controller: Any) -> None:
        self._controller, self._parts = controller, list(robot.command_shapes())

    def take(self, frame: AntennaFrame, command: JointCommand) -> Floats:
        """One tick: how the rows of its logs begin, shape (B, HEAD + joints)."""
        made, batch = self._controller, len(frame.t)
        phases = numbers_of(made, "phase")
        phase = phases if len(phases) == batch else (math.nan,) * batch
        head = np.array([frame.t, made.maneuver, phase]).T
        joints = [getattr(command, name).reshape(batch, -1) for name in self._parts]
        return np.concatenate([head, frame.counts, made.level, made.contact, *joints], axis=1)


class TickRows:
    """Makes the rows of one simulated robot.

    Args:
        world: The robot in its scene.
    """

    def __init__(self, world: World) -> None:
        self._world = world
        angles = len(world.robot.joint_names)
        self._numbers: Floats = np.empty(HEAD + 4 * angles)
        self._decided = self._numbers[: HEAD + angles]
        self._measured = self._numbers[HEAD + angles :].reshape(3, angles)
        self._ticks = 0

    def take(self, decided: Floats) -> TickRow:
        """One tick, from the robot's row of `Decisions`; the next one replaces its numbers."""
        self._decided[:] = decided
        self._world.measure_drives(self._measured)
        self._ticks += 1
        if (self._ticks - 1) % _LOOK_EVERY:
            return TickRow(self._numbers)
        place = COORDINATES.type.encode(*self._world.coordinates())
        return TickRow(self._numbers, _contacts(self._world), place)


def _contacts(world: World) -> bytes | None:
    names, places, forces = world.obstacle_contacts()
    if not names:
        return None
    return CONTACT_FORCES.type.encode(names, *places.T.tolist(), forces.tolist())


class SimulatedLog(RowLog):
    """The log of one simulated robot, tick by tick; as a context it closes itself.

    Args:
        path: A file that does not exist yet.
        header: What stands at its beginning.
        world: The robot in its scene.

    Raises:
        LogError: The file exists or cannot be written, or the disk is nearly full.
    """

    def __init__(self, path: Path, header: Header, world: World) -> None:
        super().__init__(path, header)
        self._rows = TickRows(world)

    def take(self, decided: Floats) -> None:
        """Keep one tick, from the robot's row of `Decisions`.

        Raises:
            LogError: The disk is full or gone.
        """
        self.add(self._rows.take(decided))
