"""All deadlines of a robot with torque, and their order.

An answer that comes at its latest still comes before the watchdogs act; they act before the loop
takes a pause for one, after which an arm event is needed. What a user may set of them is in
`params.safety.SupervisorParams`; `require_order` looks at all of them together.
"""

from __future__ import annotations

from collections.abc import Iterable
from itertools import pairwise

from antennate.errors import ConfigError
from antennate.params.safety import SupervisorParams
from dynamixel_bus.model import WATCHDOG_UNIT

READ_ONE = 0.003
"""Time for one servo asked alone [s]: the rest of the tick (assumed)."""
READ_LEG = 0.005
"""Time for one reading of a leg that forgets its turns [s]: half a tick; one answer takes 1 ms at
most at 1 Mbit/s (assumed)."""
READ_ALL = 0.007
"""Time for the positions of all servos [s]: what a tick of 10 ms leaves for reading (assumed)."""
ANSWER = 0.07
"""Latest answer while servos have torque [s]: less than their watchdogs allow (assumed)."""
READ_OUTSIDE = 0.1
"""Time for one reading of all outside the loop [s]: ten times what 19 answers take (assumed)."""
WATCHDOG_COUNTS = 5
"""Bus watchdog of a robot that walks [20 ms]: a servo stops ten ticks after the last packet
(assumed)."""
WATCHDOG = WATCHDOG_COUNTS * WATCHDOG_UNIT
"""Bus watchdog of a robot that walks [s]."""
STAND = 2.0
"""Longest time that a robot holds its command before the torque goes off [s]: a cycle of its gait
(assumed)."""
SUPPLY_AGE = 4.0
"""Age from which on the supply is not known [s]: two of the slowest rounds of all servos
(assumed)."""
JOG_PERIOD = 0.04
"""Time between two readings of a joint moved by keys [s]: a fifth of its watchdog's (assumed)."""
JOG_WATCHDOG_COUNTS = 10
"""Bus watchdog of that joint [20 ms]: it stops 0.2 s after the last packet (assumed)."""


def require_order(limits: SupervisorParams, period: float) -> None:
    """Whether every deadline comes before the one that guards it.

    Args:
        limits: The deadlines that a user may set.
        period: Control period [s].
    """
    answer, watchdog = ("the latest answer", ANSWER), ("the watchdogs of the servos", WATCHDOG)
    pause = ("limits.longest_pause", limits.longest_pause)
    reads = [("a read of one servo", READ_ONE), ("of a leg", READ_LEG), ("of all", READ_ALL)]
    _rise([*reads, answer])
    _rise([("a period of control.rate", period), answer, watchdog, pause])
    _rise([("limits.stale_age", limits.stale_age), answer])
    _rise(
        [
            ("a read of `setup jog`", JOG_PERIOD),
            ("its watchdog", JOG_WATCHDOG_COUNTS * WATCHDOG_UNIT),
        ]
    )


def _rise(deadlines: Iterable[tuple[str, float]]) -> None:
    for (name, time), (guard, later) in pairwise(deadlines):
        if not time < later:
            raise ConfigError(
                f"expected deadlines that rise, found {name} at {time:g} s, {guard} at {later:g} s"
            )
