"""The one loop: read, decide, write, wait for the next tick. There is no other."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from antennate.body import Body
from antennate.records import AntennaFrame, Pose


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

    Args:
        body: The world.
        mind: The controller.
        period: Control period [s].
        go_on: Called after each write with what was read and written; False ends the loop.

    Returns:
        Number of ticks run.
    """
    start = body.clock.now()
    ticks = 0
    while True:
        frame = body.read()
        pose = mind.step(frame)
        body.write(pose)
        ticks += 1
        if not go_on(frame, pose):
            return ticks
        body.clock.sleep_until(start + ticks * period)
