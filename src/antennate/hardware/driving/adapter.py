"""Whether the adapter of a servo bus hands bytes over at once."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from statistics import median

from antennate.hardware.doctor.ports import latency_row
from antennate.hardware.dynamixel.answers import Timing, Value
from antennate.hardware.dynamixel.bringup import BringUpError
from antennate.hardware.dynamixel.bus import Bus
from antennate.hardware.ports.port import Port
from antennate.params import DoctorParams

_PINGS = 5
"""Pings timed: a median that two late ones do not move (assumed)."""
_SLOW = 0.008
"""Median time to an answer from which on an adapter is refused [s]: half the 16 ms of an FTDI
adapter's default (AN232B-04), which a busy computer does not reach (assumed)."""
_PATIENCE = 0.05
"""Longest wait for the answer to such a ping [s]: three times those 16 ms (assumed)."""


def require_quick(
    port: Port, ids: Sequence[int], baud: int, clock: Callable[[], float], path: str
) -> float | None:
    """Ping a servo that answers a few times; the median time to its answer [s], None without any.

    Args:
        port: The wire; nobody else uses it meanwhile.
        ids: Servos to try, in this order.
        baud: Bits per second.
        clock: Monotonic time [s].
        path: What the port is called, for the cure.

    Raises:
        BringUpError: Answers come too late; with the command that cures it.
    """
    bus = Bus(port, Timing(baud, gap=_PATIENCE, latest=_PATIENCE), clock=clock)
    times: list[float] = []
    for servo in ids:
        while len(times) < _PINGS:
            begin = clock()
            if not isinstance(bus.ping(servo), Value):
                break
            times.append(clock() - begin)
        if times:
            break
    if not times:
        return None
    found, most = median(times), _SLOW
    if found > most:
        cure = latency_row(path, True, DoctorParams()).cure
        raise BringUpError(
            f"--bus: expected answers within {1e3 * most:g} ms, found {1e3 * found:.1f} ms: the "
            f"adapter keeps bytes back; {cure}"
        )
    return found
