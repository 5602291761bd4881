"""What a robot carries beside printed parts and servos: battery, boards, cables, screws.

The USB adapter and the emergency stop are not among it: they stay with whoever drives the robot.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from antennate.robots.parts import supply
from antennate_build import kernel
from antennate_build.fasteners import Fastener
from antennate_build.kernel import Solid
from antennate_build.link_layout import CABIN, PLATE, LinkLayout
from antennate_build.link_parts import battery

BATTERY_GRAMS = 81.0
"""Of three cells for each Ah [g]: packs of 1.5 Ah weigh 106 to 136 g, as a buyer weighed them
(excelmadeeasy.com, quadcopter drone battery)."""
GRAMS = {"board": 10.0, "converter": 15.0, "cable": 3.0, "feed": 3.0, "fuse": 10.0}
"""Of an ESP32 board with its pins, a step-down converter, a cable of the bus with both plugs, a
feed, and the fuse with its holder [g] (assumed; weigh yours)."""
MAIN_LINE = 0.026
"""Of two wires of 1 mm² with their insulation [g/mm] (copper 8.96 g/cm³, half as much around)."""
SOURCES = (
    "mass, leg_mass, bodies: printed parts solid, by density; servos by ROBOTIS' e-manual;",
    f"  battery {BATTERY_GRAMS:g} g/Ah, as a buyer weighed packs; screws as cylinders; assumed:",
    f"  ESP32 board {GRAMS['board']:g} g, converter {GRAMS['converter']:g} g, cable with plugs "
    f"{GRAMS['cable']:g} g, feed {GRAMS['feed']:g} g,",
    f"  fuse {GRAMS['fuse']:g} g, main line {1e3 * MAIN_LINE:g} g/m;",
    "  without adapter and emergency stop;",
    "antenna.link_mass, base_mass: printed parts, springs and flex sensor, mean of the links;",
    "antenna.ranges: printed stops, before springs yield; antennae.limit: up to it no parts meet;",
    "meshes: printed parts and outlines of servos and battery, drawn in place of plain shapes.",
)
"""Where the numbers of a robot as it is built come from."""


@dataclass(frozen=True)
class Load:
    """Something that a link carries.

    Attributes:
        name: What.
        grams: Its mass [g].
        solid: The room that it takes, in the frame of the link [mm].
    """

    name: str
    grams: float
    solid: Solid


def loads(layout: LinkLayout, screws: Iterable[Fastener], link: int) -> list[Load]:
    """What a link carries; cables and screws are spread evenly over all."""
    robot = layout.robot
    links, power = robot.links, supply(robot)
    grams = GRAMS["cable"] * (len(robot.ids) + 1) + GRAMS["feed"] * power.feeds
    grams += MAIN_LINE * links * layout.pitch_length
    low = layout.floor + PLATE
    along = kernel.block((-50, 50), (-40, 40), (low, low + 8))
    about = kernel.block((-50, 50), (-layout.wall, layout.wall), (-10, 10))
    found = [
        Load("cables", grams / links, along),
        Load("screws", sum(each.count * each.mass for each in screws) / links, about),
    ]
    if link == 0 and robot.antenna_count:
        long, wide, _ = CABIN
        x, z = (layout.tray, layout.tray + long), (layout.deck + 2.0, layout.deck + 12.0)
        found += [
            Load("ESP32 board", GRAMS["board"], kernel.block(x, (2, wide / 2), z)),
            Load("step-down converter", GRAMS["converter"], kernel.block(x, (-wide / 2, -2), z)),
        ]
    if link == links - 1:
        found += [
            Load("battery", BATTERY_GRAMS * power.least_capacity, battery(layout)),
            Load("fuse", GRAMS["fuse"], kernel.block((-30, 0), (38, 44), (low, 10))),
        ]
    return found
