"""Left and right: the order of every array with an axis over the two sides."""

from __future__ import annotations

SIDES = ("l", "r")
LEFT, RIGHT = 0, 1
SIDE_SIGN = (1.0, -1.0)
"""Sign of the lateral (y) coordinate on each side; y points to the robot's left."""
