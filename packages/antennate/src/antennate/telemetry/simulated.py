"""The log of a simulated robot: what a drive logs, and the physics beside it.

Simulated time runs much faster than a robot's, so ticks are collected as they are and written many
at once. A thread does it, which Ctrl-C does not stop in the middle of a message; it saves no time.
"""

from __future__ import annotations

import math
import os
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from antennate.robots.imu import AXES
from antennate.robots.spec import RobotSpec
from antennate.sim.episode import LOOK_EVERY
from antennate.sim.places import Contacts
from antennate.sim.world import World
from antennate.telemetry.header import Header
from antennate.telemetry.ticks import Columns, numbers_of
from antennate.telemetry.topics import CONTACT_FORCES, COORDINATES, JOINTS, MOTION, Topic
from antennate.telemetry.writer import LogWriter
from antennate.types import AntennaFrame, Floats, JointCommand

_LEAST_FREE = 1e8
"""Room for many trials [byte] (assumed)."""
_MOST = 256
"""Ticks that are written at once."""
_PATIENCE = 0.15
"""Longest that a tick waits for others [s]; where there are many logs, for their thread too."""


class TickLog:
    """One file, new; as a context it closes itself.

    Args:
        path: A file that does not exist yet.
        header: What stands at its beginning.
        encode: Writes what was added to the file, many ticks at once.

    Attributes:
        path: The file.
    """

    def __init__(
        self,
        path: Path,
        header: Header,
        encode: Callable[[LogWriter, Sequence[Any]], object],
    ) -> None:
        self.path, self._encode = path, encode
        self._out = LogWriter(path, header, _LEAST_FREE)
        self._held: list[Any] = []
        self._since = math.inf
        self._writing: Future[None] | None = None

    def add(self, tick: Any) -> None:
        """Keep one tick."""
        now = time.monotonic()
        if not self._held:
            self._since = now
        self._held.append(tick)
        if len(self._held) == _MOST or now - self._since >= _PATIENCE:
            self._begin()

    def write(self, ticks: Sequence[Any]) -> None:
        """Write ticks at once, in this thread, after those that were added."""
        self.flush()
        if ticks:
            self._write(ticks)

    def settle(self) -> None:
        """Write what has waited long enough; to be called where no tick may follow for a while."""
        if time.monotonic() - self._since >= _PATIENCE:
            self.flush()
        self._wait()
        self._out.settle()

    def event(self, text: str, t: float = 0.0) -> None:
        """Keep what happened after the last tick, at a time of the loop [s]."""
        self.flush()
        self._out.event(text, t=t)

    def close(self) -> None:
        """End it."""
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
        """Encode what is held and hand it to the operating system."""
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
        self._encode(self._out, ticks)
        self._out.flush()


@cache
def _encoder() -> ThreadPoolExecutor:
    """The thread of all logs of this process."""
    return ThreadPoolExecutor(1, "logs")


os.register_at_fork(after_in_child=_encoder.cache_clear)  # no thread lives on in a forked child


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
        one, pair, axes = (batch,), (batch, 2), (batch, AXES)
        self._unfelt = np.full(axes, math.nan)
        self._layout = np.dtype(
            [
                *(("t", float, one), ("maneuver", np.int64, one), ("phase", float, one)),
                *(("counts", float, pair), ("level", float, pair), ("contact", np.int64, pair)),
                *((name, float, shape) for name, shape in self._parts.items()),
                *((name, float, axes) for name in self._felt),
            ]
        )
        self._kinds = [self._layout[name].base for name in self._layout.names or ()]

    def take(self, frame: AntennaFrame, command: JointCommand) -> bytes:
        """One tick, for `columns`: a copy, in one piece, as this is done in every tick."""
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

    def columns(self, ticks: Sequence[bytes], row: int) -> dict[str, NDArray[Any]]:
        """What was read, decided and commanded in some ticks, for one row of the batch.

        Args:
            ticks: Of `take`.
            row: The row of the batch.
        """
        block = np.frombuffer(b"".join(ticks), self._layout)
        parts = {name: block[name][:, row] for name in block.dtype.names or ()}
        angles = [parts.pop(name).reshape(len(ticks), -1) for name in self._parts]
        return parts | {"angles": np.concatenate(angles, axis=1)}


class TakenTick(NamedTuple):
    """One tick as it was taken: of `Decisions`, of `World.snapshot`, contacts where one looked."""

    decided: bytes
    measured: bytes
    contacts: Contacts | None


class SimulatedLog(TickLog):
    """The log of one simulated robot, tick by tick; as a context it closes itself.

    Args:
        path: A file that does not exist yet.
        header: What stands at its beginning.
        world: The robot in its scene.
        decisions: What is decided for it.
        row: Its row there.
    """

    def __init__(
        self, path: Path, header: Header, world: World, decisions: Decisions, row: int = 0
    ) -> None:
        super().__init__(path, header, self._write_taken)
        self._world, self._decisions, self._row = world, decisions, row
        self._ticks = 0

    def take(self, decided: bytes) -> None:
        """Keep one tick, given what `Decisions` says of it."""
        self.add(self.tick(decided))

    def tick(self, decided: bytes) -> TakenTick:
        """One tick for `add` or `write`, given what `Decisions` says of it."""
        self._ticks += 1
        look = (self._ticks - 1) % LOOK_EVERY == 0
        world = self._world
        return TakenTick(decided, world.snapshot(), Contacts.of(world.data) if look else None)

    def _write_taken(self, out: LogWriter, taken: Sequence[TakenTick]) -> None:
        """Write ticks that were taken, with what lies beside each."""
        decided = self._decisions.columns([tick.decided for tick in taken], self._row)
        measured, places = self._world.measured([tick.measured for tick in taken])
        looks = {i: tick.contacts for i, tick in enumerate(taken) if tick.contacts is not None}
        columns: Columns = {
            **decided,
            "now": decided["t"],
            "reading": decided["counts"],
            **dict(zip(JOINTS[1:], measured.swapaxes(0, 1), strict=True)),
        }
        out.write_many(columns, self._beside(looks, places) if looks else {})

    def _beside(
        self, looks: Mapping[int, Contacts], places: Floats
    ) -> Mapping[int, Mapping[Topic, bytes]]:
        """The messages beside the ticks at which one looked."""
        seen = places[[*looks]]
        first = COORDINATES.type.encode(self._world.root, seen[0])
        coordinates = COORDINATES.type.vary(first, {"position": seen})
        messages = {i: {COORDINATES: data} for i, data in zip(looks, coordinates, strict=True)}
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
