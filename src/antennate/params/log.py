"""The log of a drive on disk."""

from __future__ import annotations

from antennate.params.base import Params, number


class LogParams(Params):
    """When a log may begin."""

    least_free: float = number(
        1e9,
        "byte",
        "assumed: room for seven hours of ticks at 100 Hz, 40 kB a second",
        "free space below which no log is begun",
        ge=0,
    )
