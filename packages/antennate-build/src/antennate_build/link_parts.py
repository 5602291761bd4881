"""The printed parts of a robot's links as solids: frames, hinges, legs, treads, cabin, head plate.

Each part stands in the frame of its link (`link_layout`), hinges in that of their axis: the servo's
shaft along z, the web towards +x.
"""

from __future__ import annotations

import math

from antennate_build import kernel
from antennate_build.kernel import Solid
from antennate_build.link_layout import BATTERY, CABIN, PLATE, TREAD, LinkLayout
from antennate_build.mounts import Mount

BOLT = 3.2
"""Hole of the bolts M3 that hold a hinge [mm]."""
BOLTS = ((8.0, 8.0), (8.0, -8.0), (-8.0, 8.0), (-8.0, -8.0))
"""Places of these bolts on a web."""
HEAD_FRONT = 34.0
"""Front of the head's frame along x [mm]."""
HEAD_BOLTS = tuple((y, z) for y in (-28.0, -12.0, 12.0, 28.0) for z in (-9.0, 3.0))
"""Places of the bolts of the head plate."""
_TIE = (4.0, 2.0)
"""Slot of a cable tie [mm]."""
_PLAY = 0.2
"""Gap about the case of a servo [mm]."""


def servo(mount: Mount) -> Solid:
    """The outside of a servo, its shaft along z: what other parts must not meet."""
    case = kernel.block((-mount.x, mount.x), mount.y, mount.z)
    radius, horn = mount.horn.diameter / 2.0, mount.horn
    shapes = [case, kernel.rod(radius, (0, 0, mount.z[1]), horn.top - mount.z[1])]
    if mount.sides:  # an idler behind
        shapes.append(kernel.rod(radius, (0, 0, mount.z[0]), -(horn.top - mount.z[1])))
    return kernel.joined(*shapes)


def battery(layout: LinkLayout) -> Solid:
    """The largest battery, across the floor of the tail behind its yaw servo."""
    front = min(layout.axis + layout.yaw.y[0] - PLATE - 1.0, 0.0)
    long, wide, tall = BATTERY
    low = layout.floor + PLATE
    return kernel.block((front - long, front), (-wide / 2.0, wide / 2.0), (low, low + tall))


def hinge(mount: Mount, reach: float) -> Solid:
    """A hinge: an arm on the horn, one on the idler, a web between them with four bolts."""
    top, horn = mount.horn.top, mount.horn
    radius = horn.circle / 2.0 + horn.screw.clearance / 2.0 + 1.6
    shapes = []
    for z in ((top, top + PLATE), (-top - PLATE, -top)):
        shapes.append(kernel.rod(radius, (0, 0, z[0]), PLATE))
        shapes.append(kernel.block((0.0, reach + PLATE), (-radius, radius), z))
    web = kernel.block((reach, reach + PLATE), (-14.0, 14.0), (-top - PLATE, top + PLATE))
    holes = [kernel.rod(BOLT / 2.0, (reach - 1, y, z), PLATE + 2, "x") for y, z in BOLTS]
    holes.append(kernel.rod(4.5, (reach - 1, 0, 0), PLATE + 2, "x"))  # cables
    holes.append(kernel.rod(horn.centre / 2.0, (0, 0, -99), 198))
    for x, y in circle(mount):
        holes.append(kernel.rod(horn.screw.clearance / 2.0, (x, y, -99), 198))
    return kernel.cut(kernel.joined(web, *shapes), *holes)


def circle(mount: Mount) -> list[tuple[float, float]]:
    """Places of the holes of a horn about its shaft [mm]."""
    radius = mount.horn.circle / 2.0
    turns = [n * math.tau / mount.horn.holes for n in range(mount.horn.holes)]
    return [(radius * math.cos(turn), radius * math.sin(turn)) for turn in turns]


