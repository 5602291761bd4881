"""The sizes of an antenna's parts, all that follow from its description. Lengths are in mm.

A segment runs along x from its own hinge at 0 to the next at `length`; hinges turn about z, and the
flex sensor lies on the side of +y, the legs of the springs on that of -y. A hinge, seen from the
side, has a pin as arbor of the spring between two pairs of arms: the outer pair belongs to the
segment towards the base, the inner pair to the one towards the tip.

Seen along the pin, each segment keeps to its own sector of the hinge: the one towards the tip to
the polar angles up to 90° - stop / 2, the other to those from 90° + stop / 2 on. So they meet with
their flat faces exactly at the stop, and what is in one sector never meets the other before.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from antennate.errors import ConfigError
from antennate.robots.antenna import AntennaSpec
from antennate_build.printing import PrintParams
from antennate_build.winding import ARBOR_SHARE, LEG_ROOM, Spring

STRIPS = {"flex": (6.35, 0.43, 112.2), "fsr": (10.2, 0.30, 120.0)}
"""Width, thickness and whole length of the sensor [mm]: Spectra Symbol FS-L-0095-103 and
ZD10-100, a pressure strip (assumed: not looked up; measure yours before you print)."""
_FACE, _LEAST_FACE = 0.7, 0.5
"""Shortest stop face, seen along the pin, and that of the nearest stops towards the bed [mm]
(assumed: nearly two lines, and more than one)."""
FOOT = 0.7
"""Half the width of the foot on which an arm stands while it is printed [mm]."""
_LIP = 0.6
"""How far the lips of the posts reach over a cover [mm]: printed in the air, a line and a half."""
_HOLE_PLAY = 0.1
"""Hole of a leg over its wire [mm]: a drill of that size clears it."""
_LEAST_HOLD = 2.0
"""Length that a leg lies in its hole at least [mm] (assumed: four wires of the default)."""
_LONGEST_POST = 4.5
"""Longest post and cover along x [mm] (assumed: the strip lies flat under it)."""


@dataclass(frozen=True)
class HingeSizes:
    """What the hinges of an antenna have in common [mm].

    Attributes:
        pin: Diameter of the pin, the arbor of the springs.
        lug: Radius of the arms about the pin.
        clear: Radius about the pin within which nothing but arms, pin and spring is.
        foot: How far the feet of the arms reach from the pin towards -y.
        cavity: Half the height between the inner arms.
        inner: Half the height to the outside of the inner arms.
        gap: Half the height to the inside of the outer arms.
        half: Half the height of a segment.
        stop: Largest angle of any of them [rad].
        leg: Offset of the legs from the pin, towards -y.
        leg_hole: Diameter of the holes of legs.
    """

    pin: float
    lug: float
    clear: float
    foot: float
    cavity: float
    inner: float
    gap: float
    half: float
    stop: float
    leg: float
    leg_hole: float

    @property
    def slope(self) -> float:
        """How far the flattest stop face goes along x for each mm along y."""
        return math.tan(self.stop / 2.0)


@dataclass(frozen=True)
class StripSizes:
    """The flex sensor's channel and its cover [mm].

    Attributes:
        half: Half its width, with play.
        floor: Place of its lower side along y.
        roof: Place of the lower side of the cover.
        top: Place of the upper side of the posts.
        length: Length of the covers along x.
        lip: How far the lips of the posts reach over a cover, each side.
    """

    half: float
    floor: float
    roof: float
    top: float
    length: float
    lip: float


@dataclass(frozen=True)
class AntennaLayout:
    """Sizes of one antenna.

    Attributes:
        antenna: What it is made from.
        print: How it is printed.
        springs: Its springs, base to tip.
        hinge: Sizes of its hinges.
        strip: Sizes of the sensor's channel.
        length: Distance of its hinges [mm].
        low: Lower side of the segments along y, negative [mm].
        high: Upper side of their side plates [mm].
        sensed: Segments under the sensor, from the base.
    """

    antenna: AntennaSpec
    print: PrintParams
    springs: tuple[Spring, ...]
    hinge: HingeSizes
    strip: StripSizes
    length: float
    low: float
    high: float
    sensed: int

    def slope(self, hinge: int) -> float:
        """How far the stop faces of a hinge go along x for each mm along y."""
        return math.tan(self.springs[hinge].stop / 2.0)

    def leg_height(self, spring: int, upper: bool) -> float:
        """Place of a leg of a spring along z [mm]."""
        body = self.springs[spring]
        return (1.0 if upper else -1.0) * body.turns * body.wire / 2.0


def segment_names(layout: AntennaLayout) -> tuple[str, ...]:
    """Part of each segment, base to tip: segments alike have one name, after the first of them."""
    names: dict[tuple[object, ...], str] = {}
    found = []
    for n in range(layout.antenna.hinges):
        springs = layout.springs[n : n + 2]
        key = (*(s.turns for s in springs), len(springs), n < layout.sensed)
        found.append(names.setdefault(key, f"segment_{n + 1}"))
    return tuple(found)


def layout_of(
    antenna: AntennaSpec, springs: tuple[Spring, ...], params: PrintParams
) -> AntennaLayout:
    """Sizes of the parts of an antenna.

    Args:
        antenna: The antenna.
        springs: Its springs.
        params: How it is printed.

    Raises:
        ConfigError: Its hinges do not fit: links too short, or stops too far apart.
    """
    hinge, length = _hinge_sizes(springs, params), 1e3 * antenna.link_length
    wall, play = params.wall_mm, params.play_mm
    width, thickness, _ = STRIPS[antenna.sensor.kind]
    floor = hinge.lug + play
    roof = floor + thickness + play
    top = roof + 2.0 * wall + play
    strip = StripSizes(
        half=width / 2.0 + play,
        floor=floor,
        roof=roof,
        top=top,
        length=min(_LONGEST_POST, 0.3 * length, length - 2.0 * (top * hinge.slope + play)),
        lip=_LIP,
    )
    least = max(hinge.half, strip.half + strip.lip + wall)
    hinge = _heightened(hinge, least)
    far, near = (math.cos(turn / 2.0) for turn in (hinge.stop, min(s.stop for s in springs)))
    low = max(hinge.foot, (hinge.clear + _FACE) * far, (hinge.clear + _LEAST_FACE) * near)
    high = max((hinge.clear + _FACE) * near, hinge.lug)
    layout = AntennaLayout(
        antenna, params, springs, hinge, strip, length, -low, high, antenna.sensed_hinges
    )
    _require_room(layout)
    return layout


def _hinge_sizes(springs: tuple[Spring, ...], params: PrintParams) -> HingeSizes:
    wall, play, stop = params.wall_mm, params.play_mm, max(s.stop for s in springs)
    narrowest = min(replace(s, stop=stop).narrowest for s in springs)  # hands bend one farther
    pin = math.floor(10.0 * ARBOR_SHARE * narrowest) / 10.0
    lug = pin / 2.0 + play + wall
    leg = springs[0].coil / 2.0
    hidden = (leg + springs[0].wire / 2.0 + play) / math.cos(stop / 2.0)
    widest = max(s.widest for s in springs) / 2.0
    hole = springs[0].wire + _HOLE_PLAY
    foot = max(leg + hole / 2.0 + wall, lug)
    cavity = max(s.longest for s in springs) / 2.0 + play
    return HingeSizes(
        pin=pin,
        lug=lug,
        clear=max(math.hypot(foot, FOOT) + 1.5 * play, widest + 2.0 * play, hidden),
        foot=foot,
        cavity=cavity,
        inner=cavity + wall,
        gap=cavity + wall + play,
        half=cavity + 2.0 * wall + play,
        stop=stop,
        leg=leg,
        leg_hole=hole,
    )


def _heightened(hinge: HingeSizes, half: float) -> HingeSizes:
    """The same hinge between arms so far apart that a segment has this half height."""
    more = half - hinge.half
    return HingeSizes(
        **{
            name: getattr(hinge, name) + more * (name in ("cavity", "inner", "gap", "half"))
            for name in HingeSizes.__dataclass_fields__
        }
    )


def _require_room(layout: AntennaLayout) -> None:
    """Refuse links that are too short for their hinges."""
    hinge, strip, length = layout.hinge, layout.strip, layout.length
    exposed = math.sqrt(hinge.clear**2 - hinge.leg**2)
    ends = 2.0 * max(exposed + _LEAST_HOLD + LEG_ROOM, -layout.low * hinge.slope + _FACE)
    top = 2.0 * (strip.top * hinge.slope + layout.print.play_mm) + layout.print.wall_mm
    least = max(ends, top if layout.sensed else 0.0)
    if length < least:
        raise ConfigError(
            f"antenna.length: expected at least {least * layout.antenna.hinges / 1e3:.3g} m for "
            f"{layout.antenna.hinges} hinges with springs of {layout.springs[0].coil:.2f} mm and "
            f"stops at {math.degrees(hinge.stop):.0f} deg, {least:.1f} mm a link, found "
            f"{layout.antenna.length:g} m"
        )
