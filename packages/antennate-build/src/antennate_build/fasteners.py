"""Screws and bolts: what they hold, how long they are beside what they pass, and what they weigh.

How far a screw reaches is measured on the solids: its head sits where the part ends in a ring about
the hole, seen from the face that the part has in common with what the screw bites into.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from antennate_build import flange, kernel
from antennate_build.antenna_assembly import AntennaSolids
from antennate_build.checks import Check
from antennate_build.kernel import Axis, Point, Solid
from antennate_build.link_layout import PLATE
from antennate_build.link_parts import BOLTS, HEAD_BOLTS, HEAD_FRONT, circle
from antennate_build.mounts import Screw
from antennate_build.robot_assembly import RobotSolids

STEEL = 7.85e-3
"""Density of steel [g/mm³]."""
M3 = Screw("bolt M3", 3.0, 3.2, 5.5, 3.0)
"""ISO 4762."""
NUT = 2.4
"""Height of its nut [mm] (ISO 4032), 5.5 mm across flats."""


@dataclass(frozen=True)
class Seat:
    """A hole of a printed part, at the face towards what its screw bites into.

    Attributes:
        part: The part.
        at: Middle of the hole on that face, in the frame of the part [mm].
        axis: Along the screw.
        sign: Direction of its head along that axis.
    """

    part: str
    at: Point
    axis: Axis
    sign: Literal[1, -1]


@dataclass(frozen=True)
class Fastener:
    """Screws alike, or bolts with their nuts.

    Attributes:
        count: How many a robot, or an antenna, takes.
        screw: What they are.
        length: Length below the head [mm].
        use: What they hold.
        seats: The part that one passes, for a bolt both.
        depth: Depth of the thread that it bites into; 0 for a bolt with its nut [mm].
    """

    count: int
    screw: Screw
    length: float
    use: str
    seats: tuple[Seat, ...]
    depth: float

    @property
    def name(self) -> str:
        """What to ask for."""
        return f"{self.screw.name} x {self.length:g}{' with nut' * (not self.depth)}"

    @property
    def mass(self) -> float:
        """Mass of one, as plain cylinders [g]."""
        screw = self.screw
        volume = screw.thread**2 * self.length + screw.head**2 * screw.head_height
        nut = 0.0 if self.depth else math.sqrt(0.75) * screw.head**2 - math.pi / 4 * screw.thread**2
        return STEEL * (math.pi / 4 * volume + nut * NUT)


def of_antenna(antenna: AntennaSolids, antennae: int) -> list[Fastener]:
    """The screws of the brackets."""
    mount, layout = antenna.mount, antenna.layout
    (x, y), *_ = places = flange.screw_places(mount, layout.antenna.roll)
    height = flange.hinge_height(layout, mount, layout.antenna.roll)
    seat = Seat(antenna.sides[0][0], (x, y, -height), "z", 1)
    count, horn = antennae * len(places), mount.horn
    length = flange.SCREW_LENGTH
    return [Fastener(count, horn.screw, length, "bracket to horn", (seat,), horn.depth)]


def of_links(robot: RobotSolids) -> list[Fastener]:
    """The screws of the links and the bolts of their hinges."""
    layout, links, base = robot.layout, robot.layout.robot.links, robot.base
    joints, yaw, leg, pitch = links - 1, layout.yaw, layout.leg, layout.pitch
    (hx, hy), (lx, ly) = circle(yaw)[0], circle(leg)[0]
    (sy, sz), (up, along) = yaw.sides[0], leg.back[0]
    hinge = Seat("hinge", (hx, hy, yaw.horn.top), "z", 1)
    web = Seat("leg", (lx, ly, 0.0), "z", 1)
    cradle = Seat("frame_tail", (layout.axis + sy, yaw.x, sz), "y", 1)
    wall = Seat("frame_tail", (along, layout.wall, -abs(up)), "y", -1)
    under, over = 2 * len(leg.back), 0
    if base is not None:
        over = 2 * sum(place > 0 for place, _ in leg.back)
    found = [
        Fastener(
            2 * joints * yaw.horn.holes, yaw.horn.screw, 6, "hinges", (hinge,), yaw.horn.depth
        ),
        Fastener(2 * links * leg.horn.holes, leg.horn.screw, 6, "legs", (web,), leg.horn.depth),
        Fastener(2 * joints * len(yaw.sides), yaw.screw, 6, "yaw servos", (cradle,), yaw.depth),
        Fastener(links * under - over, leg.screw, 6, "leg servos", (wall,), leg.depth),
    ]
    (y, z), bend = BOLTS[0], layout.reach + PLATE
    bolted = Seat("hinge", (bend, y, z), "x", -1)
    other = Seat("frame_head", (layout.rear + bend, y, z), "x", 1)
    if pitch is not None:
        other = Seat("hinge_pitch", (bend, y, z), "x", -1)
        (px, py), (sy, sz) = circle(pitch)[0], pitch.sides[0]
        arm = Seat("hinge_pitch", (px, py, pitch.horn.top), "z", 1)
        floor = Seat("frame_head", (layout.rear - sy, sz, layout.floor + PLATE), "z", -1)
        holes, cases = 2 * joints * pitch.horn.holes, joints * len(pitch.sides)
        found += [
            Fastener(holes, pitch.horn.screw, 6, "pitch hinges", (arm,), pitch.horn.depth),
            Fastener(cases, pitch.screw, 6, "pitch servos, from below", (floor,), pitch.depth),
        ]
    found.append(Fastener(4 * joints, M3, 10, "joints", (bolted, other), 0.0))
    if base is not None:
        flap = Seat("cabin", (along, layout.wall, abs(up)), "y", -1)
        y, z = HEAD_BOLTS[0]
        plates = (
            Seat("head_plate", (HEAD_FRONT, y, z), "x", 1),
            Seat("frame_head", (HEAD_FRONT, y, z), "x", -1),
        )
        across, forth = base.back[0]
        place, apart = 500.0 * layout.robot.link_pitch, 500.0 * layout.robot.antenna.base_spacing
        face = robot.horn + base.horn.top - base.z[1]
        front = Seat("head_plate", (place + forth, apart + across, face), "z", -1)
        found += [
            Fastener(over, leg.screw, 8, "leg servos, through the cabin", (flap,), leg.depth),
            Fastener(len(HEAD_BOLTS), M3, 10, "head plate", plates, 0.0),
            Fastener(2 * len(base.back), base.screw, 6, "base servos", (front,), base.depth),
        ]
    return found


def passed(solid: Solid, seat: Seat, screw: Screw, length: float) -> float:
    """How far below the head of a screw that face is [mm]; 0 where nothing carries the head."""
    way = seat.sign * length
    ring = kernel.cut(
        kernel.rod(screw.head / 2.0 - 0.1, seat.at, way, seat.axis),
        kernel.rod(screw.clearance / 2.0 + 0.1, seat.at, way, seat.axis),
    )
    carried = kernel.common(solid, ring)
    if carried is None:
        return 0.0
    low, high = kernel.bounds(carried)
    n = "xyz".index(seat.axis)
    return high[n] - seat.at[n] if seat.sign > 0 else seat.at[n] - low[n]


def check(fasteners: list[Fastener], parts: Mapping[str, Solid]) -> Check:
    """The check that all screws bite for a diameter at least, and do not meet the end of a hole."""
    told, bad = list[str](), list[str]()
    for each in fasteners:
        stack = [passed(parts[s.part], s, each.screw, each.length) for s in each.seats]
        left, least, most = each.length - sum(stack), each.screw.thread, each.depth
        if not each.depth:
            least, most = NUT, 2.0 * NUT
        good = min(stack) > 0.5 and least - 0.01 <= left <= most + 0.01
        words = f"{each.name} of {each.use}: {left:.1f} mm of {least:g} to {most:g} left to bite"
        (told if good else bad).append(words)
    return Check("screws reach", "; ".join(bad) or f"{len(told)} kinds, each bites", not bad)