def frame(layout: LinkLayout, first: bool, last: bool) -> Solid:
    """The frame of a link: floor, side walls for the leg servos, cradle of the yaw servo.

    Args:
        layout: Sizes.
        first: Whether it is the head, which has a front wall in place of the cradle.
        last: Whether it is the tail, which has nothing behind.
    """
    low, top, wall = layout.floor, layout.leg.x, layout.wall
    front = HEAD_FRONT if first else layout.front
    back = max(layout.back, layout.leg.y[0]) if last else layout.back
    beam = -layout.leg.y[0] - 1.0  # legs lie along x, their long end behind
    floor = kernel.block((min(back, -beam), 34.0), (-wall, wall), (low, low + PLATE))
    shapes = [floor]
    for side in (1.0, -1.0):
        y = sorted((side * wall, side * (wall - PLATE)))
        shapes.append(kernel.block((layout.leg.y[0], layout.leg.y[1] + 1.0), y, (low, top)))
    if not first:
        shapes += _cradle(layout, front)
    if layout.pitch is None and not last:
        rear = layout.rear + layout.reach + PLATE
        shapes.append(kernel.block((rear, rear + PLATE), (-16.0, 16.0), (low, top)))
        shapes += [
            kernel.block((rear, rear + 14.0), (y, y + PLATE), (low, top)) for y in (-19.0, 16.0)
        ]
    elif layout.pitch is not None and not last:
        shapes.append(kernel.block((layout.back, 0.0), (-17.0, 17.0), (low, low + PLATE)))
    if first:
        shapes.append(kernel.block((HEAD_FRONT - PLATE, HEAD_FRONT), (-38.0, 38.0), (low, top)))
    body = kernel.joined(*shapes)
    return kernel.cut(body, *_frame_holes(layout, first, last))


def _cradle(layout: LinkLayout, front: float) -> list[Solid]:
    """Walls at both sides of the yaw servo, and strips of the floor below them."""
    yaw, low = layout.yaw, layout.floor
    inner, back = yaw.x + _PLAY, layout.axis + yaw.y[0] - PLATE
    shapes = []
    for side in (1.0, -1.0):
        y = sorted((side * inner, side * (inner + PLATE)))
        foot = sorted((side * inner, side * (inner + 8.0)))
        shapes.append(kernel.block((back, front), y, (low, 12.0)))
        shapes.append(kernel.block((back, front), foot, (low, low + PLATE)))
    shapes.append(kernel.block((back, back + PLATE - 0.5), (-inner, inner), (low, 12.0)))
    return shapes


def _frame_holes(layout: LinkLayout, first: bool, last: bool) -> list[Solid]:
    leg, yaw, wall = layout.leg, layout.yaw, layout.wall
    holes = []
    for side in (1.0, -1.0):
        at, way = side * (wall - PLATE - 1), side * (PLATE + 2)
        holes += [kernel.rod(leg.screw.clearance / 2.0, (y, at, x), way, "y") for x, y in leg.back]
        holes.append(kernel.rod(leg.horn.diameter / 2.0 + 0.6, (0, at, 0), way, "y"))
        y = sorted((at, at + way))
        holes.append(kernel.block((-21.0, 4.5), y, (0.0, 99.0)))  # idler and plugs, open upward
        holes.append(kernel.block((-21.0, -7.5), y, (-12.8, 1.0)))
        for x in (-30.0, 4.0):
            tie = sorted((side * (wall - 8.0), side * (wall - 8.0 - _TIE[1])))
            holes.append(kernel.block((x, x + _TIE[0]), tie, (-99, 0)))
    if not first:
        case = (-yaw.x - _PLAY, yaw.x + _PLAY)
        holes.append(kernel.block((layout.axis + yaw.y[0], 199), case, (-99, 99)))
        for y, z in yaw.sides:
            holes.append(kernel.rod(yaw.screw.clearance / 2.0, (layout.axis + y, -30, z), 60, "y"))
    if layout.pitch is None and not last:
        rear = layout.rear + layout.reach
        holes += [kernel.rod(BOLT / 2.0, (rear, y, z), 3 * PLATE, "x") for y, z in BOLTS]
        holes.append(kernel.rod(4.5, (rear, 0, 0), 3 * PLATE, "x"))
    elif layout.pitch is not None and not last:
        screw, arm = layout.pitch.screw, layout.pitch.horn.top
        swing = math.hypot(layout.reach + PLATE, 12.0) + 1.0
        for side in (1.0, -1.0):  # where the arms of its hinge pass
            slot = sorted((side * (arm - 1.0), side * (arm + PLATE + 1.0)))
            holes.append(kernel.block((-99, layout.rear + swing), slot, (-99, 99)))
        for y, z in layout.pitch.sides:
            at = (layout.rear - y, z, layout.floor - 1)
            holes.append(kernel.rod(screw.clearance / 2.0, at, PLATE + 2))
            holes.append(kernel.rod(screw.head / 2.0 + 0.3, at, 1.6))
    if first:
        front = HEAD_FRONT - PLATE - 1
        holes += [kernel.rod(BOLT / 2.0, (front, y, z), PLATE + 2, "x") for y, z in HEAD_BOLTS]
    return holes


