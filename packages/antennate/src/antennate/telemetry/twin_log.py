"""The log of a twin while it serves, behind a queue: to hand over a tick never waits.

A twin knows its goals, its readings and its physics; what its client thinks of them it does not
know. So levels are NaN, contacts UNKNOWN and the maneuver is `UNKNOWN_MANEUVER`.

A thread writes what has come several times a second. What does not fit into the queue, as before a
slow disk, is dropped and counted. A program that is killed loses the ticks since the last write.
The thread has a real-time level where that is allowed. An ordinary one may lose its core while it
holds the lock of Python: beside four busy processes on two cores, 24 of 2600 ticks of a twin began
more than 1 ms late (median of three runs). With the level it was 4 (median of seven), as many as
where a process of its own wrote the log.
"""

from __future__ import annotations

import math
import threading
from collections import deque
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple, Self

import numpy as np

from antennate.errors import LogError, in_one_line
from antennate.host import LEVEL, claim
from antennate.params.control import ControlParams
from antennate.sim.trial import TrialConfig
from antennate.sim.world import World
from antennate.telemetry.header import TWIN, Header
from antennate.telemetry.simulated import Decisions, SimulatedLog, TickLog
from antennate.twin.config import TwinConfig
from antennate.twin.robot import TwinRobot
from antennate.types import Contact

_MOST = 3000
"""Most ticks and events in the queue: 30 s at 100 Hz, 3 s at 1000 Hz."""
_PERIOD = 0.15
"""Time between two writes [s]: with the time that one takes, a kill costs less than 0.5 s."""
_PATIENCE = 10.0
"""Time for a slow disk to take the last ticks [s] (assumed)."""


class _Event(NamedTuple):
    text: str
    t: float


class LogQueue:
    """The queue and its thread; as a context it closes the log.

    Args:
        log: The log.
        on_failure: Called once, by the thread, with the reason if the log cannot be written any
            more.

    Attributes:
        path: The file.
        dropped: Ticks and events for which there was no room.
        failure: Why it cannot be written any more; empty while it can.
    """

    def __init__(self, log: TickLog, on_failure: Callable[[str], None] = lambda _: None) -> None:
        self.path, self.dropped, self.failure = log.path, 0, ""
        self._log, self._on_failure = log, on_failure
        self._queue, self._over = deque[Any](), threading.Event()
        self._thread = threading.Thread(target=self._write_all, name="log", daemon=True)
        self._thread.start()

    def add(self, tick: Any) -> None:
        """Hand over one tick; it is dropped if there is no room."""
        self._hand_over(tick)

    def event(self, text: str, t: float) -> None:
        """Hand over what happened after the last tick, at a time of the loop [s]."""
        self._hand_over(_Event(text, t))

    def close(self) -> str:
        """End the log and wait until it is written; what is wrong with it, empty if nothing."""
        self._over.set()
        self._thread.join(_PATIENCE)
        if self._thread.is_alive() and not self.failure:
            self.failure = f"expected to write {self.path} within {_PATIENCE:g} s, found it slower"
        missing = f"{self.dropped} ticks are missing in it" if self.dropped else ""
        return self.failure or missing

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _hand_over(self, content: Any) -> None:
        if self.failure:
            return
        if len(self._queue) >= _MOST:
            self.dropped += 1
        else:
            self._queue.append(content)

    def _write_all(self) -> None:
        claim(LEVEL - 1)  # after the loops and the physics, before all ordinary programs
        try:
            while not self._over.wait(_PERIOD):
                self._write()
            self._write()
            self._log.close()
        except Exception as error:  # noqa: BLE001 whatever it is, the log has ended: say so
            self.failure = str(error) if isinstance(error, LogError) else in_one_line(error)
            self._queue.clear()
            self._on_failure(self.failure)

    def _write(self) -> None:
        """Write what waits."""
        ticks: list[Any] = []
        for _ in range(len(self._queue)):
            content = self._queue.popleft()
            if isinstance(content, _Event):
                self._log.write(ticks)
                self._log.event(content.text, content.t)
                ticks = []
            else:
                ticks.append(content)
        self._log.write(ticks)
        self._log.settle()  # an event that no tick follows


UNKNOWN_MANEUVER = -1


class _Unknown:
    """Stands for a controller that is elsewhere."""

    level = np.full((1, 2), math.nan)
    contact = np.full((1, 2), int(Contact.UNKNOWN))
    maneuver = np.array([UNKNOWN_MANEUVER])


class TwinLog(LogQueue):
    """The log of a twin: its ticks while the physics runs.

    Args:
        path: A file that does not exist yet.
        robot: The twin.
        config: What is served.
        start: Time of its beginning [ns], a Unix time.
        on_failure: As for `LogQueue`.
    """

    def __init__(
        self,
        path: Path,
        robot: TwinRobot,
        config: TwinConfig,
        start: int,
        on_failure: Callable[[str], None],
    ) -> None:
        self._robot, self._decisions = robot, Decisions(config.robot, _Unknown())
        header = _header(config, start)
        self._ticks = SimulatedLog(path, header, robot.world, self._decisions)
        super().__init__(self._ticks, on_failure)

    def take(self, world: World) -> None:
        """Keep a tick, its time that of the twin."""
        robot = self._robot
        self.add(self._ticks.tick(self._decisions.take(robot.frame, robot.command)))


def _header(config: TwinConfig, start: int) -> Header:
    fields = set(TrialConfig.model_fields) - {"robot"}
    return Header(
        controller=TWIN,
        params=ControlParams(rate=config.control.rate, gait=config.control.gait),
        robot=config.robot,
        seed=config.seed,
        trial=config.trial,
        start=start,
        arena=config.model_dump(mode="json", include=fields),
    )
