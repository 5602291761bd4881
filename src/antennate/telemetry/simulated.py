"""The log of a simulated robot: what a drive logs, and the physics beside it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from antennate.robots.spec import RobotSpec
from antennate.sim.places import Contacts
from antennate.sim.trial import LOOK_EVERY
from antennate.sim.world import World
from antennate.telemetry.cdr import Form
from antennate.telemetry.header import Header
from antennate.telemetry.rows import HEAD, RowLog, Rows
from antennate.telemetry.ticks import numbers_of
from antennate.telemetry.topics import CONTACT_FORCES, COORDINATES, Topic
from antennate.types import AntennaFrame, Floats, JointCommand


class Decisions:
    """What is read, decided and commanded in each tick, of all rows of a batch at once.

    Args:
        robot: Its description.
        controller: What decides: its `level`, `contact`, `maneuver` and `phase` are read after
            each step.
        batch: B, its rows.
    """

    def __init__(self, robot: RobotSpec, controller: Any, batch: int = 1) -> None:
        self._controller = controller
        self._unknown = np.full(batch, math.nan)
        self._parts = robot.command_shapes(batch)
        pair = (batch, 2)
        self._layout = np.dtype(
            [
                *(("t", float, batch), ("maneuver", np.int64, batch), ("phase", float, batch)),
                *(("counts", float, pair), ("level", float, pair), ("contact", np.int64, pair)),
                *((name, float, shape) for name, shape in self._parts.items()),
            ]
        )
        self._kinds = [self._layout[name].base for name in self._layout.names or ()]

    def take(self, frame: AntennaFrame, command: JointCommand) -> bytes:
        """One tick, for `rows`: a copy, in one piece, as this is done in every tick."""
        made = self._controller
        try:
            phase: Any = made.phase
            usual = phase.shape == self._unknown.shape and phase.dtype == float
        except KeyboardInterrupt:
            raise
        except BaseException:  # noqa: BLE001 a property of anybody may raise anything
            phase, usual = None, False
        if not usual:
            phase = np.array(numbers_of(made, "phase"))
            phase = phase if phase.shape == self._unknown.shape else self._unknown
        found = [frame.t, made.maneuver, phase, frame.counts, made.level, made.contact]
        found += [getattr(command, name) for name in self._parts]
        if [part.dtype for part in found] != self._kinds:
            found = [part.astype(kind) for part, kind in zip(found, self._kinds, strict=True)]
        try:
            return b"".join(found)
        except TypeError:  # one is a view with gaps
            return b"".join([part.tobytes() for part in found])

    def rows(self, ticks: Sequence[bytes], row: int, into: Floats) -> None:
        """Write how one row of the batch begins in some ticks, shape (n, HEAD + joints)."""
        block, at = np.frombuffer(b"".join(ticks), self._layout), 0
        for name in self._layout.names or ():
            part = block[name][:, row].reshape(len(ticks), -1)
            into[:, at : at + part.shape[1]] = part
            at += part.shape[1]


class TakenTick(NamedTuple):
    """One tick as it was taken: of `Decisions`, of `World.snapshot`, contacts where one looked."""

    decided: bytes
    measured: bytes
    contacts: Contacts | None


class TickRows:
    """Takes the ticks of one simulated robot, and makes the rows and messages of its log of them.

    Args:
        world: The robot in its scene.
        decisions: What is decided for it.
        row: Its row there.
    """

    def __init__(self, world: World, decisions: Decisions, row: int = 0) -> None:
        self._world, self._decisions, self._row = world, decisions, row
        self._angles, self._ticks = len(world.robot.joint_names), 0
        values = world.root, (0.0,) * world.model.nq
        self._form = Form(COORDINATES.type, values, ("position",))

    def take(self, decided: bytes) -> TakenTick:
        """One tick, of which `Decisions` says this."""
        self._ticks += 1
        look = (self._ticks - 1) % LOOK_EVERY == 0
        world = self._world
        return TakenTick(decided, world.snapshot(), Contacts.of(world.data) if look else None)

    def rows(self, ticks: Sequence[TakenTick]) -> Rows:
        """What `RowLog` writes of some ticks; many at once take hardly longer than one."""
        found = np.empty((len(ticks), HEAD + 4 * self._angles))
        end = HEAD + self._angles
        self._decisions.rows([tick.decided for tick in ticks], self._row, found[:, :end])
        measured, places = self._world.measured([tick.measured for tick in ticks])
        found[:, end:] = measured.reshape(len(ticks), -1)
        looks = {i: tick.contacts for i, tick in enumerate(ticks) if tick.contacts is not None}
        return found, self._messages(looks, places) if looks else {}

    def _messages(
        self, looks: Mapping[int, Contacts], places: Floats
    ) -> dict[int, dict[Topic, bytes]]:
        """The messages beside the ticks at which one looked."""
        coordinates = self._form.encode(len(looks), {"position": places[[*looks]]})
        found = {i: {COORDINATES: row.tobytes()} for i, row in zip(looks, coordinates, strict=True)}
        contacts = Contacts.joined([*looks.values()])
        which, names, points, forces = self._world.obstacle_contacts(contacts)
        columns = names, *points.T.tolist(), forces.tolist()
        ends = np.cumsum([len(each.geoms) for each in looks.values()])
        begin, encode = 0, CONTACT_FORCES.type.encode
        for message, end in zip(found.values(), np.searchsorted(which, ends).tolist(), strict=True):
            if begin < end:
                message[CONTACT_FORCES] = encode(*(column[begin:end] for column in columns))
            begin = end
        return found


class SimulatedLog(RowLog[TakenTick]):
    """The log of one simulated robot, tick by tick; as a context it closes itself.

    Args:
        path: A file that does not exist yet.
        header: What stands at its beginning.
        world: The robot in its scene.
        decisions: What is decided for it.
        row: Its row there.

    Raises:
        LogError: The file exists or cannot be written, or the disk is nearly full.
    """

    def __init__(
        self, path: Path, header: Header, world: World, decisions: Decisions, row: int = 0
    ) -> None:
        self._ticks = TickRows(world, decisions, row)
        super().__init__(path, header, self._ticks.rows)

    def take(self, decided: bytes) -> None:
        """Keep one tick, of which `Decisions` says this.

        Raises:
            LogError: The disk is full or gone.
        """
        self.add(self._ticks.take(decided))
