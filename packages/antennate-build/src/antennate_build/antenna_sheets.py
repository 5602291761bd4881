"""The sheets of an antenna: its views with all sizes, its bracket, and how it is put together."""

from __future__ import annotations

import math

import numpy as np
from matplotlib.figure import Figure

from antennate import figures as style
from antennate.robots.antenna import N_MM_PER_DEG
from antennate_build import antenna_parts, flange, kernel, sheet
from antennate_build.antenna_assembly import AntennaSolids
from antennate_build.layout import STRIPS
from antennate_build.sheet import View
from antennate_build.winding import Spring, set_of

TOP = ((0.0, 0.0, 1.0), (0.0, 1.0, 0.0))
"""Eye and upward direction of a view along the pins, towards the servo."""
SIDE = ((0.0, -1.0, 0.0), (0.0, 0.0, 1.0))
END = ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0))
OBLIQUE = ((-0.45, -0.75, 0.5), (0.0, 0.0, 1.0))
PALE = {"printed": "#F6E3C5", "spring": "#C9D3DC", "pin": "#CFE0F2", "cover": "#CFE8D2"}
"""Colours of parts in pictures."""
WIRE = "#5B6B78"
"""Colour of springs that are drawn without edges."""


def spring_rows(springs: tuple[Spring, ...]) -> list[list[str]]:
    """Head and rows of the table of springs."""
    head = [
        "hinges",
        "turns",
        "wire",
        "inside",
        "body",
        "leg",
        "N·mm/deg",
        "wanted",
        "error",
        "yields",
    ]
    rows = [head]
    for spring in set_of(springs):
        where = [n + 1 for n, each in enumerate(springs) if each.turns == spring.turns]
        rows.append(
            [
                ", ".join(map(str, where)),
                f"{spring.turns:g}",
                f"{spring.wire:.2f}",
                f"{spring.inner:.1f}",
                f"{spring.body:.1f}",
                f"{spring.leg:.1f}",
                f"{spring.stiffness / N_MM_PER_DEG:.4f}",
                f"{spring.wanted / N_MM_PER_DEG:.4f}",
                f"{100 * spring.error:+.1f} %",
                f"{math.degrees(spring.yields):.0f}°",
            ]
        )
    return rows


@style.styled
def antenna_sheet(antenna: AntennaSolids) -> Figure:
    """Side and top view of the antenna, a segment with its sizes, and its springs in a table."""
    layout = antenna.layout
    wide = layout.length * antenna.hinges + 25.0
    scale = min(2.0, 330.0 / wide)
    notes = (
        f"antenna {scale:.3g} : 1, segment {_scale(layout.length):.3g} : 1",
        f"{layout.print.material.upper()}, walls {layout.print.wall_mm:g}, "
        f"play {layout.print.play_mm:g}",
        "springs right-hand wound, legs in line",
    )
    figure, axes = sheet.new(sheet.A3, "Antenna", notes)
    whole = kernel.together([p.solid for p in antenna.placed(springs=False)])
    left = 22.0 + 15.0 * scale
    for at, (eye, up), words in (
        (248.0, TOP, "from above: along the pins"),
        (200.0, SIDE, "from the side of the legs"),
    ):
        view = View(axes, (left, at), scale, eye, up)
        view.draw(whole)
        if (eye, up) == SIDE:
            _springs_in_sight(antenna, view)
        sheet.text(axes, (14.0, at + 33.0 - 14.0 * (at < 220)), words, weight="bold")
    _whole_sizes(
        antenna, View(axes, (left, 248.0), scale, *TOP), View(axes, (left, 200.0), scale, *SIDE)
    )
    _segment_views(antenna, axes)
    sheet.table(
        axes,
        (14.0, 62.0),
        "Springs",
        spring_rows(layout.springs),
        (34, 12, 14, 15, 13, 12, 22, 18, 18, 15),
    )
    _section_table(antenna, axes)
    return figure


def _springs_in_sight(antenna: AntennaSolids, view: View) -> None:
    """Draw the springs between the arms, whose legs end in the segments."""
    for n, body in enumerate(antenna.layout.springs):
        path = sheet.helix(body.coil / 2, body.wire, body.turns, antenna.layout.hinge.clear)
        place = np.array([n * antenna.layout.length, 0.0, 0.0])
        view.wire(path + place, body.wire, PALE["spring"])


