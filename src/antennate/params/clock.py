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
        "assumed: a hundred steps of the physics on a machine ten times too busy",
        "real time after which the other end counts as hung; one that is gone is noticed at once",
        gt=0,
    )
    greeting: float = number(
        3.0,
        "s",
        "assumed: a connection that was made before is accepted within",
        "real time within which the board's and the bus's clients have to be there",
        gt=0,
    )
