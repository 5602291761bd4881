"""What a tick of the loop puts on the wire of the servo bus, by the bytes of its packets."""

from __future__ import annotations

from collections.abc import Sequence

from dynamixel_bus import packets
from dynamixel_bus.answers import DRIVE, POSITION, Span, Timing
from dynamixel_bus.models import XC430_W240
from dynamixel_bus.packets import OVERHEAD

ADAPTER = Timing().gap
"""Time of a tick that is left to adapter and computer [s]."""
_GOAL = XC430_W240["goal_position"]
_SINGLE = (Span(98, 1), Span(64, 1, spare=1), DRIVE)
"""Asked of one servo in a tick, each in turn: watchdog, torque, and drive, or mode, which is less.
They wait for the next tick where time is short."""


def tick_time(ids: Sequence[int], baud: int, fast: bool = True) -> float:
    """Time that the packets of a tick are on the wire [s].

    Goals for all in one packet without answers, one read of all positions, three of one servo.

    Args:
        ids: Servos on the bus.
        baud: Bits per second; a byte is ten bits.
        fast: Whether all answer in one packet, as with a fast sync read, or each in its own.
    """
    goals = packets.sync_write(_GOAL.address, dict.fromkeys(ids, bytes(_GOAL.size)))
    count = len(goals)
    where = (POSITION.address, POSITION.length)
    if fast:
        count += len(packets.fast_sync_read(ids, *where))
        count += packets.fast_reply_size(len(ids), POSITION.length)
    else:
        count += len(packets.sync_read(ids, *where)) + len(ids) * (OVERHEAD + POSITION.length)
    request = len(packets.read(ids[0], *where))
    count += sum(request + OVERHEAD + span.length for span in _SINGLE)
    return Timing(baud).wire(count)
