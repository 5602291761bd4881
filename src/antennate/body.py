"""The wall: what the mind may know of a world.

Three kinds of world stand behind it, simulated, real, and simulated behind real bytes; the loop and
the controller cannot tell which.
"""

from __future__ import annotations

from typing import Protocol

from antennate.records import AntennaFrame, Pose


class Clock(Protocol):
    """Time of one world. In simulation, sleeping is what makes the physics advance."""

    def now(self) -> float:
        """Time [s] since the world began."""
        ...

    def sleep_until(self, t: float) -> None:
        """Return at time t [s], at once if it has passed."""
        ...


class Body(Protocol):
    """A batch of B robots: antennae to read, joints to command, one clock."""

    @property
    def clock(self) -> Clock:
        """The world's clock."""
        ...

    def read(self) -> AntennaFrame:
        """The newest reading of both antennae."""
        ...

    def write(self, pose: Pose) -> None:
        """Set new joint targets."""
        ...