def leg(layout: LinkLayout) -> Solid:
    """An O-leg: a ring about a point off the axle, a web with the holes of the horn, an open side.

    Its axle is z, the web at 0 lies on the horn, the ring's middle is below it, towards -y.
    """
    robot, mount = layout.robot, layout.leg
    radius = 1e3 * robot.leg_radius - TREAD
    off, width = -1e3 * robot.leg_eccentricity, 1e3 * robot.leg_width
    shell = kernel.rod(radius, (0, off, 0), width)
    hollow = kernel.rod(radius - PLATE, (0, off, PLATE + 1.0), width)
    holes = [kernel.rod(mount.horn.screw.clearance / 2.0, (x, y, -1), 9) for x, y in circle(mount)]
    holes.append(kernel.rod(mount.horn.centre / 2.0, (0, 0, -1), 9))
    return kernel.cut(shell, hollow, *holes)


def tread(layout: LinkLayout) -> Solid:
    """The tread about a leg, of soft plastic, 1 % narrower so that it holds."""
    radius = 1e3 * layout.robot.leg_radius
    off, width = -1e3 * layout.robot.leg_eccentricity, 1e3 * layout.robot.leg_width
    ring = kernel.rod(radius, (0, off, 0), width)
    return kernel.cut(ring, kernel.rod(radius - TREAD, (0, off, -1), width + 2))


def cabin(layout: LinkLayout) -> Solid:
    """A tray for the ESP32 and the converter, on the side walls of the head, open to the front.

    Flaps go down within the side walls, under the upper screws of the leg servos.
    """
    (long, wide, tall), wall, leg = CABIN, 2.0, layout.leg
    low, back = layout.deck, leg.y[0]
    x, half = (layout.tray, layout.tray + long + wall), wide / 2.0
    inside = layout.wall - PLATE - _PLAY
    shapes = [
        kernel.block(x, (-half - wall, half + wall), (low, low + 2.0)),
        kernel.block((x[0], x[0] + wall), (-half - wall, half + wall), (low, low + tall)),
    ]
    for side in (1.0, -1.0):
        strip = sorted((side * half, side * layout.wall))
        shapes.append(kernel.block((back, leg.y[1]), strip, (low, low + 2.0)))
        flap = sorted((side * inside, side * (inside - wall)))
        outer = sorted((side * half, side * (half + wall)))
        ledge = sorted((side * half, side * (half - 2.5)))
        shapes.append(kernel.block((back, leg.y[1]), flap, (5.0, low + 2.0)))
        shapes.append(kernel.block(x, outer, (low, low + tall)))
        shapes.append(kernel.block(x, ledge, (low, low + 5.0)))
    shapes.append(kernel.block(x, (-2.5, 2.5), (low, low + 5.0)))
    shapes.append(kernel.block(x, (-0.8, 0.8), (low, low + 8.0)))
    holes = [kernel.block((x[0] - 1, x[0] + wall + 1), (-20.0, -8.0), (low + 5.0, low + 12.0))]
    holes += [
        kernel.rod(leg.screw.clearance / 2.0, (y, -layout.wall, up), 2 * layout.wall, "y")
        for up, y in leg.back
        if up > 0
    ]
    return kernel.cut(kernel.joined(*shapes), *holes)


def head_plate(layout: LinkLayout, mount: Mount, height: float) -> Solid:
    """The plate that carries the base servos of both antennae, upside down, before the head.

    Args:
        layout: Sizes.
        mount: The base servo.
        height: Height of the face of its horn over the plane of the antennae [mm].
    """
    thick = mount.horn.top - mount.z[1] - 0.5
    low, front = height + 0.5, HEAD_FRONT
    place, apart = 500.0 * layout.robot.link_pitch, 500.0 * layout.robot.antenna.base_spacing
    end = place + max(mount.y[1], mount.horn.diameter / 2.0) + 2.0
    half = max(apart + mount.x + 2.0, 38.0)
    plate = kernel.block((front, end), (-half, half), (low, low + thick))
    lip = kernel.block((front, front + PLATE), (-38.0, 38.0), (layout.floor, low + thick))
    shapes = [plate, lip]
    for y in (-half, -1.25, half - 2.5):
        gusset = [(low, front), (low, front + 14.0), (low - 14.0, front)]
        shapes.append(kernel.prism(gusset, (y, y + 2.5), "y"))
    holes = []
    for side in (1.0, -1.0):
        y = side * apart
        holes.append(kernel.rod(mount.horn.diameter / 2.0 + 0.8, (place, y, low - 1), thick + 2))
        for across, along in mount.back:
            at = (place + along, y + across, low - 20)
            holes.append(kernel.rod(mount.screw.clearance / 2.0, at, 40))
    holes += [kernel.rod(BOLT / 2.0, (front - 1, y, z), PLATE + 2, "x") for y, z in HEAD_BOLTS]
    return kernel.cut(kernel.joined(*shapes), *holes)
