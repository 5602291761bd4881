"""The bill of materials of what is built: what to ask for, mass, count, and a column for costs.

Servos, electronics and supply are those of `antennate.robots.parts`; printed parts and springs take
the place of its plain rows.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass

from antennate.params.spring import SpringParams
from antennate.robots.parts import bought, servo_item, source_item, supply
from antennate.robots.servos import ServoName
from antennate.robots.spec import RobotSpec
from antennate.studies.formats import to_csv
from antennate_build.fasteners import Fastener
from antennate_build.layout import STRIPS, AntennaLayout
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
                spring.item,
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


def servo_of(robot: RobotSpec, part: str) -> ServoName:
    """Kind of a servo of the assembly, which is named as `servo leg_left`."""
    kinds: dict[str, ServoName] = {
        "leg": robot.legs.servo,
        "yaw": robot.yaw.servo,
        "pitch": robot.pitch.servo,
        "antenna": robot.antennae.servo,
    }
    return kinds[part.removeprefix("servo ").partition("_")[0]]


def item_of(robot: RobotSpec, part: str) -> str:
    """Item of the bill that a part of the assembly is."""
    if part == "battery":
        return source_item(supply(robot))
    if part.startswith("servo "):
        return servo_item(robot.servos.of(servo_of(robot, part)).servo)
    return part


def bought_items(robot: RobotSpec) -> list[Item]:
    """Servos, electronics and supply of a robot."""
    return [Item(part.count, part.item, part.use, part.rating) for part in bought(robot)]


def as_csv(items: list[Item]) -> str:
    """The bill as a file."""
    rows = [
        {**asdict(item), "mass_g": "" if item.mass_g is None else item.mass_g} for item in items
    ]
    return to_csv(rows)


def sensor_items(layout: AntennaLayout) -> list[Item]:
    """The flex sensor of an antenna that is built alone."""
    kind = layout.antenna.sensor.kind
    width, thickness, length = STRIPS[kind]
    what = "flex sensor" if kind == "flex" else "pressure strip"
    known = "Spectra Symbol FS-L-0095-103" if kind == "flex" else "ZD10-100"
    size = f"{known}, {width:g} x {thickness:g} x {length:g} mm"
    return [Item(1, what, "along the antenna", size)]


def fastener_items(found: list[Fastener]) -> list[Item]:
    """Screws and bolts."""
    asked = {0.0: "ISO 4762, ISO 4032"}
    return [
        Item(
            each.count, each.name, each.use, asked.get(each.depth, "pan head"), round(each.mass, 3)
        )
        for each in found
    ]
