"""Mass and inertia of links, legs and antennae as they are built, for the robot's file."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from antennate.types import Floats
from antennate_build import kernel
from antennate_build.fasteners import Fastener
from antennate_build.kernel import Solid
from antennate_build.loads import loads
from antennate_build.mounts import GRAMS
from antennate_build.robot_assembly import RobotSolids

STRIP_DENSITY = 1.38e-3
"""Of the flex sensor [g/mm³]: polyester film."""


@dataclass(frozen=True)
class Body:
    """A rigid body of parts.

    Attributes:
        grams: Its mass [g].
        centre: Its centre of mass [mm], shape (3,).
        inertia: About that centre [g·mm²], shape (3, 3).
        parts: What it is made of, with the mass of each kind [g].
    """

    grams: float
    centre: Floats
    inertia: Floats
    parts: Mapping[str, float]


def body(parts: Iterable[tuple[str, float, Solid]]) -> Body:
    """Parts together, each with its mass [g] spread evenly in its solid."""
    listed = list(parts)
    masses = np.array([grams for _, grams, _ in listed])
    moments = [kernel.moments(solid) for _, _, solid in listed]
    centres = np.array([centre for _, centre, _ in moments])
    centre = masses @ centres / masses.sum()
    inertia = np.zeros((3, 3))
    names: dict[str, float] = {}
    for (name, grams, _), (volume, at, own) in zip(listed, moments, strict=True):
        off = at - centre
        inertia += grams * (own / volume + off @ off * np.eye(3) - np.outer(off, off))
        names[name] = names.get(name, 0.0) + grams
    return Body(float(masses.sum()), centre, inertia, names)


def link_body(robot: RobotSolids, screws: Iterable[Fastener], number: int) -> Body:
    """A link with its servos and what it carries, in its frame; without legs and antennae."""
    layout, density = robot.layout, robot.layout.print.density
    servos = {"leg": layout.robot.legs.servo, "yaw": layout.robot.yaw.servo}
    servos |= {"pitch": layout.robot.pitch.servo, "antenna": layout.robot.antennae.servo}
    parts: list[tuple[str, float, Solid]] = []
    for name, solid in robot.bodies(number):
        if name == "battery":  # among what it carries
            continue
        group = name.removeprefix("servo ").partition("_")[0]
        servo = servos[group] if name.startswith("servo ") else ""
        grams = GRAMS[servo] if servo else density * kernel.volume(solid)
        parts.append((servo or name, grams, solid))
    carried = loads(layout, screws, number)
    return body([*parts, *((each.name, each.grams, each.solid) for each in carried)])


def leg_body(robot: RobotSolids) -> Body:
    """A left leg with its tread, in the frame of its axle, the middle of its width at 0."""
    density, robot_spec = robot.layout.print.density, robot.layout.robot
    out = 500.0 * (robot_spec.width - robot_spec.leg_width)
    left = [(name, kernel.moved(s, (0, -out, 0))) for name, s in robot.legs()[::2]]
    return body((name, density * kernel.volume(solid), solid) for name, solid in left)


def _table(name: str, found: Body, mirrored: bool = False) -> dict[str, Any]:
    """A body as the robot's file has it."""
    flip = np.array([1.0, -1.0 if mirrored else 1.0, 1.0])
    centre = 1e-3 * flip * found.centre
    tensor = 1e-9 * np.outer(flip, flip) * found.inertia
    places = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
    parts = ", ".join(f"{part} {grams:.1f} g" for part, grams in found.parts.items())
    return {
        "name": name,
        "mass": round(1e-3 * found.grams, 6),
        "centre": [round(float(v), 6) + 0.0 for v in centre],
        "inertia": [float(f"{tensor[place]:.6g}") + 0.0 for place in places],
        "source": parts,
    }


def bodies(robot: RobotSolids, screws: list[Fastener]) -> list[dict[str, Any]]:
    """Links and legs of a robot as its file has them."""
    spec = robot.layout.robot
    found = [_table(name, link_body(robot, screws, n)) for n, name in enumerate(spec.link_names)]
    leg = leg_body(robot)
    found += [_table(name, leg, "_r" in name) for name in spec.leg_names]
    return found


def robot_values(
    robot: RobotSolids,
    screws: list[Fastener],
    antenna: Mapping[str, float],
    limit: float | None,
    stops: tuple[float, ...],
) -> dict[str, Any]:
    """What the file of a robot as it is built says otherwise than that of the robot.

    Args:
        robot: Its links.
        screws: All of its screws.
        antenna: Mean mass of a link of an antenna and that of its base [g]; empty without antennae.
        limit: Largest angle of the bases at which no parts meet [rad]; None if that is theirs.
        stops: Largest angle of each hinge [rad].
    """
    spec = robot.layout.robot
    listed = bodies(robot, screws)
    leg = next(each["mass"] for each in listed if each["name"] in spec.leg_names)
    total = sum(each["mass"] for each in listed) + spec.elevation_count * spec.elevation.mass
    values: dict[str, Any] = {"leg_mass": leg, "bodies": listed}
    if antenna:
        link, base = (round(1e-3 * antenna[name], 7) for name in ("link", "base"))
        total += spec.antenna_count * (spec.antenna.hinges * link + base)
        said: dict[str, Any] = {"link_mass": link, "base_mass": base}
        values["antenna"] = said
        if any(not math.isclose(stop, spec.antenna.range) for stop in stops):
            said["ranges"] = [math.floor(1e4 * stop) / 1e4 for stop in stops]
        if limit is not None:
            values["antennae"] = {"limit": math.floor(1e4 * limit) / 1e4}
    return values | {"mass": round(total, 7)}
