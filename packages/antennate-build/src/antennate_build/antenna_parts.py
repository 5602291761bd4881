"""The printed parts of an antenna as solids: segments, bracket, pins, covers; and its springs.

Each part stands in its own frame (`layout`); `antenna_assembly` puts them together.
"""

from __future__ import annotations

import math

from antennate_build import kernel
from antennate_build.flange import (
    FLANGE,
    PIN_HEAD,
    flange_circles,
    flange_radius,
    hinge_height,
    opening_radius,
    screw_places,
)
from antennate_build.kernel import Solid
from antennate_build.layout import FOOT, AntennaLayout
from antennate_build.mounts import Mount

_TIE = 3.0
"""Length of a floor between the plates [mm]."""
_WINDOW = 9.0
"""Longest window in a plate [mm]: a bridge while it is printed."""
_HEAD = 0.6
"""How far the head of a pin reaches over it [mm]."""
PRESS = 0.05
"""Hole of the outer arms over the pin [mm]: it sits there, and turns in the inner arms."""


Outline = list[tuple[float, float]]


def sector(layout: AntennaLayout, hinge: int, y: tuple[float, float], upto: float) -> Outline:
    """Outline of what belongs to the tip side of a hinge at 0, from it to a place along x."""
    slope, (low, high) = layout.slope(hinge), y
    above = [(high * slope, high)] * (high > 0)
    return [(0.0, 0.0), *above, (upto, high), (upto, low), (-low * slope, low)]


def _both(layout: AntennaLayout, hinge: int, low: float, high: float) -> Outline:
    """Outline between a hinge and the next, from the sector of one to that of the other."""
    near, far, length = layout.slope(hinge), layout.slope(hinge + 1), layout.length
    above = [(high * near, high), (length - high * far, high)] * (high > 0)
    return [(0.0, 0.0), *above, (length, 0.0), (length + low * far, low), (-low * near, low)]


def _levels(low: float, high: float) -> tuple[tuple[float, float], tuple[float, float]]:
    """A range of heights above the middle, and its mirror image."""
    return (low, high), (-high, -low)


def segment(layout: AntennaLayout, number: int) -> Solid:
    """A segment with a hinge at both ends, or at one if it is the last."""
    last = number == layout.antenna.hinges - 1
    hinge, length = layout.hinge, layout.length
    plates = _end_plates(layout) if last else _plates(layout, number)
    body = kernel.joined(*plates, *_ties(layout, number, last))
    body = kernel.cut(body, *_clearances(layout, last))
    arms = _arms(layout, 0.0, _levels(hinge.cavity, hinge.inner))
    arms += [_neck(layout, number, z, near=True) for z in _levels(hinge.cavity, hinge.inner)]
    if not last:
        arms += _arms(layout, length, _levels(hinge.gap, hinge.half))
        arms += [_neck(layout, number + 1, z, near=False) for z in _levels(hinge.gap, hinge.half)]
    posts = _posts(layout) if number < layout.sensed else []
    whole = kernel.joined(body, *arms, *posts)
    return kernel.cut(whole, *_holes(layout, number, last))


def _plates(layout: AntennaLayout, number: int) -> list[Solid]:
    """Plates along both sides, and what joins them to the inner arms."""
    hinge = layout.hinge
    outline, reach = (
        _both(layout, number, layout.low, layout.high),
        hinge.clear + layout.print.wall_mm,
    )
    near = sector(layout, number, (layout.low, hinge.lug), reach)
    plates = [
        kernel.cut(kernel.prism(outline, z), *_windows(layout, layout.length - reach))
        for z in _levels(hinge.gap, hinge.half)
    ]
    return plates + [kernel.prism(near, z) for z in _levels(hinge.cavity, hinge.half)]


def _windows(layout: AntennaLayout, end: float) -> list[Solid]:
    """Holes in both plates that save mass, up to a place along x; none in short segments."""
    wall = layout.print.wall_mm
    first, last = layout.hinge.clear + 2.0 * wall, end - wall
    count = math.ceil((last - first + wall) / (_WINDOW + wall))
    width = (last - first + wall) / count - wall
    if width < wall:
        return []
    tall = (layout.low + wall, _post_foot(layout))
    starts = [first + n * (width + wall) for n in range(count)]
    return [kernel.block((x, x + width), tall, (-99, 99)) for x in starts]


