"""The bill of materials of what is built: what to ask for, mass, count, and a column for costs.

Servos, electronics and supply are those of `antennate.robots.parts`; printed parts and springs take
the place of its plain rows.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass

from antennate.params.spring import SpringParams
from antennate.robots.parts import bought
from antennate.robots.spec import RobotSpec
from antennate.studies.formats import to_csv
from antennate_build import flange
from antennate_build.antenna_assembly import AntennaSolids
from antennate_build.layout import STRIPS, AntennaLayout
from antennate_build.link_parts import HEAD_BOLTS
from antennate_build.robot_assembly import RobotSolids
from antennate_build.winding import Spring, set_of

WIRE_NAMES = {
    "stainless_302": "spring wire 1.4310 (AISI 302), EN 10270-3",
    "music_wire": "spring wire SH or DH (music wire), EN 10270-1",
    "hard_drawn": "spring wire SL or SM (hard drawn), EN 10270-1",
    "phosphor_bronze": "spring wire CuSn6 (phosphor bronze), EN 12166",
}
"""What to ask for."""


@dataclass(frozen=True)
class Item:
    """One row.

    Attributes:
        count: How many.
        item: What.
        use: Where it goes.
        ask_for: What to ask for, or how to print it.
        mass_g: Mass of one [g]; None where it is not known.
        cost: Left empty, for whoever buys.
    """

    count: int
    item: str
    use: str
    ask_for: str
    mass_g: float | None = None
    cost: str = ""


def spring_items(layout: AntennaLayout, params: SpringParams, antennae: int) -> list[Item]:
    """Springs of some antennae, and the wire to wind them oneself."""
    items, length = [], 0.0
    for spring, count in set_of(layout.springs).items():
        items.append(
            Item(
                antennae * count,
                f"torsion spring of {spring.turns:g} turns",
                "antenna hinges",
                spring_words(spring, params),
                round(spring.mass, 3),
            )
        )
        length += antennae * count * spring.wire_length
    wire, inner = layout.springs[0].wire, layout.springs[0].inner
    tail = 60.0 * antennae * len(layout.springs)  # what is held while it is wound
    metres = math.ceil((length + tail) / 100.0) / 10.0
    return [
        *items,
        Item(
            1,
            "or the wire for them",
            "antenna hinges",
            f"{WIRE_NAMES[params.wire]}, {wire:.2f} mm, {metres:g} m; a mandrel somewhat below "
            f"{inner:.1f} mm, so that coils measure {inner:.1f} mm inside after they spring back",
        ),
    ]


def spring_words(spring: Spring, params: SpringParams) -> str:
    """What to ask a spring maker for."""
    return (
        f"{WIRE_NAMES[params.wire]}; wire {spring.wire:.2f} mm, inside {spring.inner:.1f} mm, "
        f"{spring.turns:g} turns close wound, right hand, straight legs of {spring.leg:.1f} mm at "
        "180 deg, tangential"
    )


def printed_items(
    counts: Mapping[str, int], grams: Mapping[str, float], material: str
) -> list[Item]:
    """Printed parts."""
    return [
        Item(
            count,
            name,
            "printed",
            f"stl/{name}.stl, {'TPU' if name == 'tread' else material.upper()}, layers of 0.15 mm, "
            "solid",
            round(grams[name], 3),
        )
        for name, count in counts.items()
    ]


def bought_items(robot: RobotSpec) -> list[Item]:
    """Servos, electronics and supply of a robot."""
    return [Item(part.count, part.item, part.use, part.rating) for part in bought(robot)]


def as_csv(items: list[Item]) -> str:
    """The bill as a file."""
    rows = [
        {**asdict(item), "mass_g": "" if item.mass_g is None else item.mass_g} for item in items
    ]
    return to_csv(rows)


def antenna_items(antenna: AntennaSolids, antennae: int) -> list[Item]:
    """What else some antennae take: screws of their brackets, and the sensor of one alone."""
    layout, mount = antenna.layout, antenna.mount
    kind = layout.antenna.sensor.kind
    width, thickness, length = STRIPS[kind]
    what = "flex sensor" if kind == "flex" else "pressure strip"
    known = "Spectra Symbol FS-L-0095-103" if kind == "flex" else "ZD10-100"
    screws = len(flange.screw_places(mount, layout.antenna.roll))
    screw = f"{mount.horn.screw.name} x {flange.SCREW_LENGTH:g}"
    size = f"{known}, {width:g} x {thickness:g} x {length:g} mm"
    alone = [Item(1, what, "along the antenna", size)] if antennae == 1 else []
    return [*alone, Item(antennae * screws, screw, "bracket to horn", "pan head")]


def link_items(robot: RobotSolids) -> list[Item]:
    """Screws of the links, bolts of the hinges."""
    layout, links = robot.layout, robot.layout.robot.links
    joints, yaw, leg = links - 1, layout.yaw, layout.leg
    hinged = [yaw, *([layout.pitch] if layout.pitch is not None else [])]
    horns = joints * sum(2 * mount.horn.holes for mount in hinged) + 2 * links * leg.horn.holes
    cases = joints * sum(len(mount.sides) for mount in hinged) + joints * len(yaw.sides)
    cases += 2 * links * len(leg.back)
    items = [
        Item(
            horns, f"{leg.horn.screw.name} x 6", "hinges and legs to horns and idlers", "pan head"
        ),
        Item(cases, f"{leg.screw.name} x 6", "servos to frames; x 8 through the cabin", "pan head"),
        Item(4 * joints, "bolt M3 x 10 with nut", "hinges", "ISO 4762, ISO 4032"),
    ]
    if robot.base is not None:
        items += [
            Item(len(HEAD_BOLTS), "bolt M3 x 10 with nut", "head plate", "ISO 4762, ISO 4032"),
            Item(
                2 * len(robot.base.back),
                f"{robot.base.screw.name} x 6",
                "base servos to the head plate",
                "pan head",
            ),
        ]
    return items