def _scale(length: float) -> float:
    return min(4.0, 90.0 / length)


def _whole_sizes(antenna: AntennaSolids, above: View, side: View) -> None:
    layout, hinge = antenna.layout, antenna.layout.hinge
    end = layout.length * antenna.hinges
    high = layout.strip.top
    above.length((0, high, 0), (end, high, 0), (0, 14), f"{end:.1f}")
    above.length((0, high, 0), (layout.length, high, 0), (0, 7), f"{layout.length:.1f}")
    above.length((end, layout.low, 0), (end, high, 0), (9, 0), f"{high - layout.low:.1f}")
    low = -flange.hinge_height(layout, antenna.mount, layout.antenna.roll)
    side.length((end, 0, -hinge.half), (end, 0, hinge.half), (9, 0), f"{2 * hinge.half:.1f}")
    back = -flange.flange_radius(layout, antenna.mount) - 4.0
    side.length((back, 0, low), (back, 0, 0), (-6, 0), f"{-low:.2f}")


def _segment_views(antenna: AntennaSolids, axes: sheet.Axes) -> None:
    layout, hinge, strip = antenna.layout, antenna.layout.hinge, antenna.layout.strip
    scale = _scale(layout.length)
    first = antenna.printed[antenna.names[0]]
    x, y = 40.0, 122.0
    above = View(axes, (x, y), scale, *TOP)
    above.draw(first, hidden=True)
    sheet.text(axes, (14.0, y + 42.0), "segment 1 from above", weight="bold")
    length = layout.length
    above.length((0, layout.low, 0), (length, layout.low, 0), (0, -9), f"{length:.2f}")
    above.radius((0, 0, 0), hinge.lug, 140, f"R {hinge.lug:.2f}", 8)
    above.radius(
        (0, 0, 0),
        hinge.pin / 2 + layout.print.play_mm / 2,
        215,
        f"Ø {hinge.pin + layout.print.play_mm:.2f}",
        12,
    )
    above.radius(
        (length, 0, 0), hinge.pin / 2 + 0.025, 40, f"Ø {hinge.pin + antenna_parts.PRESS:.2f}", 14
    )
    second = min(1, layout.antenna.hinges - 1)
    stop = math.degrees(layout.springs[second].stop)
    face = length - layout.high * layout.slope(second)
    above.note((face, layout.high, 0), (8, 12), f"stop face {90 - stop / 2:.1f}° to the axis")
    above.length(
        (length / 2, layout.low, 0),
        (length / 2, strip.top, 0),
        (0.32 * length * scale, 0),
        f"{strip.top - layout.low:.2f}",
    )
    above.note(
        (hinge.clear + 1.5, -hinge.leg, 0),
        (10, -26),
        f"leg hole Ø {hinge.leg_hole:.1f} at {hinge.leg:.2f} from the axis",
    )
    mid = x + scale * (length + 24.0)
    side = View(axes, (mid, y), scale, *SIDE)
    side.draw(first, hidden=True)
    sheet.text(axes, (mid - 22.0, y + 42.0), "from the side of the legs", weight="bold")
    for half, at in ((hinge.cavity, 20.0), (hinge.inner, 27.0)):
        side.length((-hinge.lug, 0, -half), (-hinge.lug, 0, half), (8.0 - at, 0), f"{2 * half:.2f}")
    for half, at in ((hinge.gap, 7.0), (hinge.half, 14.0)):
        place = length + hinge.lug
        side.length((place, 0, -half), (place, 0, half), (at, 0), f"{2 * half:.2f}")
    end = View(axes, (mid + scale * (length + 18.0), y), scale, (-1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    end.draw(first)
    sheet.text(axes, (end.at[0] - 24.0, y + 42.0), "from the base", weight="bold")
    width = STRIPS[layout.antenna.sensor.kind][0]
    end.length(
        (0, strip.top, -strip.half), (0, strip.top, strip.half), (0, 6), f"{2 * strip.half:.2f}"
    )
    wide = strip.half + strip.lip
    end.note((0, strip.roof + 0.3, -wide), (-5, 16), f"cover groove {2 * wide:.2f} wide")
    end.length((0, 0, hinge.half), (0, strip.floor, hinge.half), (-7, 0), f"{strip.floor:.2f}")
    sheet.text(axes, (end.at[0] - 24.0, y - 30.0), f"sensor {width:g} wide lies on the arms")


def _section_table(antenna: AntennaSolids, axes: sheet.Axes) -> None:
    layout, hinge = antenna.layout, antenna.layout.hinge
    narrow = min(s.narrowest for s in layout.springs)
    wide = max(s.widest for s in layout.springs)
    long = max(s.longest for s in layout.springs)
    stops = sorted({min(s.stop for s in layout.springs), hinge.stop})
    rows = [
        ["fit", "mm"],
        ["pin, arbor of the springs", f"Ø {hinge.pin:.1f}"],
        ["narrowest spring at the stop", f"Ø {narrow:.2f}"],
        ["widest spring at the stop", f"Ø {wide:.2f}"],
        ["room about the pin", f"Ø {2 * hinge.clear:.2f}"],
        ["longest spring at the stop", f"{long:.2f}"],
        ["room between the inner arms", f"{2 * hinge.cavity:.2f}"],
        ["stops, each way", " to ".join(f"{math.degrees(stop):.0f}°" for stop in stops)],
    ]
    sheet.table(axes, (210.0, 62.0), "Fits", rows, (56, 22))


@style.styled
def bracket_sheet(antenna: AntennaSolids) -> Figure:
    """The bracket on the horn of its servo, in three views with its sizes."""
    layout, hinge, mount = antenna.layout, antenna.layout.hinge, antenna.mount
    name, _ = antenna.standing
    part = antenna.printed[name]
    tall = kernel.bounds(part)[1][2] - kernel.bounds(part)[0][2]
    scale = min(3.0, 48.0 / tall)
    horn, screw = mount.horn, mount.horn.screw
    length = flange.SCREW_LENGTH
    screws = flange.screw_places(mount, layout.antenna.roll)
    notes = (
        f"{scale:.2g} : 1; {layout.print.material.upper()}; upright on its back",
        f"{len(screws)} {screw.name} x {length:g} into the horn",
        f"horn: {mount.source.partition(';')[0]}",
    )
    title = "Bracket" if name == "bracket" else "Bracket, right"
    figure, axes = sheet.new(sheet.A4, title, notes)
    height = flange.hinge_height(layout, mount, layout.antenna.roll)
    above = View(axes, (80.0, 152.0), scale, *TOP)
    above.draw(part, hidden=True)
    side = View(axes, (80.0, 84.0), scale, *SIDE)
    side.draw(part, hidden=True)
    end = View(axes, (180.0, 84.0), scale, *END)
    end.draw(part, hidden=True)
    named = {(14.0, 196.0): "from above", (14.0, 106.0): "from the right"}
    for at, words in (named | {(138.0, 106.0): "from the front"}).items():
        sheet.text(axes, at, words, weight="bold")
    oblique = View(axes, (215.0, 158.0), 0.8 * scale, (0.6, -0.65, 0.45), (0.0, 0.0, 1.0))
    oblique.draw(part, colour=PALE["printed"])
    circles, opening = flange.flange_circles(layout, mount), flange.opening_radius(layout, mount)
    radius, half = (max(circle[n] + circle[2] for circle in circles) for n in (0, 1))
    (back, _), (front, _) = kernel.bounds(part)[0][:2], (radius, 0)
    above.length((back, radius, 0), (front, radius, 0), (0, 8), f"{front - back:.2f}")
    x, y, boss = circles[-1]
    above.radius((x, y, 0), boss, 35, f"R {boss:.2f}")
    if opening:
        above.radius((0, 0, 0), opening, -35, f"Ø {2 * opening:.2f}", 22)
    for n, (x, y) in enumerate(screws[:1]):
        above.radius(
            (x, y, 0),
            screw.clearance / 2,
            -60 - n,
            f"{len(screws)} x Ø {screw.clearance:g} on Ø {horn.circle:g}",
            16,
        )
    above.radius(
        (0, 0, 0), hinge.pin / 2 + 0.025, 60, f"Ø {hinge.pin + antenna_parts.PRESS:.2f}", 22
    )
    side.length((radius, 0, -height), (radius, 0, 0), (8, 0), f"{height:.2f}")
    side.length(
        (radius, 0, -height),
        (radius, 0, -height + flange.FLANGE),
        (18, 0),
        f"{flange.FLANGE:g}",
    )
    side.length(
        (back, 0, -height),
        (back, 0, kernel.bounds(part)[1][2]),
        (-8, 0),
        f"{kernel.bounds(part)[1][2] + height:.2f}",
    )
    end.length(
        (0, layout.low, kernel.bounds(part)[1][2]),
        (0, layout.strip.top, kernel.bounds(part)[1][2]),
        (0, 7),
        f"{layout.strip.top - layout.low:.2f}",
    )
    end.length((0, -half, -height), (0, half, -height), (0, -7), f"{2 * half:.2f}")
    return figure


@style.styled
def exploded_sheet(antenna: AntennaSolids, steps: tuple[str, ...]) -> Figure:
    """The first hinges taken apart, with letters, and the steps of the assembly."""
    layout = antenna.layout
    gap, shown = 2.0 * layout.springs[0].leg + 10.0, min(2, antenna.hinges)
    notes = ("not to scale", f"{shown} of {antenna.hinges} segments shown")
    figure, axes = sheet.new(sheet.A3, "Antenna: assembly", notes)
    first = flange.flange_radius(layout, antenna.mount) + gap
    scale = 330.0 / (first + shown * (layout.length + gap))
    view = View(axes, (75.0, 140.0), scale, *OBLIQUE)
    named: dict[str, tuple[float, float]] = {}
    for placed in antenna.placed():
        n = _hinge_of(placed.name)
        if n > shown:
            continue
        own = first + (n - 1) * (layout.length + gap) if n else 0.0
        x = own - gap / 2.0 if placed.kind in ("spring", "pin") else own
        if placed.kind == "spring":
            body = layout.springs[n - 1]
            path = sheet.helix(body.coil / 2, body.wire, body.turns, body.leg)
            view.wire(path + np.array([x, 0.0, 0.0]), body.wire, PALE["spring"])
            named.setdefault("spring", view.place((x + body.leg, -body.coil / 2, body.body / 2)))
            continue
        away = {"pin": (0.0, 18.0), "cover": (16.0, 4.0)}.get(placed.kind, (0.0, 0.0))
        by = (x - layout.length * max(n - 1, 0), *away)
        solid = kernel.moved(placed.solid, by)
        view.draw(solid, colour=PALE.get(placed.kind, PALE["printed"]))
        middle = np.mean(kernel.bounds(solid), axis=0)
        named.setdefault(placed.kind, view.place(tuple(middle)))
    for n, (kind, place) in enumerate(named.items()):
        end = (place[0] + 8.0, place[1] + (-34.0 if kind == "spring" else 38.0))
        letter = "ABCDE"[n]
        sheet.balloon(axes, place, end, letter)
        sheet.text(axes, (360.0, 120.0 - 5.4 * n), f"{letter}   {kind}")
    for n, step in enumerate(steps):
        sheet.text(axes, (14.0, 15.0 + 5.4 * (len(steps) - 1 - n)), f"{n + 1}.  {step}")
    return figure


def _hinge_of(name: str) -> int:
    """Number of the hinge that a placed part belongs to; 0 for those of the bracket."""
    kind, _, number = name.rpartition("_")
    if kind in ("", "bracket") or name.startswith("bracket"):
        return 0
    return int(number) - (kind == "cover")


def shaded(antenna: AntennaSolids, angles: tuple[float, ...]) -> Figure:
    """The antenna as one sees it, bent a little."""
    parts = antenna.placed(angles)
    view, figure = sheet.picture(7.0, 3.0, OBLIQUE)
    plain = [(p.solid, PALE.get(p.kind, PALE["printed"])) for p in parts if p.kind != "spring"]
    wires = [(p.solid, WIRE) for p in parts if p.kind == "spring"]
    view.scene(plain, 1.2, wires)
    return figure
