"""Transforms of a robot's links as messages of ROS 2, which a log does not hold."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Any

from antennate.sim.frames import transforms
from antennate.telemetry.cdr import MessageType
from antennate.telemetry.topics import HEADER_SCHEMA, TURN_SCHEMA
from antennate.types import Floats

NAME, TYPE = "/tf", "tf2_msgs/msg/TFMessage"
WORLD = "world"
"""The frame that the head stands in, where its place is known."""
_RULE = "=" * 80
SCHEMA = f"""\
geometry_msgs/TransformStamped[] transforms
{_RULE}
MSG: geometry_msgs/TransformStamped
std_msgs/Header header
string child_frame_id
geometry_msgs/Transform transform
{_RULE}
MSG: geometry_msgs/Transform
geometry_msgs/Vector3 translation
geometry_msgs/Quaternion rotation
{HEADER_SCHEMA}{TURN_SCHEMA}"""


def encoded(
    names: Sequence[str], parents: Sequence[int], places: Floats, stamp: int, placed: bool
) -> bytes:
    """The message of links at a time [ns].

    Args:
        names: Names of the links, as of `LinkFrames`, as the next two.
        parents: Number of the link that carries each.
        places: Where they are.
        stamp: The time [ns].
        placed: Whether the head has a place in the world, which a real robot does not know.
    """
    rows = [i for i, parent in enumerate(parents) if placed or parent >= 0]
    time, values = divmod(stamp, 10**9), transforms(places, parents)
    parts: list[Any] = [len(rows)]
    for row in rows:
        above = WORLD if parents[row] < 0 else names[parents[row]]
        parts += [*time, above, names[row], values[row].tolist()]
    return _of(len(rows)).encode(*parts)


@lru_cache
def _of(count: int) -> MessageType:
    """The type of messages with so many links, without nesting."""
    link = "int32 s{0}\nuint32 n{0}\nstring above{0}\nstring link{0}\nfloat64[7] place{0}"
    return MessageType(TYPE, "\n".join(["uint32 count", *map(link.format, range(count))]))
