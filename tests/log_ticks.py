"""Ticks for logs: each one follows from its number alone."""

from __future__ import annotations

import math
import random
import struct
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