def _end_plates(layout: AntennaLayout) -> list[Solid]:
    """The plates of the last segment, with a round nose and a wall across."""
    hinge, length, wall = layout.hinge, layout.length, layout.print.wall_mm
    radius, number = -layout.low, layout.antenna.hinges - 1
    middle = length - radius
    outline = sector(layout, number, (layout.low, layout.high), middle)
    near = sector(layout, number, (layout.low, hinge.lug), hinge.clear + wall)
    plates = [
        kernel.cut(kernel.prism(outline, z), *_windows(layout, middle + wall))
        for z in _levels(hinge.gap, hinge.half)
    ]
    plates += [kernel.prism(near, z) for z in _levels(hinge.cavity, hinge.half)]
    nose = kernel.rod(radius, (middle, 0, -hinge.half), 2.0 * hinge.half)
    nose = kernel.cut(nose, kernel.block((0, middle), (-99, 99), (-99, 99)))
    hollow = kernel.rod(radius - wall, (middle, 0, -hinge.gap), 2.0 * hinge.gap)
    return [*plates, kernel.cut(nose, hollow)]


def _ties(layout: AntennaLayout, number: int, last: bool) -> list[Solid]:
    """Floors between the plates, with a beam about the hole of each leg, open at its end."""
    hinge, wall = layout.hinge, layout.print.wall_mm
    length, tied, held = layout.length, hinge.clear + _TIE, layout.springs[0].leg
    ends = [((0.0, tied), (0.0, held), layout.leg_height(number, upper=True))]
    if not last:
        z = layout.leg_height(number + 1, upper=False)
        ends += [((length - tied, length), (length - held, length), z)]
    lower = (
        sector(layout, number, (layout.low, 0.0), layout.length)
        if last
        else _both(layout, number, layout.low, 0.0)
    )
    floor = kernel.common(
        kernel.prism(lower, (-hinge.gap, hinge.gap)),
        kernel.block((-99, 99), (layout.low, layout.low + wall), (-99, 99)),
    )
    beam = wall + hinge.leg_hole / 2.0
    solids = []
    for tie, leg, z in ends:
        part = kernel.common(floor, kernel.block(tie, (-99, 99), (-99, 99)))
        ends_of_rib = max(z - beam, -hinge.gap), min(z + beam, hinge.gap)
        rib = kernel.block(leg, (layout.low, beam - hinge.leg), ends_of_rib)
        solids += [part, kernel.common(rib, kernel.prism(lower, (-99, 99)))]
    return solids


def _arms(
    layout: AntennaLayout, x: float, levels: tuple[tuple[float, float], tuple[float, float]]
) -> list[Solid]:
    """Discs about a pin, each with a foot on which it stands while it is printed."""
    hinge = layout.hinge
    return [
        solid
        for z in levels
        for solid in (
            kernel.rod(hinge.lug, (x, 0, z[0]), z[1] - z[0]),
            kernel.block((x - FOOT, x + FOOT), (-hinge.foot, 0.0), z),
        )
    ]


def _clearances(layout: AntennaLayout, last: bool) -> list[Solid]:
    """Room about the pins."""
    hinge = layout.hinge
    ends = [0.0] if last else [0.0, layout.length]
    return [kernel.rod(hinge.clear, (x, 0, -50), 100) for x in ends]


def _neck(layout: AntennaLayout, number: int, z: tuple[float, float], near: bool) -> Solid:
    """What joins an arm to its plate: the sector of the segment, as broad as the arm."""
    hinge, lug = layout.hinge, layout.hinge.lug
    reach = hinge.clear + layout.print.wall_mm
    outline = sector(layout, number, (-lug, lug), reach)
    if not near:
        outline = [(layout.length - x, y) for x, y in outline]
    return kernel.prism(outline, z)


