"""The log of a simulated robot: what a drive logs, and the physics beside it.

Simulated time runs much faster than a robot's, so ticks are collected as rows of one array and
encoded many at once.
"""

from __future__ import annotations

import math
import time
from pathlib import Path
from typing import Any

import numpy as np

from antennate.sim.world import World
from antennate.telemetry.header import Header
from antennate.telemetry.topics import (
    ANTENNA,
    CONTACT_FORCES,
    COORDINATES,
    JOINT_COMMANDS,
    JOINT_STATES,
    MANEUVER,
)
from antennate.telemetry.writer import FLUSH, LogWriter
from antennate.types import AntennaFrame, Floats, JointCommand

_LEAST_FREE = 1e8
"""Room for many trials [byte] (assumed)."""
_MOST = 256
"""Ticks that are encoded at once."""
_FORCES_EVERY = 10
"""Ticks from one look at the contacts to the next: 10 Hz at the usual rate, as in experiments."""
_HEAD = 9
"""Numbers of a row before those of the joints: t, counts, level, contact, maneuver, phase."""


class SimulatedLog:
    """The log of one row of a batch, tick by tick; as a context it closes itself.

    Args:
        path: A file that does not exist yet.
        header: What stands at its beginning.
        controller: What decides: its `level`, `contact`, `maneuver` and `phase` are read after
            each step.
        world: The simulated robot in its scene.
        row: Row of the batch.

    Attributes:
        path: The file.

    Raises:
        LogError: The file exists or cannot be written, or the disk is nearly full.
    """

    def __init__(
        self, path: Path, header: Header, controller: Any, world: World, row: int = 0
    ) -> None:
        self.path = path
        self._out = LogWriter(path, header, _LEAST_FREE)
        self._controller, self._world, self._row = controller, world, row
        self._parts = list(header.robot.command_shapes())
        self._names, self._angles = header.robot.joint_names, len(header.robot.joint_names)
        self._held: Floats = np.empty((_MOST, _HEAD + 4 * self._angles))
        self._forces: list[bytes | None] = []
        self._coordinates: list[bytes | None] = []
        self._count, self._since = 0, math.inf

    def take(self, frame: AntennaFrame, command: JointCommand) -> None:
        """Keep one tick.

        Raises:
            LogError: The disk is full or gone.
        """
        row, made, world, held = self._row, self._controller, self._world, self._held[self._count]
        phase = getattr(made, "phase", None)
        held[0] = frame.t[row]
        held[1:3], held[3:5], held[5:7] = frame.counts[row], made.level[row], made.contact[row]
        held[7], held[8] = made.maneuver[row], math.nan if phase is None else phase[row]
        at = _HEAD
        for name in self._parts:
            part = getattr(command, name)[row].ravel()
            held[at : at + len(part)] = part
            at += len(part)
        for measured in (world.drives(), world.drive_speeds(), world.drive_torques()):
            held[at : at + self._angles] = measured
            at += self._angles
        now = time.monotonic()
        self._since = min(self._since, now)
        self._count += 1
        looked = (self._out.written + self._count) % _FORCES_EVERY == 0
        self._forces.append(self._contacts() if looked else None)
        place = COORDINATES.type.encode(*world.coordinates()) if looked else None
        self._coordinates.append(place)
        if self._count == _MOST or now - self._since >= FLUSH:
            self._hand_over()

    def event(self, text: str) -> None:
        """Keep what happened after the last tick.

        Raises:
            LogError: The disk is full or gone.
        """
        self._hand_over()
        self._out.event(text)

    def close(self) -> None:
        """End it.

        Raises:
            LogError: The disk is full or gone.
        """
        self._hand_over()
        self._out.close()

    def __enter__(self) -> SimulatedLog:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _contacts(self) -> bytes | None:
        names, places, forces = self._world.obstacle_contacts()
        if not names:
            return None
        return CONTACT_FORCES.type.encode(names, *places.T.tolist(), forces.tolist())

    def _hand_over(self) -> None:
        """Encode and write what is held."""
        count, self._count, self._since = self._count, 0, math.inf
        forces, self._forces = self._forces, []
        coordinates, self._coordinates = self._coordinates, []
        if not count:
            return
        rows = self._held[:count]
        t, angles = rows[:, 0], self._angles
        joints = [rows[:, at : at + angles] for at in range(_HEAD, rows.shape[1], angles)]
        pair, nothing = (0.0, 0.0), (0.0,) * angles
        stamps = np.rint(1e9 * t).astype(np.int64)
        time = {"sec": stamps // 10**9, "nanosec": stamps % 10**9}
        commanded, measured = (0, 0, "", self._names), (0, 0, "", self._names, *3 * (nothing,))
        self._out.write_many(
            t.tolist(),
            {
                ANTENNA: ANTENNA.type.encode_many(
                    (0.0, pair, pair, pair, (0, 0), math.nan),
                    {
                        "t": t,
                        "counts": rows[:, 1:3],
                        "reading": rows[:, 1:3],
                        "level": rows[:, 3:5],
                        "contact": rows[:, 5:7].astype(np.int64),
                    },
                ),
                MANEUVER: MANEUVER.type.encode_many(
                    (0, 0.0, 0, 0.0, True),
                    {
                        "number": self._out.written + 1 + np.arange(count),
                        "now": t,
                        "maneuver": rows[:, 7].astype(np.int64),
                        "phase": rows[:, 8],
                    },
                ),
                JOINT_COMMANDS: JOINT_COMMANDS.type.encode_many(
                    (*commanded, nothing, (), ()), time | {"position": joints[0]}
                ),
                JOINT_STATES: JOINT_STATES.type.encode_many(
                    measured,
                    time | dict(zip(("position", "velocity", "effort"), joints[1:], strict=True)),
                ),
                CONTACT_FORCES: forces,
                COORDINATES: coordinates,
            },
        )
