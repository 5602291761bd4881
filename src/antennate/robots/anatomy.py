"""Names and order of every part: the single place that says what comes first.

Links run head first, antenna links proximal to distal, sides left before right. Every array in
the package that has an axis over one of these uses this order.
"""

from __future__ import annotations

LINK_COUNT = 6
YAW_COUNT = LINK_COUNT - 1
ANTENNA_LINK_COUNT = 6

SIDES = ("l", "r")
LEFT, RIGHT = 0, 1
SIDE_SIGN = (1.0, -1.0)
"""Sign of the lateral (y) coordinate on each side; y points to the robot's left."""

LINKS = tuple(f"link{i}" for i in range(LINK_COUNT))
YAW_JOINTS = tuple(f"yaw{j}" for j in range(1, LINK_COUNT))
PITCH_JOINTS = tuple(f"pitch{j}" for j in range(1, LINK_COUNT))
LEGS = tuple(f"leg_{side}{i}" for i in range(LINK_COUNT) for side in SIDES)
"""Twelve legs in the order of a (6, 2) array over (link, side)."""

ANTENNA_PREFIXES = tuple(f"antenna_{side}_" for side in SIDES)
ANTENNA_BASE = "base"
ANTENNA_HINGES = tuple(f"hinge{i}" for i in range(ANTENNA_LINK_COUNT))
