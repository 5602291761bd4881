"""The physics of a twin in a thread of its own, so that the bus answers meanwhile."""

from __future__ import annotations

import os
import sys
from concurrent.futures import Future, ThreadPoolExecutor

from antennate.hardware.driving.priority import claim
from antennate.twin.robot import TwinRobot
from antennate.types import Floats

_SWITCH = 0.00005
"""Longest time that one thread keeps the other from Python [s]; the physics itself does not."""


class Physics:
    """Runs the ticks of a robot while it is entered.

    Attributes:
        bell: Handle that can be read when a tick is over.
    """

    def __init__(self, robot: TwinRobot) -> None:
        self._robot = robot
        self._thread = ThreadPoolExecutor(1, "twin-physics", initializer=claim)
        self._tick: Future[Floats | None] | None = None
        self.bell, self._ring = os.pipe()
        self._switch = sys.getswitchinterval()

    def __enter__(self) -> Physics:
        sys.setswitchinterval(_SWITCH)
        return self

    def __exit__(self, *_: object) -> None:
        self._thread.shutdown()
        sys.setswitchinterval(self._switch)
        os.close(self.bell)
        os.close(self._ring)

    @property
    def busy(self) -> bool:
        """A tick has begun and not ended."""
        return self._tick is not None

    def begin(self) -> None:
        """Begin the next tick; the bell rings when `end` may be called."""
        pulls = self._robot.begin_tick()
        self._tick = self._thread.submit(self._robot.move, pulls)
        self._tick.add_done_callback(lambda _: os.write(self._ring, b"x"))

    def end(self) -> None:
        """Take what the physics gave; raises what it raised."""
        os.read(self.bell, 1)
        tick, self._tick = self._tick, None
        if tick is not None:
            self._robot.end_tick(tick.result())