def _posts(layout: AntennaLayout) -> list[Solid]:
    """Posts at the middle that hold the sensor and its cover."""
    middle, half = layout.length / 2.0, layout.strip.length / 2.0
    return posts(layout, (middle - half, middle + half), _post_foot(layout))


def _post_foot(layout: AntennaLayout) -> float:
    """Where posts stand along y: so low that they are a wall thick below the groove."""
    strip, wall = layout.strip, layout.print.wall_mm
    inward = max(layout.hinge.gap - strip.half, 0.0)
    return min(layout.high - wall, strip.roof - layout.print.play_mm - wall - inward)


def posts(layout: AntennaLayout, x: tuple[float, float], low: float) -> list[Solid]:
    """Two posts beside the sensor with a groove for the cover; the sensor lies on the arms.

    Args:
        layout: Sizes.
        x: Ends of the posts along x.
        low: Where they stand along y.
    """
    hinge, strip, play = layout.hinge, layout.strip, layout.print.play_mm
    foot, lip = strip.half + strip.lip, strip.top - layout.print.wall_mm
    inward = max(hinge.gap - strip.half, 0.0)  # at 45 deg, as nothing is below it
    half = [(strip.half, low + inward), (strip.half, strip.roof - play)]
    half += [(foot, strip.roof - play), (foot, lip), (strip.half, lip), (strip.half, strip.top)]
    half += [(hinge.half, strip.top), (hinge.half, low), (max(hinge.gap, strip.half), low)]
    right = [(z, y) for z, y in half]
    left = [(-z, y) for z, y in half]
    return [kernel.prism([(y, z) for z, y in side], x, "x") for side in (right, left)]


def cover(layout: AntennaLayout) -> Solid:
    """The cover that slides over the sensor, below the lips of two posts."""
    strip, play = layout.strip, layout.print.play_mm
    foot, half = strip.half + strip.lip - play, strip.length / 2.0
    return kernel.block(
        (-half, half), (strip.roof, strip.roof + layout.print.wall_mm), (-foot, foot)
    )


def _holes(layout: AntennaLayout, number: int, last: bool) -> list[Solid]:
    """Holes of pins and legs."""
    hinge, length = layout.hinge, layout.length
    turning = hinge.pin / 2.0 + layout.print.play_mm / 2.0
    deep = layout.springs[0].leg + 0.5
    leg = hinge.leg_hole / 2.0
    up = layout.leg_height(number, upper=True)
    holes = [kernel.rod(turning, (0, 0, -50), 100), kernel.rod(leg, (0, -hinge.leg, up), deep, "x")]
    if not last:
        down = layout.leg_height(number + 1, upper=False)
        holes += [
            kernel.rod((hinge.pin + PRESS) / 2.0, (length, 0, -50), 100),
            kernel.rod(leg, (length, -hinge.leg, down), -deep, "x"),
        ]
    return holes


def pin(layout: AntennaLayout) -> Solid:
    """A hinge pin with its head at the top and a flat on which it is printed."""
    hinge = layout.hinge
    radius, head = hinge.pin / 2.0, hinge.pin / 2.0 + _HEAD
    shaft = kernel.rod(radius, (0, 0, -hinge.half), 2.0 * hinge.half)
    whole = kernel.joined(shaft, kernel.rod(head, (0, 0, hinge.half), PIN_HEAD))
    flat = -0.74 * radius
    return kernel.cut(whole, kernel.block((-9, 9), (flat - 9, flat), (-99, 99)))


def spring(layout: AntennaLayout, number: int, angle: float = 0.0) -> Solid:
    """A spring about its hinge, which is bent by an angle [rad]; its diameter is that at rest."""
    body = layout.springs[number]
    turns = body.turns + angle / math.tau
    return kernel.coil(body.coil / 2.0, body.wire, turns, (body.leg, body.leg))


