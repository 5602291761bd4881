"""The flange of an antenna's bracket on the horn of a servo: its size, height and screws, in mm."""

from __future__ import annotations

import math

from antennate_build.layout import AntennaLayout
from antennate_build.mounts import Mount

PIN_HEAD = 1.2
"""Thickness of a pin's head [mm]."""
FLANGE = 2.0
"""Thickness of the bracket's flange on the horn [mm]: a screw M2 x 4 then bites 2 mm."""
SCREW_LENGTH = 4.0
"""Length of the screws of the flange [mm]."""
_HEAD_ROOM = 0.6
"""Between heads of screws and what turns above them [mm]."""


def hinge_height(layout: AntennaLayout, mount: Mount, roll: float) -> float:
    """Height of the first hinge above the face of the horn [mm].

    The first segments must pass above flange and screws at every angle of their hinge, on either
    side of the robot. `roll` turns the plane in which they bend about the antenna's own axis [rad].
    """
    above = FLANGE + mount.horn.screw.head_height + _HEAD_ROOM
    radius, turns = flange_radius(layout, mount) + 2.0, {roll, -roll, roll + math.pi}
    return above - min(_lowest(layout, turn, radius) for turn in turns)


def _lowest(layout: AntennaLayout, turn: float, radius: float) -> float:
    """How far two segments reach below the hinge within a radius about the shaft."""
    hinge, lowest = layout.hinge, 0.0
    corners = [
        (x, y, z)
        for x in (0.0, *(layout.length * k / 8.0 for k in range(1, 17)))
        for y in (layout.low, layout.strip.top)
        for z in (-hinge.half, hinge.half + PIN_HEAD)
    ]
    for n in range(-20, 21):
        angle = hinge.stop * n / 20.0
        for x, y, z in corners:
            along = x * math.cos(angle) - y * math.sin(angle)
            across = x * math.sin(angle) + y * math.cos(angle)
            left = across * math.cos(turn) - z * math.sin(turn)
            up = across * math.sin(turn) + z * math.cos(turn)
            if math.hypot(along, left) <= radius:
                lowest = min(lowest, up)
    return lowest


def flange_radius(layout: AntennaLayout, mount: Mount) -> float:
    """Radius of the bracket's flange: that of the horn, or more for walls about the screws."""
    return max(mount.horn.diameter / 2.0, mount.horn.circle / 2.0 + _boss(layout, mount))


def _boss(layout: AntennaLayout, mount: Mount) -> float:
    """Radius of a wall about a screw."""
    return mount.horn.screw.clearance / 2.0 + layout.print.wall_mm


def flange_circles(layout: AntennaLayout, mount: Mount) -> list[tuple[float, float, float]]:
    """Circles (x, y, radius) that the flange goes around: about each screw, to save mass.

    Where the antenna has a roll, the arms above need all of the disc.
    """
    roll = layout.antenna.roll
    if roll:
        return [(0.0, 0.0, flange_radius(layout, mount))]
    return [(x, y, _boss(layout, mount)) for x, y in screw_places(mount, roll)]


def opening_radius(layout: AntennaLayout, mount: Mount) -> float:
    """Radius of the opening about the shaft, a wall from screws and column; 0 without one."""
    saved = mount.horn.circle / 2.0 - _boss(layout, mount)
    saved = 0.0 if layout.antenna.roll else min(saved, layout.hinge.clear)
    return max(saved, mount.horn.centre / 2.0)


def screw_places(mount: Mount, roll: float = 0.0) -> list[tuple[float, float]]:
    """Places of the screws of the flange, where a screwdriver passes beside arms and column.

    Three for a straight bracket, two in front for one with a roll, whose arms stand out.
    """
    radius, angles = mount.horn.circle / 2.0, (-90.0, 0.0, 90.0) if not roll else (-45.0, 45.0)
    turns = (math.radians(angle) for angle in angles)
    return [(radius * math.cos(turn), radius * math.sin(turn)) for turn in turns]
