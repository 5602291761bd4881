"""Transforms of a robot's links as messages of ROS 2, which a log does not hold."""

from __future__ import annotations

import struct

from antennate.sim.frames import Links
from antennate.telemetry.topics import TIME_SCHEMA

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
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
{TIME_SCHEMA}{_RULE}
MSG: geometry_msgs/Transform
geometry_msgs/Vector3 translation
geometry_msgs/Quaternion rotation
{_RULE}
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
{_RULE}
MSG: geometry_msgs/Quaternion
float64 x
float64 y
float64 z
float64 w
"""
_HEADER = b"\0\1\0\0"
"""Plain CDR, little end first, as of `telemetry.cdr`; alignment counts from behind it."""
_STAMP, _VALUES = struct.Struct("<iI"), struct.Struct("<7d")


class Transforms:
    """Encoder of the transforms of some links.

    Args:
        links: The links.
        placed: Whether the head has a place in the world, which a real robot does not know.
    """

    def __init__(self, links: Links, placed: bool) -> None:
        self._links = links
        self._rows = [i for i, parent in enumerate(links.parents.tolist()) if placed or parent >= 0]
        self._offsets: list[tuple[int, int]] = []
        body = bytearray(struct.pack("<I", len(self._rows)))
        for row in self._rows:
            parent = int(links.parents[row])
            body += bytes(-len(body) % 4)
            stamp = len(body)
            body += bytes(_STAMP.size)
            for name in (WORLD if parent < 0 else links.names[parent], links.names[row]):
                text = name.encode() + b"\0"
                body += bytes(-len(body) % 4) + struct.pack("<I", len(text)) + text
            body += bytes(-len(body) % 8)
            self._offsets.append((stamp + len(_HEADER), len(body) + len(_HEADER)))
            body += bytes(_VALUES.size)
        self._message = bytearray(_HEADER + body)

    def encode(self, places: bytes, stamp: int) -> bytes:
        """The message at a time [ns], of links at places as of `LinkFrames.places`."""
        values = self._links.transforms(places)[self._rows].tolist()
        time = divmod(stamp, 10**9)
        for (at, then), row in zip(self._offsets, values, strict=True):
            _STAMP.pack_into(self._message, at, *time)
            _VALUES.pack_into(self._message, then, *row)
        return bytes(self._message)
