"""How the host talks to an antenna board over a network."""

from __future__ import annotations

from antennate.params.base import Params, number


class NetworkParams(Params):
    """Pace and limits of signed datagrams."""

    ask_period: float = number(
        0.25,
        "s",
        "assumed: eight asks within the 2 s for which a board grants frames",
        "time between two asks for frames",
        gt=0,
        le=1,
    )
    rate: float = number(
        1000.0,
        "1/s",
        "assumed: ten times what a board sends",
        "authentic frames a second that are handed on",
        gt=0,
        le=1e5,
    )
    burst: int = number(
        512,
        "1",
        "assumed: more than wait in the 208 KiB that Linux holds, so a busy host drops none",
        "authentic frames at once",
        ge=1,
        le=1e4,
    )
    look_rate: float = number(
        51_200.0,
        "1/s",
        "measured: 3 us each, so a flood costs at most a sixth of one core",
        "datagrams a second that are looked at; the system drops the others",
        gt=0,
        le=1e6,
    )
    look_burst: int = number(
        512,
        "1",
        "measured: 3 us each, so at most 1.5 ms of a tick of 10 ms",
        "datagrams at once that are looked at",
        ge=1,
        le=1e4,
    )
