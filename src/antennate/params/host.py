"""What the loop asks of the computer that it runs on."""

from __future__ import annotations

from antennate.params.base import Params, number


class HostParams(Params):
    """Priority of the loop, and patience with what runs beside it."""

    priority: int = number(
        20,
        "1",
        "assumed: above ordinary programs; Linux's interrupt threads stand at 50 (sched(7))",
        "real-time level of the loop, of 1 to 99; the twin's is one higher",
        ge=1,
        le=98,
    )
    traceback_period: float = number(
        1.0,
        "s",
        "assumed: a controller that fails in each tick floods nothing",
        "shortest time between two tracebacks that are kept",
        gt=0,
        le=600,
    )
    log_patience: float = number(
        5.0,
        "s",
        "assumed: a slow disk under load",
        "time that the log's process has to write the last ticks",
        gt=0,
        le=600,
    )
