"""Parameters of the controllers that feel nothing: when they escape, and where they turn."""

from __future__ import annotations

import math
from typing import Annotated

from pydantic import Field

from antennate.params.base import Params, number

_Angle = Annotated[float, Field(gt=0, le=math.pi)]
_Time = Annotated[float, Field(ge=0, le=30)]


class TimedParams(Params):
    """When `timed` escapes; how it escapes is `escape`."""

    walk_time: float = number(5.0, "s", "assumed: three gait cycles; not tuned", gt=0, le=300)
    """Time to walk between two escapes."""


class ScheduleParams(Params):
    """Turns of `schedule`, to one side and to the other, farther and farther."""

    walk_time: float = number(
        12.0, "s", "fitted: best of 5, 8, 12 and 18 s (docs/science/corridors.md)", gt=0, le=300
    )
    """Time to walk between two escapes."""
    headings: tuple[_Angle, ...] = number(
        (0.785, 0.785, 1.571, 1.571),
        "rad",
        "fitted: better than 60, 60, 100, 100, 130 deg (docs/science/corridors.md)",
        min_length=1,
        max_length=20,
    )
    """Headings that it turns to, from the first heading, right and left by turns."""
    reverse_times: tuple[_Time, ...] = number(
        (2.2, 3.5, 5.0),
        "s",
        "assumed: as escape.reverse_time, then room for a longer turn",
        min_length=1,
        max_length=20,
    )
    """Times to back off before each turn; the last one for all further turns."""
    turn_rate: float = number(
        math.pi / 7.5, "rad/s", "assumed: 180 deg in escape.return_time", gt=0, le=3
    )
    """Turning in free space at escape.turn_offset, by which the time of a turn is reckoned."""


class ZigzagParams(Params):
    """Turns of `zigzag`, all of one size."""

    walk_time: float = number(5.0, "s", "assumed: as timed.walk_time", gt=0, le=300)
    """Time to walk between two turns."""
    reverse_time: float = number(
        0.8, "s", "assumed: half a gait cycle, so that the head comes free", ge=0, le=30
    )
    """Time to back off before a turn."""
    turn_time: float = number(
        4.4, "s", "assumed: twice escape.turn_time, from one side to the other", gt=0, le=60
    )
    """Time of each turn; the first is half as long."""


class RandomParams(Params):
    """Chance of `random`; the same seed and gait phase at the start give the same choices."""

    seed: int = number(0, "1", "assumed: any", ge=0)
    """Seed of its choices, beside the gait phase at the start."""
    walk_time: float = number(5.0, "s", "assumed: as timed.walk_time", gt=0, le=300)
    """Mean time to walk between two escapes; it is distributed exponentially."""
    reverse_time: float = number(2.2, "s", "assumed: as escape.reverse_time", ge=0, le=30)
    """Mean time to back off; it is uniform from 0 to twice that."""
    turn_time: float = number(
        4.4, "s", "assumed: its mean is that of escape.turn_time", gt=0, le=60
    )
    """Longest turn; a turn is uniform from 0 to that, to either side alike."""
