"""Whether the adapter of the servo bus delivers bytes without delay."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from statistics import median

from antennate.dxl.answers import Timing, Value
from antennate.dxl.bus import Bus
from antennate.hardware.doctor.ports import latency_row
from antennate.hardware.dynamixel.bringup import BringUpError
from antennate.params.hardware import DoctorParams
from antennate.port import Port

_PINGS = 5
"""Number of pings that are timed: two late ones do not move their median (assumed)."""
_SLOW = 0.008
"""Median time to an answer from which on an adapter is refused [s]: half the 16 ms of an FTDI
adapter's default (AN232B-04), which a busy computer does not reach (assumed)."""
_PATIENCE = 0.05
"""Longest wait for the answer to such a ping [s]: three times those 16 ms (assumed)."""


def require_quick(
    port: Port, ids: Sequence[int], baud: int, clock: Callable[[], float], path: str
) -> float | None:
    """Ping the first servo that answers; the median time to its answers [s], None without any.

    `path` is the port's name for the error message.

    Raises:
        BringUpError: Answers come too late; the message has the command that cures it.
    """
    bus = Bus(port, Timing(baud, gap=_PATIENCE, latest=_PATIENCE), clock=clock)
    times: list[float] = []
    for servo in ids:
        begin = clock()
        while len(times) < _PINGS and isinstance(bus.ping(servo), Value):
            times.append(clock() - begin)
            begin = clock()
        if times:
            break
    if not times:
        return None
    if (time := median(times)) > _SLOW:
        cure = latency_row(path, True, DoctorParams()).cure
        raise BringUpError(
            f"--bus: expected answers within {1e3 * _SLOW:g} ms, found {1e3 * time:.1f} ms; {cure}"
        )
    return time