def bracket(layout: AntennaLayout, mount: Mount, turn: float = 0.0) -> Solid:
    """The bracket of an antenna: a flange on the horn of its servo, and the outer arms above it.

    The frame is that of the hinge: the antenna leaves along x, the servo turns about z.

    Args:
        layout: Sizes.
        mount: The servo.
        turn: Turn of the antenna about its own axis [rad]: its roll, and half a turn if it hangs.
    """
    hinge, height = layout.hinge, hinge_height(layout, mount, layout.antenna.roll)
    back, front = _column(layout, mount)
    fork = kernel.turned(_fork(layout, mount), turn, "x")
    flange = _flange(layout, mount, back, height)
    column = kernel.block((back, front), (layout.low, hinge.lug), (-height, 0))
    if math.cos(turn) < 0.0:
        column = kernel.mirrored(column, "y")
    whole = kernel.joined(fork, column, flange)
    return kernel.cut(whole, *_flange_holes(layout, mount, height))


def _column(layout: AntennaLayout, mount: Mount) -> tuple[float, float]:
    """Back and front of the bracket's column along x."""
    wall = layout.print.wall_mm
    front = -(layout.hinge.clear + wall)
    return min(front - layout.strip.length, -flange_radius(layout, mount) - wall), front


def posts_of_bracket(layout: AntennaLayout, mount: Mount) -> tuple[float, float]:
    """Ends of the posts of the bracket along x."""
    back, _ = _column(layout, mount)
    return back, back + layout.strip.length


def _fork(layout: AntennaLayout, mount: Mount) -> Solid:
    """Outer arms about the first hinge, a column behind them, and posts for the sensor."""
    hinge, lug, (back, front) = layout.hinge, layout.hinge.lug, _column(layout, mount)
    mirrored = [(-px, py) for px, py in sector(layout, 0, (-lug, lug), -front)]
    arms = [kernel.prism(mirrored, z) for z in _levels(hinge.gap, hinge.half)]
    arms += _arms(layout, 0.0, _levels(hinge.gap, hinge.half))
    wall = layout.print.wall_mm
    column = kernel.block((back, front), (layout.low, lug), (-hinge.half, hinge.half))
    hollow = (layout.low + wall, lug - wall)
    column = kernel.cut(column, kernel.block((back + wall, 0), hollow, (-hinge.gap, hinge.gap)))
    stop = [(-px, py) for px, py in sector(layout, 0, (layout.low, layout.high), -front)]
    stops = [kernel.prism(stop, z) for z in _levels(hinge.gap, hinge.half)]
    z = layout.leg_height(0, upper=False)
    beam = layout.print.wall_mm + hinge.leg_hole / 2.0
    rib = kernel.block((front, -hinge.clear), (layout.low, beam - hinge.leg), (z - beam, z + beam))
    lower = [(-px, py) for px, py in sector(layout, 0, (layout.low, 0.0), -front)]
    rib = kernel.common(rib, kernel.prism(lower, (-99, 99)))
    body = kernel.cut(kernel.joined(column, rib, *stops), kernel.rod(hinge.clear, (0, 0, -50), 100))
    held = posts(layout, posts_of_bracket(layout, mount), layout.low)
    whole = kernel.joined(body, *arms, *held)
    leg = layout.springs[0].leg + 0.5
    return kernel.cut(
        whole,
        kernel.rod((hinge.pin + PRESS) / 2.0, (0, 0, -50), 100),
        kernel.rod(hinge.leg_hole / 2.0, (0, -hinge.leg, z), -leg, "x"),
    )


def _flange(layout: AntennaLayout, mount: Mount, back: float, height: float) -> Solid:
    """The plate on the horn, about its screws and back to the column: it prints upright so."""
    edge = [(back, -3.5), (back, 3.5)]
    return kernel.hull(flange_circles(layout, mount), edge, (-height, FLANGE - height))


def _flange_holes(layout: AntennaLayout, mount: Mount, height: float) -> list[Solid]:
    """Holes of the screws and their heads, and the opening about the shaft."""
    screw = mount.horn.screw
    holes = []
    for x, y in screw_places(mount, layout.antenna.roll):
        holes.append(kernel.rod(screw.clearance / 2.0, (x, y, -height - 1), FLANGE + 2))
        holes.append(kernel.rod(screw.head / 2.0 + 0.2, (x, y, -height + FLANGE), 50))
    if opening := opening_radius(layout, mount):
        holes.append(kernel.rod(opening, (0, 0, -height - 1), FLANGE + 2))
    return holes
