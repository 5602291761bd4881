"""How the host handles its ports, the bus of servos and the stream of the antenna board."""

from __future__ import annotations

from antennate.params.base import Params, number


class PortParams(Params):
    """Ports that open, fill up and go away."""

    retry: float = number(
        0.2,
        "s",
        "assumed: short beside the time that a person needs for a plug",
        "time between two looks for a port that is gone",
        gt=0,
        le=10,
    )
    farewell: float = number(
        1.0,
        "s",
        "assumed: a look takes a tenth of it",
        "longest that closing waits for a look that is under way",
        gt=0,
        le=10,
    )
    opening_time: float = number(
        3.0,
        "s",
        "assumed: one lost packet of a TCP handshake is sent again after 1 s, and 2 s later",
        "longest wait for a TCP connection",
        gt=0,
        le=60,
    )
    writing_time: float = number(
        0.1,
        "s",
        "assumed: 1 kB at 115 200 bit/s",
        "longest wait until all is sent",
        gt=0,
        le=10,
    )


class BusParams(Params):
    """Patience with servos: within the control loop, before and after it, and at an examination."""

    watchdog: int = number(
        5,
        "20 ms",
        "assumed: 100 ms, ten ticks; the unit is that of the register (datasheet)",
        "time without a goal after which a servo stops by itself",
        ge=1,
        le=127,
    )
    profile_room: float = number(
        1.25,
        "1",
        "assumed: goals are followed without delay, and a joint that lags catches up",
        "profile velocity of a servo by the fastest that its goals move",
        ge=1,
        le=10,
    )
    gap: float = number(
        0.002,
        "s",
        "assumed: the 1 ms of a USB adapter and as much again",
        "longest silence before or inside an answer",
        gt=0,
        le=0.1,
    )
    doubt: float = number(
        0.1,
        "s",
        "assumed: six times the 16 ms of a slow adapter",
        "latest that an answer comes",
        gt=0,
        le=1,
    )
    doubt_walking: float = number(
        0.07,
        "s",
        "assumed: less than the 100 ms of the watchdogs",
        "latest that an answer comes while servos have torque",
        gt=0,
        le=0.1,
    )
    busy: float = number(
        0.010, "s", "assumed: one tick", "longest that goals wait for a quiet bus", gt=0, le=0.1
    )
    motion_budget: float = number(
        0.007,
        "s",
        "assumed: what a tick of 10 ms leaves for reading",
        "time for the positions of all servos in a tick",
        gt=0,
        le=0.1,
    )
    single_budget: float = number(
        0.003, "s", "assumed: the rest of the tick", "time for one servo asked alone", gt=0, le=0.1
    )
    alone: int = number(
        2,
        "1",
        "assumed: single answers are lost by noise",
        "misses in a row after which a servo no longer holds up the others",
        ge=1,
        le=100,
    )
    fast_tries: int = number(
        3,
        "1",
        "assumed: at 1 % loss three in a row happen once in 10^6",
        "fast reads without any answer, but answers to a slow one, after which they are given up",
        ge=1,
        le=100,
    )
    look_every: int = number(
        10,
        "ticks",
        "assumed: a round of all 19 then takes 2 s at the slowest",
        "ticks after which watchdog and supply are read even if time is short",
        ge=1,
        le=100,
    )
    supply_age: float = number(
        4.0,
        "s",
        "assumed: twice what a round of all takes at the slowest",
        "age from which on the supply is not known",
        gt=0,
        le=60,
    )
    adapter_pings: int = number(
        5,
        "1",
        "assumed: a median that two late ones do not move",
        "pings timed at connecting",
        ge=1,
    )
    slow_adapter: float = number(
        0.008,
        "s",
        "assumed: half the 16 ms of an FTDI adapter's default (AN232B-04), which a busy computer "
        "does not reach",
        "median time to an answer from which on an adapter is refused",
        gt=0,
        le=0.1,
    )
    adapter_patience: float = number(
        0.05,
        "s",
        "assumed: three times those 16 ms",
        "longest wait for the answer to such a ping",
        gt=0,
        le=1,
    )
    pings: int = number(
        3, "1", "assumed: as fast_tries", "pings until an id is taken for silent", ge=1, le=100
    )
    reads: int = number(
        6,
        "1",
        "assumed: answers that collide are by chance whole once in 2^16",
        "reads until a servo that answers pings is taken for one that answers nothing else",
        ge=1,
        le=100,
    )
    tries: int = number(
        5,
        "1",
        "assumed: at 1 % loss five in a row happen once in 10^10",
        "reads and writes of all until those that did not answer are given up",
        ge=1,
        le=100,
    )
    budget: float = number(
        0.1,
        "s",
        "assumed: ten times what 19 answers take",
        "time for one reading of all outside the control loop",
        gt=0,
        le=1,
    )


class BoardParams(Params):
    """When a sample of the antenna board is believed, and how old it is."""

    baud: int = number(
        115_200, "bit/s", "datasheet: MicroPython on an ESP32, UART 0", "speed of its port", gt=0
    )
    backlog: int = number(
        64,
        "1",
        "assumed: 0.64 s; what is older is not acted upon anyway",
        "newest samples of a backlog that are looked at",
        ge=1,
        le=1000,
    )
    drift: float = number(
        250e-6,
        "1",
        "assumed: two crystals within 100 ppm each, and a margin",
        "most by which the clocks of board and host run apart",
        gt=0,
        le=0.01,
    )
    settle_samples: int = number(
        10,
        "1",
        "assumed: 100 ms at 100 Hz",
        "samples that a new lowest delay must last until ages are believed",
        ge=1,
        le=1000,
    )
    settle_time: float = number(
        0.05,
        "s",
        "assumed: as the age of stale data",
        "time that it must last likewise",
        gt=0,
        le=10,
    )
    settle_fall: float = number(
        0.005,
        "s",
        "assumed: half a period; a backlog that drains makes it fall faster",
        "how far the lowest delay may fall meanwhile",
        gt=0,
        le=1,
    )
    early: float = number(
        0.02,
        "s",
        "assumed: two periods",
        "how much earlier than expected a sample may arrive; after a lie, also how much later",
        gt=0,
        le=1,
    )
