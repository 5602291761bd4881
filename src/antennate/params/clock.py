"""How long a client and the twin whose time it passes wait for each other."""

from __future__ import annotations

from antennate.params.base import Params, number


class ClockParams(Params):
    """Limits of the clock of a twin in lock-step; none of them changes a result."""

    stride: float = number(
        1.0,
        "s",
        "assumed: 3.5 kB of the board, less than the 4 KiB that a Linux terminal keeps unread",
        "longest twin's time that is asked for at once",
        gt=0,
        le=1,
    )
    patience: float = number(
        30.0,
        "s",
        "assumed: a stride of the physics on a machine ten times too busy",
        "real time without an answer after which a twin counts as hung; one that is gone is "
        "noticed at once",
        gt=0,
    )
    arrival: float = number(
        5.0,
        "s",
        "assumed: far more than a wire takes, and short for who has swapped two wires",
        "real time within which a client connects, and bytes that were sent arrive",
        gt=0,
    )
