"""How long a key may be let go before the robot stands, and before its torque goes off."""

from __future__ import annotations

from antennate.params.base import Params, number


class DeadManParams(Params):
    """A key that is held lets the robot walk; a terminal tells it by the characters it repeats."""

    release: float = number(0.3, "s", "assumed: held keys repeat every 33 to 92 ms", gt=0, le=2)
    """Longest time between two characters of a key that is held."""
    off: float = number(5.0, "s", "assumed: time to change the hand", ge=0, le=600)
    """Time after its release until the torque goes off."""
