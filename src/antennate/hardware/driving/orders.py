"""What an operator tells a session, and what it counts for him."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(slots=True)
class Orders:
    """What the operator wants.

    Attributes:
        arm: Torque on; only the change to True counts.
        stop: Torque off.
        released: The key that lets it walk is not held.
    """

    arm: bool = False
    stop: bool = False
    released: bool = False


@dataclass(slots=True)
class Tally:
    """What a session has done.

    Attributes:
        ticks: Ticks run.
        sent: Commands sent to the actuators.
        limited: Goals that moved slower than asked.
    """

    ticks: int = 0
    sent: int = 0
    limited: int = 0
