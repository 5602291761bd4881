"""Transforms of a robot's links as messages of ROS 2, which a log does not hold."""

from __future__ import annotations

import struct
from collections.abc import Sequence

from antennate.sim.frames import transforms
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
_HEADER = b"\0\1\0\0"
"""Plain CDR, little end first, as of `telemetry.cdr`; alignment counts from behind it."""
_STAMP, _VALUES = struct.Struct("<iI"), struct.Struct("<7d")


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
    values, time = transforms(places, parents), _STAMP.pack(*divmod(stamp, 10**9))
    body = bytearray(struct.pack("<I", len(rows)))
    for row in rows:
        body += bytes(-len(body) % 4) + time
        for name in (WORLD if parents[row] < 0 else names[parents[row]], names[row]):
            text = name.encode() + b"\0"
            body += bytes(-len(body) % 4) + struct.pack("<I", len(text)) + text
        body += bytes(-len(body) % 8) + _VALUES.pack(*values[row])
    return _HEADER + body
