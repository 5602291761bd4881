"""Mass and inertia of links and legs as they are built, for the robot's file.

A link carries servos, battery, boards, cables and screws beside its printed parts. The USB adapter
and the emergency stop stay with whoever drives the robot.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from antennate.robots.parts import supply
from antennate_build import kernel
from antennate_build.billing import servo_of
from antennate_build.fasteners import Fastener
from antennate_build.kernel import Solid
from antennate_build.link_layout import CABIN, PLATE
from antennate_build.mounts import GRAMS
from antennate_build.robot_assembly import RobotSolids

STRIP_DENSITY = 1.38e-3
"""Of the flex sensor [g/mm³]: polyester film."""
BATTERY = 81.0
"""Three cells for each Ah [g]: packs of 1.5 Ah weigh 106 to 136 g, as a buyer weighed them
(excelmadeeasy.com, quadcopter drone battery)."""
BOARD, CONVERTER, CABLE, FEED, FUSE = 10.0, 15.0, 3.0, 3.0, 10.0
"""An ESP32 board with its pins, a step-down converter, a cable of the bus with both plugs, a feed,
and the fuse with its holder [g] (assumed; weigh yours)."""
MAIN_LINE = 0.026
"""Two wires of 1 mm² with their insulation [g/mm] (copper 8.96 g/cm³, half as much around)."""
SOURCES = (
    "mass, leg_mass, bodies: printed parts solid, by density; servos by ROBOTIS' e-manual;",
    f"  battery {BATTERY:g} g/Ah, as a buyer weighed packs; screws as cylinders; assumed:",
    f"  ESP32 board {BOARD:g} g, converter {CONVERTER:g} g, cable with plugs {CABLE:g} g,",
    f"  feed {FEED:g} g, fuse {FUSE:g} g, main line {1e3 * MAIN_LINE:g} g/m;",
    "  without adapter and emergency stop;",
    "antenna.link_mass, base_mass: printed parts, springs and flex sensor, mean of the links;",
    "antenna.ranges: printed stops, before springs yield; antennae.limit: up to it no parts meet;",
    "meshes: printed parts and outlines of servos and battery, drawn in place of plain shapes.",
)
"""Where the numbers of a robot as it is built come from."""
Weight = tuple[str, float, Solid]
"""A name, a mass [g], and the solid in which it is spread evenly."""


def _carried(robot: RobotSolids, screws: Sequence[Fastener], link: int) -> list[Weight]:
    """What a link carries, in its frame; cables and screws are spread evenly over all links."""
    layout, spec, power = robot.layout, robot.layout.robot, supply(robot.layout.robot)
    cables = CABLE * (len(spec.ids) + 1) + FEED * power.feeds
    cables += MAIN_LINE * spec.links * layout.pitch_length
    steel = sum(each.count * each.mass for each in screws)
    low, wall = layout.floor + PLATE, layout.wall
    found = [
        ("cables", cables / spec.links, kernel.block((-50, 50), (-40, 40), (low, low + 8))),
        ("screws", steel / spec.links, kernel.block((-50, 50), (-wall, wall), (-10, 10))),
    ]
    if link == 0 and spec.antenna_count:
        x, half = (layout.tray, layout.tray + CABIN[0]), CABIN[1] / 2.0
        z = (layout.deck + 2.0, layout.deck + 12.0)
        found.append(("ESP32 board", BOARD, kernel.block(x, (2, half), z)))
        found.append(("step-down converter", CONVERTER, kernel.block(x, (-half, -2), z)))
    if link == spec.links - 1:
        found.append(("fuse", FUSE, kernel.block((-30, 0), (38, 44), (low, 10))))
    return found


def link_weights(robot: RobotSolids, screws: Sequence[Fastener], number: int) -> list[Weight]:
    """All of a link without its legs and antennae, in its frame."""
    spec, density = robot.layout.robot, robot.layout.print.density
    found: list[Weight] = []
    for name, solid in robot.bodies(number):
        if name == "battery":
            found.append((name, BATTERY * supply(spec).least_capacity, solid))
        elif name.startswith("servo "):
            servo = servo_of(spec, name)
            found.append((servo, GRAMS[servo], solid))
        else:
            found.append((name, density * kernel.volume(solid), solid))
    return [*found, *_carried(robot, screws, number)]


def body(name: str, weights: Sequence[Weight], mirrored: bool = False) -> dict[str, Any]:
    """A body of weights together as the file of a robot has it, mirrored from left to right or not.

    Args:
        name: Its name.
        weights: What it is made of.
        mirrored: Whether it is the mirror image of that.
    """
    masses = np.array([grams for _, grams, _ in weights])
    moments = [kernel.moments(solid) for _, _, solid in weights]
    centre = masses @ np.array([at for _, at, _ in moments]) / masses.sum()
    inertia, grams_of = np.zeros((3, 3)), dict[str, float]()
    for (part, grams, _), (volume, at, own) in zip(weights, moments, strict=True):
        off = at - centre
        inertia += grams * (own / volume + off @ off * np.eye(3) - np.outer(off, off))
        grams_of[part] = grams_of.get(part, 0.0) + grams
    flip = np.array([1.0, -1.0 if mirrored else 1.0, 1.0])
    tensor = 1e-9 * np.outer(flip, flip) * inertia
    places = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
    return {
        "name": name,
        "mass": round(1e-3 * float(masses.sum()), 6),
        "centre": [round(float(v), 6) + 0.0 for v in 1e-3 * flip * centre],
        "inertia": [float(f"{tensor[place]:.6g}") + 0.0 for place in places],
        "source": ", ".join(f"{part} {grams:.1f} g" for part, grams in grams_of.items()),
    }


def robot_values(
    robot: RobotSolids,
    screws: Sequence[Fastener],
    antenna: Mapping[str, float],
    limit: float | None,
    stops: Sequence[float],
) -> dict[str, Any]:
    """What the file of a robot as it is built says otherwise than that of the robot.

    Args:
        robot: Its links.
        screws: All of its screws.
        antenna: Mean mass of a link of an antenna and that of its base [g]; empty without antennae.
        limit: Largest angle of the bases at which no parts meet [rad]; None if that is theirs.
        stops: Largest angle of each hinge [rad].
    """
    spec, density = robot.layout.robot, robot.layout.print.density
    out = 500.0 * (spec.width - spec.leg_width)
    left = [(name, kernel.moved(solid, (0.0, -out, 0.0))) for name, solid in robot.legs()[::2]]
    leg = [(name, density * kernel.volume(solid), solid) for name, solid in left]
    links = [body(n, link_weights(robot, screws, i)) for i, n in enumerate(spec.link_names)]
    bodies = [*links, *(body(name, leg, "_r" in name) for name in spec.leg_names)]
    values: dict[str, Any] = {"leg_mass": bodies[-1]["mass"], "bodies": bodies}
    total = sum(each["mass"] for each in bodies) + spec.elevation_count * spec.elevation.mass
    if antenna:
        link, base = (round(1e-3 * antenna[name], 7) for name in ("link", "base"))
        total += spec.antenna_count * (spec.antenna.hinges * link + base)
        said: dict[str, Any] = {"link_mass": link, "base_mass": base}
        if any(not math.isclose(stop, spec.antenna.range) for stop in stops):
            said["ranges"] = [math.floor(1e4 * stop) / 1e4 for stop in stops]
        values["antenna"] = said
        if limit is not None:
            values["antennae"] = {"limit": math.floor(1e4 * limit) / 1e4}
    return values | {"mass": round(total, 7)}
