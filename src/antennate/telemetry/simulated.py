"""The log of a simulated robot: what a drive logs, and the physics beside it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from antennate.robots.spec import RobotSpec
from antennate.sim.contacts import Contacts
from antennate.sim.world import World
from antennate.telemetry.cdr import Form
from antennate.telemetry.header import Header
from antennate.telemetry.rows import HEAD, RowLog
from antennate.telemetry.ticks import floats_of
from antennate.telemetry.topics import CONTACT_FORCES, COORDINATES, Topic
from antennate.types import AntennaFrame, Floats, JointCommand

_LOOK_EVERY = 10
"""Ticks from one look at the contacts to the next: 10 Hz at the usual rate, as in experiments."""


class Decisions:
    """What is read, decided and commanded in each tick, of all rows of a batch at once.

    Args:
        robot: Its description.
        controller: What decides: its `level`, `contact`, `maneuver` and `phase` are read after
            each step.
        batch: B, its rows.
    """

    def __init__(self, robot: RobotSpec, controller: Any, batch: int = 1) -> None:
        self._controller, self._batch = controller, batch
        self._rows: Floats = np.empty((batch, HEAD + len(robot.joint_names)))
        self._t, self._maneuver, self._phase = self._rows.T[:3]
        self._counts, self._level, self._contact = (self._rows[:, at : at + 2] for at in (3, 5, 7))
        self._joints: list[tuple[str, Floats]] = []
        at = HEAD
        for name, shape in robot.command_shapes().items():
            size = math.prod(shape[1:])
            self._joints.append((name, self._rows[:, at : at + size].reshape(batch, *shape[1:])))
            at += size

    def take(self, frame: AntennaFrame, command: JointCommand) -> Floats:
        """One tick: how the rows of its logs begin, shape (B, HEAD + joints).

        The next tick replaces them.
        """
        made = self._controller
        phase = floats_of(made, "phase")
        self._t[:], self._maneuver[:] = frame.t, made.maneuver
        self._phase[:] = phase if len(phase) == self._batch else math.nan
        self._counts[:], self._level[:], self._contact[:] = frame.counts, made.level, made.contact
        for name, part in self._joints:
            part[:] = getattr(command, name)
        return self._rows


class Look(NamedTuple):
    """What is seen beside a tick: the state of the engine and its contacts."""

    place: Floats
    contacts: Contacts


class TickRows:
    """Makes the rows of one simulated robot.

    Args:
        world: The robot in its scene.
    """

    def __init__(self, world: World) -> None:
        self._world, self._angles = world, len(world.robot.joint_names)
        self._decided, self._ticks = HEAD + self._angles, 0
        self._root, place = world.coordinates()
        values = self._root, (0.0,) * len(place)
        self._form = Form(COORDINATES.type, values, ("position",))

    def take(self, decided: Floats, row: Floats) -> Look | None:
        """One tick; what is seen beside it, None where nobody looks.

        Args:
            decided: The robot's row of `Decisions`.
            row: Where all numbers of the tick go, shape (HEAD + 4 joints,).
        """
        row[: self._decided] = decided
        self._world.measure_drives(row[self._decided :].reshape(3, self._angles))
        self._ticks += 1
        if (self._ticks - 1) % _LOOK_EVERY:
            return None
        return Look(self._world.coordinates()[1].copy(), Contacts.of(self._world.data))

    def messages(self, looks: Sequence[Look]) -> list[dict[Topic, bytes]]:
        """The messages of each of some looks; many at once take hardly longer than one."""
        places = np.array([look.place for look in looks])
        rows = self._form.encode(len(looks), {"position": places})
        found = [{COORDINATES: row.tobytes()} for row in rows]
        ends = np.cumsum([len(look.contacts.geoms) for look in looks])
        contacts = Contacts.joined([look.contacts for look in looks])
        which, names, points, forces = self._world.obstacle_contacts(contacts)
        begin, kind = 0, CONTACT_FORCES.type
        for message, end in zip(found, np.searchsorted(which, ends).tolist(), strict=True):
            if begin < end:
                part = slice(begin, end)
                message[CONTACT_FORCES] = kind.encode(names[part], *points[part].T, forces[part])
            begin = end
        return found


class SimulatedLog(RowLog[Look]):
    """The log of one simulated robot, tick by tick; as a context it closes itself.

    Args:
        path: A file that does not exist yet.
        header: What stands at its beginning.
        world: The robot in its scene.

    Raises:
        LogError: The file exists or cannot be written, or the disk is nearly full.
    """

    def __init__(self, path: Path, header: Header, world: World) -> None:
        self._rows = TickRows(world)
        super().__init__(path, header, self._rows.messages)

    def take(self, decided: Floats) -> None:
        """Keep one tick, from the robot's row of `Decisions`.

        Raises:
            LogError: The disk is full or gone.
        """
        self.add(self._rows.take(decided, self.row))
