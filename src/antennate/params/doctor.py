"""What the examination of a robot at rest calls good."""

from __future__ import annotations

from antennate.params.base import Params, number


class DoctorParams(Params):
    """How long is looked, and from where on something is not good."""

    listen: float = number(
        2.0, "s", "assumed: 200 readings", "time over which the board is listened to", gt=0, le=60
    )
    greeting: float = number(
        3.0,
        "s",
        "assumed: a board that opening the port resets starts within 2 s and greets every second",
        "longest wait for a greeting",
        gt=0,
        le=60,
    )
    silence: float = number(
        1.9,
        "s",
        "assumed: a board that runs sends every 10 ms, one that starts says so at once, one on a "
        "network is asked seven times meanwhile",
        "silence of a port after which no board is there",
        gt=0,
        le=60,
    )
    quiet: float = number(
        0.1,
        "s",
        "assumed: ten samples of a board; servos speak only if asked",
        "time for which the bus is listened to before a servo is asked",
        gt=0,
        le=1,
    )
    unasked: int = number(
        32,
        "byte",
        "assumed: more than one sample of a board, and than a plug that goes in brings",
        "bytes in that time that nobody asked for, from which on servos are not alone on the bus",
        ge=1,
        le=1000,
    )
    reads: int = number(
        20, "1", "assumed: enough for a median", "reads of all servos that are timed", ge=3, le=1000
    )
    answer_time: float = number(
        0.002,
        "s",
        "assumed: the silence after which the bus gives an answer up",
        "longest time to a servo's answer beyond the wire and its return delay",
        gt=0,
        le=0.1,
    )
    read_time: float = number(
        0.007,
        "s",
        "assumed: what a tick of 10 ms leaves for reading",
        "longest time of one read of all servos",
        gt=0,
        le=0.1,
    )
    latency_timer: int = number(
        1,
        "ms",
        "datasheet: FTDI's AN232B-04, 1 ms is the lowest, 16 ms the default",
        "highest latency timer of a USB adapter",
        ge=1,
        le=255,
    )
    heat_margin: float = number(
        10.0,
        "degC",
        "assumed: minutes of walking",
        "distance from a servo's own limit at which its temperature is warned of",
        ge=0,
        le=50,
    )
    noise: float = number(
        10.0,
        "counts",
        "assumed: four times that of a resting flex sensor",
        "highest standard deviation of the readings at rest",
        gt=0,
        le=1000,
    )
