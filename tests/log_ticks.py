"""Ticks for logs, each of which follows from its number alone, and the records of their files."""

from __future__ import annotations

import math
import random
import struct
from collections.abc import Iterator
from functools import lru_cache

from antennate.params.control import ControlParams
from antennate.robots.spec import RobotSpec
from antennate.telemetry.header import Header
from antennate.telemetry.ticks import Tick

HEADER = Header(
    controller="closed",
    params=ControlParams.model_validate({"conditioning": {"midpoint": 0.1 + 0.2}}),
    robot=RobotSpec(),
    seed=7,
    trial=3,
    phase=math.pi / 3,
)
ODD = [0.0, -0.0, math.nan, math.inf, -math.inf, 5e-324, 1.7976931348623157e308, 0.1, -1e-308]
CAUSES = ["HOLD STALE: no fresh sample (age 0.06 s)", "FAULT SILENT_SERVO: servo 7", "µ — ≥", ""]


@lru_cache(maxsize=64)
def tick(number: int) -> Tick:
    """Odd and random bit patterns in every field."""
    chance = random.Random(number)

    def real() -> float:
        if chance.random() < 0.3:
            return chance.choice(ODD)
        return struct.unpack("<d", chance.randbytes(8))[0]

    def pair() -> tuple[float, float]:
        return real(), real()

    return Tick(
        number=number,
        t=real(),
        now=real(),
        counts=pair(),
        reading=pair(),
        level=pair(),
        contact=(chance.randrange(3), chance.randrange(3)),
        maneuver=chance.randrange(-(2**63), 2**63),
        phase=real(),
        angles=tuple(real() for _ in RobotSpec().joint_names),
        state=chance.choice(["", "OK", "HOLD", "FAULT"]),
        causes=tuple(chance.sample(CAUSES, chance.randrange(len(CAUSES)))),
        age=real(),
        missed=chance.randrange(2**64),
        frames=chance.randrange(2**64),
        crc=0,
        lost=chance.randrange(300),
        misses=chance.randrange(2**32),
        stale=1,
        sent=number,
    )


MAGIC = b"\x89MCAP0\r\n"
CHUNK, DATA_END = 6, 15


def records(data: bytes) -> Iterator[tuple[int, int, int]]:
    """Kind, begin and end of each record, by the specification of MCAP."""
    at = len(MAGIC)
    while at < len(data) - len(MAGIC):
        kind, length = struct.unpack_from("<BQ", data, at)
        yield kind, at, at + 9 + length
        at += 9 + length


def chunks(data: bytes) -> list[tuple[int, int]]:
    """Begin and end of each chunk: the first is the header's."""
    return [(begin, end) for kind, begin, end in records(data) if kind == CHUNK]


def unclosed(data: bytes) -> bytes:
    """The log of a killed program: up to the end of its data."""
    return data[: next(begin for kind, begin, _ in records(data) if kind == DATA_END)]
