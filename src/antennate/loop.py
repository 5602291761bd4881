"""The one loop: read, decide, write, wait for the next tick. There is no other."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Protocol

from antennate.body import Body
from antennate.records import AntennaFrame, Pose

_ROUNDING = 1e-6


class Mind(Protocol):
    """Anything that turns a frame into a pose."""

    def step(self, frame: AntennaFrame) -> Pose:
        """The joint targets for this tick."""
        ...


def run_loop(
    body: Body, mind: Mind, period: float, go_on: Callable[[AntennaFrame, Pose], bool]
) -> int:
    """Run until `go_on` says no.

    The n-th tick is due at start + n * period: an overrun delays one tick and shifts none after it.
    Ticks that have come due meanwhile are left out, never made up for in a burst.

    Args:
        body: The world.
        mind: The controller.
        period: Control period [s].
        go_on: Called after each write with what was read and written; False ends the loop.

    Returns:
        Number of ticks run.
    """
    start = body.clock.now()
    ticks = due = 0
    while True:
        frame = body.read()
        pose = mind.step(frame)
        body.write(pose)
        ticks += 1
        if not go_on(frame, pose):
            return ticks
        due = max(due + 1, math.ceil((body.clock.now() - start) / period - _ROUNDING))
        body.clock.sleep_until(start + due * period)
