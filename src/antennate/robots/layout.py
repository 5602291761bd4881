"""Which servo moves which joint, and how its ticks become an angle."""

from __future__ import annotations

import math
from typing import Annotated, Literal, TypeVar, cast

from pydantic import Field, model_validator

from antennate.params.base import Params, number
from antennate.robots.anatomy import LEGS, YAW_COUNT

_Id = Annotated[int, Field(ge=0, le=252)]
_Direction = Literal[-1, 1]
MOST_TICKS = 1_048_575
"""Farthest position in extended mode, 256 turns either way [ticks]."""
_Zero = Annotated[int, Field(ge=-MOST_TICKS, le=MOST_TICKS)]
TICKS_A_TURN = 4096
"""Datasheet of both models: 4096 pulses a revolution."""
_STRAIGHT = 2048
_QUARTER = 1024
_LIMIT = 0.5 * math.pi
_RPM = 2.0 * math.pi / 60.0
_XC430, _XL330 = 65.0 * _RPM, 103.0 * _RPM
"""Speeds unloaded [rad/s], datasheets: XC430-W240 at 11.1 V, XL330-M288 at 5 V."""
_FIRST_LEG, _FIRST_ANTENNA = YAW_COUNT + 1, YAW_COUNT + len(LEGS) + 1


class JointsParams(Params):
    """Servos of one group of joints, in the order of the robot's anatomy; legs have no limit."""

    ids: tuple[_Id, ...] = number((), "1", "assumed: set by hand", "ids on the bus")
    directions: tuple[_Direction, ...] = number(
        (), "1", "assumed: mounted alike", "sign between ticks and angle"
    )
    zeros: tuple[_Zero, ...] = number(
        (), "ticks", "assumed: the middle of a turn", "position at the angle 0"
    )
    fastest: float = number(
        4.5,
        "rad/s",
        "assumed: two thirds of an unloaded XC430-W240 at 11.1 V, 6.8 rad/s (datasheet)",
        "fastest that goals move",
        gt=0,
        le=_XC430,
    )


class YawsParams(JointsParams):
    """Servos of the yaw joints."""

    limit: float = number(
        _LIMIT,
        "rad",
        "assumed: links at a right angle nearly meet; the gaits stay within 0.96",
        "largest angle either way",
        gt=0,
        le=_LIMIT,
    )


class BasesParams(JointsParams):
    """Servos of the antenna bases."""

    fastest: float = number(
        4.5,
        "rad/s",
        "assumed: as the other joints; an unloaded XL330-M288 makes 10.8 rad/s at 5 V (datasheet)",
        "fastest that goals move",
        gt=0,
        le=_XL330,
    )
    limit: float = number(
        _LIMIT,
        "rad",
        "assumed: further outwards an antenna lies along the body, inwards it crosses the other",
        "largest angle either way from the mounting angle",
        gt=0,
        le=_LIMIT,
    )


_Group = TypeVar("_Group", bound=JointsParams)


def _group(kind: type[_Group], first: int, count: int) -> _Group:
    return kind(
        ids=tuple(range(first, first + count)),
        directions=(1,) * count,
        zeros=(_STRAIGHT,) * count,
    )


def _with_tuples(table: dict[str, object]) -> dict[str, object]:
    return {
        key: tuple(cast("list[object]", value)) if isinstance(value, list) else value
        for key, value in table.items()
    }


_GroupName = Literal["yaw", "legs", "antennae"]


class LayoutParams(Params):
    """All servos of a robot: 5 yaw joints, 12 legs, 2 antenna bases."""

    baud: Literal[57600, 115200, 1000000, 2000000, 3000000, 4000000] = number(
        1_000_000,
        "bit/s",
        "assumed: write and read of 19 servos then take 4.3 of 10 ms",
        "bus speed",
    )
    yaw: YawsParams = _group(YawsParams, 1, YAW_COUNT)
    legs: JointsParams = _group(JointsParams, _FIRST_LEG, len(LEGS))
    antennae: BasesParams = _group(BasesParams, _FIRST_ANTENNA, 2)
    release: tuple[_GroupName, _GroupName, _GroupName] = number(
        ("antennae", "yaw", "legs"),
        "1",
        "assumed: what carries the robot goes last",
        "order in which the groups lose their torque",
    )

    @model_validator(mode="before")
    @classmethod
    def _complete(cls, data: object) -> object:
        """A table with some keys of a group leaves the others as they are by default.

        Lists become tuples here: what a "before" has touched is no longer judged as JSON.
        """
        if not isinstance(data, dict):
            return data
        given = _with_tuples(cast("dict[str, object]", data))
        for name in ("yaw", "legs", "antennae"):
            group = given.get(name)
            if isinstance(group, dict):
                known: JointsParams = cls.model_fields[name].default
                given[name] = known.model_dump() | _with_tuples(cast("dict[str, object]", group))
        return given

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
        if len(set(self.release)) < len(self.release):
            raise ValueError(f"release must name each group once, got {', '.join(self.release)}")
        if doubled := sorted({i for i in self.ids if self.ids.count(i) > 1}):
            raise ValueError(f"ids must differ, got {', '.join(map(str, doubled))} more than once")
        return self

    @property
    def in_order_of_release(self) -> tuple[tuple[int, ...], ...]:
        """Ids of the groups in the order in which they lose their torque."""
        return tuple(getattr(self, name).ids for name in self.release)

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

    @property
    def limits(self) -> tuple[float, ...]:
        """Largest angles of all 19 either way [rad], inf for legs."""
        yaws, bases = (self.yaw.limit,) * YAW_COUNT, (self.antennae.limit,) * 2
        return yaws + (math.inf,) * len(LEGS) + bases

    @property
    def fastest(self) -> tuple[float, ...]:
        """Fastest that the goals of all 19 move [rad/s]."""
        groups = (self.yaw, self.legs, self.antennae)
        return tuple(group.fastest for group in groups for _ in group.ids)
