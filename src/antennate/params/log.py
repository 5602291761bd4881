"""The log of a drive on disk."""

from __future__ import annotations

from antennate.params.base import Params, number

MOST_PARTS = 10
"""Files that one log can have."""


class LogParams(Params):
    """When a log may begin, and begin anew."""

    least_free: float = number(
        1e9,
        "byte",
        "assumed: room for seven hours of ticks at 100 Hz, 40 kB a second",
        "free space below which no log is begun",
        ge=0,
    )
    restarts: int = number(
        3,
        "1",
        "assumed: more often is a defect that a new process does not cure",
        "processes that may keep the log after the first has died, each in a new file",
        ge=0,
        le=MOST_PARTS - 1,
    )
