"""What stops a drive from outside while it runs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from antennate.hardware.driving.signals import StopOnce


@dataclass(frozen=True)
class Operator:
    """Who may stop a drive.

    Attributes:
        stop: Receives signals; by default while the drive runs.
        pressed: Whether a character of the key that has to be held came since the last call; None
            if no key has to be held.
        arrived: Whether the robot is where it was to go.
        watches: Whether somebody sees what the robot does; torque waits for that.
    """

    stop: StopOnce | None = None
    pressed: Callable[[], bool] | None = None
    arrived: Callable[[], bool] = field(default=lambda: False)
    watches: Callable[[], bool] = field(default=lambda: True)
