"""The checks of an antenna: its parts at every angle of its hinges, and the fit of its springs."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator

import numpy as np

from antennate_build import kernel
from antennate_build.antenna_assembly import AntennaSolids
from antennate_build.checks import Check, Meeting, Named, Up, between, judged
from antennate_build.winding import ARBOR_SHARE

ANGLES = 9
"""Angles of a hinge that are tried, from one stop to the other."""
OnPart = Callable[[], object]


def up_of(part: str) -> Up:
    """Direction of a part's frame that points up while it is printed."""
    return "x" if part.startswith("bracket") else "y"


def meetings(antenna: AntennaSolids, tick: OnPart = lambda: None) -> list[Meeting]:
    """Overlaps at every hinge between its stops, hinges alike once.

    The next but one segment is tried with both hinges between at their stops.
    """
    seen: set[tuple[str, ...]] = set()
    found: list[Meeting] = []
    for side in antenna.sides:
        names = (side[0], *antenna.names)
        for n, pair in enumerate(itertools.pairwise(names)):
            tick()
            if pair not in seen:
                seen.add(pair)
                found += _at_hinge(antenna, side, n)
        for n, three in enumerate(zip(names, names[1:], names[2:], strict=False)):
            if three not in seen:
                seen.add(three)
                found += _curled(antenna, side, n)
    return found


Side = tuple[str, float]
"""A bracket, and how it turns the antenna about its own axis [rad]."""


def _body(antenna: AntennaSolids, side: Side, n: int) -> list[Named]:
    """A segment with its cover and the pin at its tip, in its frame; the bracket if n is 0."""
    layout, (bracket, turn) = antenna.layout, side
    pin = antenna.printed["pin"]
    if n == 0:
        return [(bracket, antenna.printed[bracket]), ("pin", kernel.turned(pin, turn, "x"))]
    name = antenna.names[n - 1]
    parts: list[Named] = [(name, antenna.printed[name])]
    if n < antenna.hinges:
        parts.append(("pin", kernel.moved(pin, (layout.length, 0.0, 0.0))))
    if n <= layout.sensed:
        half = layout.length / 2.0
        parts.append(("cover", kernel.moved(antenna.printed["cover"], (half, 0.0, 0.0))))
    return parts


def _turned(
    antenna: AntennaSolids, side: Side, n: int, angle: float, parts: list[Named]
) -> list[Named]:
    """The next body about the hinge at the tip of body n, in the frame of body n."""
    at, turn = (antenna.layout.length, 0.0) if n else (0.0, side[1])
    put = []
    for name, solid in parts:
        moved = kernel.moved(kernel.turned(solid, angle), (at, 0.0, 0.0))
        put.append((name, kernel.turned(moved, turn, "x") if turn else moved))
    return put


def _at_hinge(antenna: AntennaSolids, side: Side, n: int) -> Iterator[Meeting]:
    still, moving = _body(antenna, side, n), _body(antenna, side, n + 1)
    stop = antenna.layout.springs[n].stop
    for angle in np.linspace(-stop, stop, ANGLES):
        turned = _turned(antenna, side, n, float(angle), moving)
        yield from between(still, turned, f"at {math.degrees(angle):.0f} deg")


def _curled(antenna: AntennaSolids, side: Side, n: int) -> Iterator[Meeting]:
    near, next_one = (spring.stop for spring in antenna.layout.springs[n : n + 2])
    for sign in (-1.0, 1.0):
        far = _turned(antenna, side, n + 1, sign * next_one, _body(antenna, side, n + 2))
        far = _turned(antenna, side, n, sign * near, far)
        where = f"with two hinges at their stops, {'to the tail' if sign > 0 else 'ahead'}"
        yield from between(_body(antenna, side, n), far, where)


def spring_checks(antenna: AntennaSolids) -> list[Check]:
    """Play of the springs about the pin, in the cavity and between the arms, and their yield."""
    layout, hinge = antenna.layout, antenna.layout.hinge
    springs = layout.springs
    share = max(hinge.pin / s.narrowest for s in springs)
    around = min(hinge.clear - s.widest / 2.0 for s in springs)
    along = min(2.0 * hinge.cavity - s.longest for s in springs)
    held = springs[0].leg - math.sqrt(hinge.clear**2 - hinge.leg**2)
    early = [n + 1 for n, s in enumerate(springs) if s.yields < s.stop]
    first = min(springs, key=lambda spring: spring.yields)
    told = (
        f"the first yields at {math.degrees(first.yields):.0f} deg, its stop is at "
        f"{math.degrees(first.stop):.0f}, the others up to {math.degrees(hinge.stop):.0f}"
    )
    if early:
        told += f"; a stop does not save spring {', '.join(map(str, early))}"
    return [
        Check(
            "arbor",
            f"pin of {hinge.pin:.1f} mm, {100 * share:.0f} % of the narrowest inner diameter",
            share <= ARBOR_SHARE + 1e-9,
        ),
        Check(
            "spring in its seat",
            f"{around:.2f} mm around and {along:.2f} mm along it at the stops, legs held over "
            f"{held:.1f} mm",
            min(around, along, held) > 0.0,
        ),
        Check("stops before springs yield", told, math.degrees(first.yields) >= 30.0),
    ]


def assembly_check(antenna: AntennaSolids, tick: OnPart = lambda: None) -> Check:
    """No two parts of the antenna meet between the stops."""
    return judged("parts of the antenna, stop to stop", meetings(antenna, tick))
