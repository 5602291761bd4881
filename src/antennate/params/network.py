"""How the host talks to an antenna board over a network."""

from __future__ import annotations

from antennate.params.base import Params, number


class NetworkParams(Params):
    """Pace and limits of signed datagrams."""

    ask_period: float = number(0.25, "s", "assumed: eight asks in a grant of 2 s", gt=0, le=1)
    """Time between two asks for frames."""
    rate: float = number(1000.0, "1/s", "assumed: ten times what a board sends", gt=0, le=1e5)
    """Authentic frames a second that are handed on."""
    burst: int = number(
        512, "1", "assumed: more datagrams than wait in the 208 KiB that Linux holds", ge=1, le=1e4
    )
    """Authentic frames at once."""
    look_rate: float = number(
        51_200.0,
        "1/s",
        "measured: 3 us each, so a flood costs at most a sixth of a core",
        gt=0,
        le=1e6,
    )
    """Datagrams a second that are looked at; the system drops the others."""
    look_burst: int = number(512, "1", "measured: 3 us each, so 1.5 ms of a tick", ge=1, le=1e4)
    """Datagrams at once that are looked at."""
