"""The control loop of all robots: read, decide, write, wait for the next tick."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Protocol

from antennate.types import AntennaFrame, JointCommand, Robot

_ROUNDING = 1e-6


class Stepper(Protocol):
    """The part of a controller that the loop needs."""

    def step(self, frame: AntennaFrame) -> JointCommand:
        """The joint targets for this tick."""
        ...


def run_loop(
    body: Robot,
    control: Stepper,
    period: float,
    go_on: Callable[[AntennaFrame, JointCommand], bool],
) -> int:
    """Run until `go_on` says no.

    The n-th tick is due at start + n * period. A tick that takes too long delays none but the next;
    ticks whose time has passed by then are left out.

    Args:
        body: The robot.
        control: The controller.
        period: Control period [s].
        go_on: Called after each write with what was read and written; False ends the loop.

    Returns:
        Number of ticks run.
    """
    start = body.clock.now()
    ticks = due = 0
    while True:
        frame = body.read()
        command = control.step(frame)
        body.write(command)
        ticks += 1
        if not go_on(frame, command):
            return ticks
        due = next_tick(due, body.clock.now() - start, period)
        body.clock.sleep_until(start + due * period)


def next_tick(number: int, elapsed: float, period: float) -> int:
    """The first tick after one of this number that is not yet due, a time [s] after the start."""
    return max(number + 1, math.ceil(elapsed / period - _ROUNDING))
