"""Which servo moves which joint, and how its ticks become an angle."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from antennate.anatomy import LEGS, YAW_COUNT
from antennate.params.base import Params, number

_Id = Annotated[int, Field(ge=0, le=252)]
_Direction = Literal[-1, 1]
MOST_TICKS = 1_048_575
"""Farthest position in extended mode, 256 turns either way [ticks]."""
_Zero = Annotated[int, Field(ge=-MOST_TICKS, le=MOST_TICKS)]
TICKS_A_TURN = 4096
"""Datasheet of both models: 4096 pulses a revolution."""
_STRAIGHT = 2048
_QUARTER = 1024
_FIRST_LEG, _FIRST_ANTENNA = YAW_COUNT + 1, YAW_COUNT + len(LEGS) + 1


class JointsParams(Params):
    """Servos of one group of joints, in the order of the robot's anatomy."""

    ids: tuple[_Id, ...] = number((), "1", "assumed: set by hand", "ids on the bus")
    directions: tuple[_Direction, ...] = number(
        (), "1", "assumed: mounted alike", "sign between ticks and angle"
    )
    zeros: tuple[_Zero, ...] = number(
        (), "ticks", "assumed: the middle of a turn", "position at the angle 0"
    )


def _group(first: int, count: int) -> JointsParams:
    return JointsParams(
        ids=tuple(range(first, first + count)),
        directions=(1,) * count,
        zeros=(_STRAIGHT,) * count,
    )


class LayoutParams(Params):
    """All servos of a robot: 5 yaw joints, 12 legs, 2 antenna bases."""

    baud: Literal[57600, 115200, 1000000, 2000000, 3000000, 4000000] = number(
        1_000_000,
        "bit/s",
        "assumed: write and read of 19 servos then take 4.3 of 10 ms",
        "bus speed",
    )
    yaw: JointsParams = _group(1, YAW_COUNT)
    legs: JointsParams = _group(_FIRST_LEG, len(LEGS))
    antennae: JointsParams = _group(_FIRST_ANTENNA, 2)

    @model_validator(mode="after")
    def _agree(self) -> LayoutParams:
        for name, count in (("yaw", YAW_COUNT), ("legs", len(LEGS)), ("antennae", 2)):
            group: JointsParams = getattr(self, name)
            for what in ("ids", "directions", "zeros"):
                if (found := len(getattr(group, what))) != count:
                    raise ValueError(f"{name}.{what} must have {count} entries, got {found}")
        for name in ("yaw", "antennae"):  # one turn only; legs turn without end
            for zero in getattr(self, name).zeros:
                if not _QUARTER <= zero <= TICKS_A_TURN - _QUARTER:
                    raise ValueError(
                        f"{name}.zeros must leave a quarter turn to both sides, {_QUARTER} to "
                        f"{TICKS_A_TURN - _QUARTER} ticks, got {zero}"
                    )
        if doubled := sorted({i for i in self.ids if self.ids.count(i) > 1}):
            raise ValueError(f"ids must differ, got {', '.join(map(str, doubled))} more than once")
        return self

    @property
    def ids(self) -> tuple[int, ...]:
        """Ids of all 19 servos: yaws, legs, antennae."""
        return self.yaw.ids + self.legs.ids + self.antennae.ids

    @property
    def directions(self) -> tuple[int, ...]:
        """Signs of all 19."""
        return self.yaw.directions + self.legs.directions + self.antennae.directions

    @property
    def zeros(self) -> tuple[int, ...]:
        """Zeros of all 19 [ticks]."""
        return self.yaw.zeros + self.legs.zeros + self.antennae.zeros
