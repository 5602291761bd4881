"""The log of a simulated robot: what a drive logs, and the physics beside it.

Simulated time runs much faster than a robot's, so ticks are collected as rows of numbers and
encoded many at once, by a thread: the simulation goes on meanwhile, as the engine lets other
threads run.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple, Self

import numpy as np

from antennate.robots.imu import AXES
from antennate.robots.spec import RobotSpec
from antennate.sim.judge import LOOK_EVERY
from antennate.sim.places import Contacts
from antennate.sim.world import World
from antennate.telemetry.cdr import Form
from antennate.telemetry.header import Header
from antennate.telemetry.ticks import numbers_of
from antennate.telemetry.topics import (
    ANTENNA,
    CONTACT_FORCES,
    COORDINATES,
    IMU,
    JOINT_COMMANDS,
    JOINT_STATES,
    MANEUVER,
    MOTION,
    Topic,
    imu_values,
)
from antennate.telemetry.writer import LogWriter
from antennate.types import AntennaFrame, Floats, JointCommand

HEAD = 9
"""Numbers of a row before those of the joints: t, maneuver, phase, counts, level, contact."""
Rows = tuple[Floats, Mapping[int, Mapping[Topic, bytes]]]
"""Numbers of some ticks, shape (n, HEAD + 4 joints): what `HEAD` says, then the angles commanded
[rad], and angles [rad], speeds [rad/s] and torques [N·m] measured. With an inertial sensor, behind
the commanded angles: angular velocity [rad/s] and specific force [m/s²], six more. Beside them, by
tick, messages of `CONTACT_FORCES` and `COORDINATES`."""
_LEAST_FREE = 1e8
"""Room for many trials [byte] (assumed)."""
_MOST = 256
"""Ticks that are encoded at once."""
_MUCH = 1 << 22
"""Bytes of bodies and contacts beyond which they are encoded in two parts: no reader takes a chunk
of more than 8 MB."""
_PATIENCE = 0.15
"""Longest that a tick waits for others [s]; where there are many logs, for their thread too."""


class RowLog:
    """One file, new; as a context it closes itself.

    Args:
        path: A file that does not exist yet.
        header: What stands at its beginning.
        rows: Makes the rows of ticks that were added, many at once.

    Attributes:
        path: The file.

    Raises:
        LogError: The file exists or cannot be written, or the disk is nearly full.
    """

    def __init__(self, path: Path, header: Header, rows: Callable[[Sequence[Any]], Rows]) -> None:
        self.path, self._rows = path, rows
        self._out = LogWriter(path, header, _LEAST_FREE)
        self._angles = len(header.robot.joint_names)
        self._felt = 2 * AXES if header.robot.has_imu else 0
        self._forms = _forms(header.robot.joint_names)
        self._held: list[Any] = []
        self._since = math.inf
        self._writing: Future[None] | None = None

    def add(self, tick: Any) -> None:
        """Keep one tick.

        Raises:
            LogError: The disk is full or gone.
        """
        now = time.monotonic()
        if not self._held:
            self._since = now
        self._held.append(tick)
        if len(self._held) == _MOST or now - self._since >= _PATIENCE:
            self._begin()

    def write(self, ticks: Sequence[Any]) -> None:
        """Write ticks at once, in this thread, after those that were added.

        Raises:
            LogError: The disk is full or gone.
        """
        self.flush()
        if ticks:
            self._write(ticks)

    def settle(self) -> None:
        """Write what has waited long enough; to be called where no tick may follow for a while.

        Raises:
            LogError: The disk is full or gone.
        """
        if time.monotonic() - self._since >= _PATIENCE:
            self.flush()
        self._wait()
        self._out.settle()

    def event(self, text: str, t: float = 0.0) -> None:
        """Keep what happened after the last tick, at a time of the loop [s].

        Raises:
            LogError: The disk is full or gone.
        """
        self.flush()
        self._out.event(text, t=t)

    def close(self) -> None:
        """End it.

        Raises:
            LogError: The disk is full or gone.
        """
        try:
            self.flush()
        except KeyboardInterrupt:
            self.flush()  # the thread works on: the file is closed behind it
            raise
        finally:
            self._out.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def flush(self) -> None:
        """Encode what is held and hand it to the operating system.

        Raises:
            LogError: The disk is full or gone.
        """
        self._begin()
        self._wait()

    def _begin(self) -> None:
        """Let the thread write what is held, once it has written what was held before."""
        self._wait()
        ticks, self._held, self._since = self._held, [], math.inf
        if ticks:
            self._writing = _encoder().submit(self._write, ticks)

    def _wait(self) -> None:
        """Wait until the thread has written."""
        if self._writing is not None:
            try:
                self._writing.result()
            except Exception:
                self._writing = None
                raise
        self._writing = None

    def _write(self, ticks: Sequence[Any]) -> None:
        """Encode ticks, and hand them to the operating system."""
        count, (rows, beside) = len(ticks), self._rows(ticks)
        size = sum(len(data) for messages in beside.values() for data in messages.values())
        if size > _MUCH and count > 1:
            self._write(ticks[: count // 2])
            self._write(ticks[count // 2 :])
            return
        t, angles = rows[:, 0], self._angles
        decided, felt, measured = np.split(
            rows, [HEAD + angles, HEAD + angles + self._felt], axis=1
        )
        joints = [decided[:, HEAD:], *np.split(measured, 3, axis=1)]
        stamps = self._out.stamps(t)
        time = {"sec": stamps // 10**9, "nanosec": stamps % 10**9}
        columns: dict[Topic, dict[str, Any]] = {
            ANTENNA: {
                "t": t,
                "counts": rows[:, 3:5],
                "reading": rows[:, 3:5],
                "level": rows[:, 5:7],
                "contact": rows[:, 7:9].astype(np.int64),
            },
            MANEUVER: {
                "number": self._out.written + 1 + np.arange(count),
                "now": t,
                "maneuver": rows[:, 1].astype(np.int64),
                "phase": rows[:, 2],
            },
            JOINT_COMMANDS: time | {"position": joints[0]},
            JOINT_STATES: time
            | dict(zip(("position", "velocity", "effort"), joints[1:], strict=True)),
        }
        if self._felt:
            motion = dict(zip(MOTION, np.split(felt, 2, axis=1), strict=True))
            columns[IMU] = time | motion
        self._out.write_many(
            stamps,
            {topic: (self._forms[topic], numbers) for topic, numbers in columns.items()},
            beside,
        )


@cache
def _encoder() -> ThreadPoolExecutor:
    """The thread of all logs of this process."""
    return ThreadPoolExecutor(1, "logs")


def _forms(names: tuple[str, ...]) -> dict[Topic, Form]:
    """Messages of a tick in which all that is known in simulation varies."""
    pair, angles = (0.0, 0.0), (0.0,) * len(names)
    joints, time = (0, 0, "", names), ("sec", "nanosec")
    return {
        ANTENNA: Form(
            ANTENNA.type,
            (0.0, pair, pair, pair, (0, 0), math.nan),
            ("t", "counts", "reading", "level", "contact"),
        ),
        MANEUVER: Form(
            MANEUVER.type, (0, 0.0, 0, 0.0, True), ("number", "now", "maneuver", "phase")
        ),
        JOINT_COMMANDS: Form(JOINT_COMMANDS.type, (*joints, angles, (), ()), (*time, "position")),
        JOINT_STATES: Form(
            JOINT_STATES.type,
            (*joints, angles, angles, angles),
            (*time, "position", "velocity", "effort"),
        ),
        IMU: Form(IMU.type, imu_values(0, (0.0,) * AXES, (0.0,) * AXES), (*time, *MOTION)),
    }


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
        self._felt = MOTION if robot.has_imu else ()
        pair, axes = (batch, 2), (batch, AXES)
        self._unfelt = np.full(axes, math.nan)
        self._layout = np.dtype(
            [
                *(("t", float, batch), ("maneuver", np.int64, batch), ("phase", float, batch)),
                *(("counts", float, pair), ("level", float, pair), ("contact", np.int64, pair)),
                *((name, float, shape) for name, shape in self._parts.items()),
                *((name, float, axes) for name in self._felt),
            ]
        )
        self._kinds = [self._layout[name].base for name in self._layout.names or ()]

    def take(self, frame: AntennaFrame, command: JointCommand) -> bytes:
        """One tick, for `rows`: a copy, in one piece, as this is done in every tick."""
        controller = self._controller
        try:
            phase: Any = controller.phase
            usual = phase.shape == self._unknown.shape and phase.dtype == float
        except KeyboardInterrupt:
            raise
        except BaseException:  # noqa: BLE001 a property of anybody may raise anything
            phase, usual = None, False
        if not usual:
            phase = np.array(numbers_of(controller, "phase"))
            phase = phase if phase.shape == self._unknown.shape else self._unknown
        parts = [
            frame.t,
            controller.maneuver,
            phase,
            frame.counts,
            controller.level,
            controller.contact,
        ]
        parts += [getattr(command, name) for name in self._parts]
        for name in self._felt:
            felt = getattr(frame, name)
            parts.append(felt if felt.shape == self._unfelt.shape else self._unfelt)
        if [part.dtype for part in parts] != self._kinds:
            parts = [part.astype(kind) for part, kind in zip(parts, self._kinds, strict=True)]
        try:
            return b"".join(parts)
        except TypeError:  # one is a view with gaps
            return b"".join([part.tobytes() for part in parts])

    def rows(self, ticks: Sequence[bytes], row: int, into: Floats) -> None:
        """Write how one row of the batch begins in some ticks.

        Args:
            ticks: Of `take`.
            row: The row of the batch.
            into: Where to, shape (n, HEAD + joints), with six more of an inertial sensor.
        """
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


class SimulatedLog(RowLog):
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
        super().__init__(path, header, self._rows_of)
        self._world, self._decisions, self._row = world, decisions, row
        self._ticks = 0
        values = world.root, (0.0,) * world.model.nq
        self._form = Form(COORDINATES.type, values, ("position",))

    def take(self, decided: bytes) -> None:
        """Keep one tick, of which `Decisions` says this.

        Raises:
            LogError: The disk is full or gone.
        """
        self.add(self.tick(decided))

    def tick(self, decided: bytes) -> TakenTick:
        """One tick, of which `Decisions` says this, for `add` or `write`."""
        self._ticks += 1
        look = (self._ticks - 1) % LOOK_EVERY == 0
        world = self._world
        return TakenTick(decided, world.snapshot(), Contacts.of(world.data) if look else None)

    def _rows_of(self, ticks: Sequence[TakenTick]) -> Rows:
        """What is written of some ticks; many at once take hardly longer than one."""
        end = HEAD + self._angles + self._felt
        rows = np.empty((len(ticks), end + 3 * self._angles))
        self._decisions.rows([tick.decided for tick in ticks], self._row, rows[:, :end])
        measured, places = self._world.measured([tick.measured for tick in ticks])
        rows[:, end:] = measured.reshape(len(ticks), -1)
        looks = {i: tick.contacts for i, tick in enumerate(ticks) if tick.contacts is not None}
        return rows, self._messages(looks, places) if looks else {}

    def _messages(
        self, looks: Mapping[int, Contacts], places: Floats
    ) -> dict[int, dict[Topic, bytes]]:
        """The messages beside the ticks at which one looked."""
        coordinates = self._form.encode(len(looks), {"position": places[[*looks]]})
        messages = {
            i: {COORDINATES: row.tobytes()} for i, row in zip(looks, coordinates, strict=True)
        }
        contacts = Contacts.joined([*looks.values()])
        which, names, points, forces = self._world.obstacle_contacts(contacts)
        columns = names, *points.T.tolist(), forces.tolist()
        ends = np.cumsum([len(contact.geoms) for contact in looks.values()])
        begin, encode = 0, CONTACT_FORCES.type.encode
        for message, end in zip(
            messages.values(), np.searchsorted(which, ends).tolist(), strict=True
        ):
            if begin < end:
                message[CONTACT_FORCES] = encode(*(column[begin:end] for column in columns))
            begin = end
        return messages
