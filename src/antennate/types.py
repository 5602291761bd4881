"""What flows through the house: frames in, contact and maneuver inside, commands out.

Arrays carry a leading batch axis of B robots; B is 1 for a single one.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]


class Contact(IntEnum):
    """What one antenna says: it touches, it is free, or it cannot tell."""

    FREE = 0
    CONTACT = 1
    UNKNOWN = 2


class Maneuver(IntEnum):
    """The four maneuvers of the paper, and HOLD, the answer to UNKNOWN: stand still."""

    FORWARD = 0
    TURN_L = 1
    TURN_R = 2
    REVERSE = 3
    HOLD = 4


@dataclass(frozen=True, slots=True)
class AntennaFrame:
    """One reading of both antennae.

    Attributes:
        t: Time at which the sensors were sampled [s], shape (B,).
        counts: 12-bit ADC readings, shape (B, 2), left before right; NaN where a sample is missing.
    """

    t: Floats
    counts: Floats


@dataclass(frozen=True, slots=True)
class JointCommand:
    """Joint targets for one control period.

    Attributes:
        yaw: Yaw joint angles [rad], shape (B, 5).
        leg: Leg axle angles [rad], unwrapped, 0 at mid-stance, shape (B, 6, 2).
        antenna: Sweep angle of the antenna bases about their mounting angle [rad], positive
            towards the tail, shape (B, 2).
    """

    yaw: Floats
    leg: Floats
    antenna: Floats


class Clock(Protocol):
    """Time of one world. In simulation, sleeping is what makes the physics advance."""

    def now(self) -> float:
        """Time [s] since the world began."""
        ...

    def sleep_until(self, t: float) -> None:
        """Return at time t [s], at once if it has passed."""
        ...


class Robot(Protocol):
    """A batch of B robots: antennae to read, joints to command, one clock."""

    @property
    def clock(self) -> Clock:
        """The world's clock."""
        ...

    def read(self) -> AntennaFrame:
        """The newest reading of both antennae."""
        ...

    def write(self, command: JointCommand) -> None:
        """Set new joint targets."""
        ...
