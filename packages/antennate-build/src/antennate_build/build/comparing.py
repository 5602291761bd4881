"""Masses and inertias of the parts beside those with which the robot is simulated."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from antennate.robots.spec import RobotSpec
from antennate_build import kernel
from antennate_build.antenna_assembly import AntennaSolids
from antennate_build.build.config import BuildConfig
from antennate_build.build.naming import antenna_of, links_of
from antennate_build.build.result import Compared
from antennate_build.checks import Check
from antennate_build.layout import STRIPS
from antennate_build.weights import STRIP_DENSITY

LARGEST_DIFFERENCE = 0.1
"""Difference of a mass of an antenna from its specification above which a warning tells it."""


def compared(unit: str, specified: float, built: float) -> Compared:
    """Two numbers, and how far one is from the other."""
    return Compared(unit=unit, specified=specified, built=built, difference=built / specified - 1.0)


def antenna_masses(antenna: AntennaSolids) -> dict[str, Compared]:
    """Mass of an antenna, of its base and of a link, and their inertia about the base.

    Inertia of the specification is that of the rods as which its links are simulated.
    """
    spec, layout = antenna.layout.antenna, antenna.layout
    density = layout.print.density
    grams = {name: density * kernel.volume(solid) for name, solid in antenna.printed.items()}
    bracket = grams[antenna.sides[0][0]] + grams["cover"]
    links, inertia = [], 0.0
    for n, spring in enumerate(layout.springs):
        found = [kernel.moments(solid) for solid in antenna.moving(n)]
        links.append(spring.mass + density * sum(volume for volume, _, _ in found))
        inertia += spring.mass * (layout.length * n) ** 2
        for volume, (x, y, _), own in found:
            apart = (layout.length * n + x) ** 2 + y**2
            inertia += density * (float(own[2, 2]) + volume * apart)
    rods = sum(
        1e3 * spec.link_mass * ((layout.length * (n + 0.5)) ** 2 + layout.length**2 / 12.0)
        for n in range(spec.hinges)
    )
    return {
        "antenna's mass": compared("g", 1e3 * spec.mass, sum(links) + bracket),
        "antenna link's mass, mean": compared("g", 1e3 * spec.link_mass, sum(links) / len(links)),
        "bracket's mass": compared("g", 1e3 * spec.base_mass, bracket),
        "antenna's inertia about its base": compared("g·mm²", rods, float(inertia)),
    }


def mass_check(masses: Mapping[str, Compared]) -> Check:
    """The check that an antenna weighs what is simulated; a warning where it does not."""
    grams = {name: each for name, each in masses.items() if each.unit == "g"}
    told = ", ".join(f"{name} {100 * each.difference:+.1f} %" for name, each in grams.items())
    whole = next(iter(grams.values()))
    far = any(abs(each.difference) > LARGEST_DIFFERENCE for each in grams.values())
    found = f"{whole.built:.2f} g built, {whole.specified:.2f} g specified; {told}"
    return Check("mass of the antenna, of the specification", found, True, far)


def robot_masses(spec: RobotSpec, built: Mapping[str, Any]) -> dict[str, Compared]:
    """Mass of a robot, of a link and of a leg, without adapter and emergency stop.

    Args:
        spec: The robot.
        built: What its file says as it is built.
    """
    masses = {body["name"]: 1e3 * body["mass"] for body in built["bodies"]}
    mean = sum(masses[name] for name in spec.link_names) / spec.links
    return {
        "robot's mass": compared("g", 1e3 * spec.mass, 1e3 * built["mass"]),
        "link's mass, mean": compared("g", 1e3 * spec.link_mass, mean),
        "leg's mass": compared("g", 1e3 * spec.leg_mass, masses[spec.leg_names[0]]),
    }


def antenna_grams(antenna: AntennaSolids, masses: Mapping[str, Compared]) -> dict[str, float]:
    """Mean mass of a link of an antenna, with its share of the flex sensor, and of its base [g]."""
    width, thickness, length = STRIPS[antenna.layout.antenna.sensor.kind]
    strip = STRIP_DENSITY * width * thickness * length
    link = masses["antenna link's mass, mean"].built + strip / antenna.hinges
    return {"link": link, "base": masses["bracket's mass"].built}


def apart(config: BuildConfig) -> list[str]:
    """Where the parts are not what is simulated, in sentences."""
    robot, told = config.robot, list[str]()
    if (found := antenna_of(config)) is not None:
        layout, _ = found
        high, wide = 2.0 * layout.hinge.half, layout.strip.top - layout.low
        told.append(
            f"Antenna: {high:.1f} mm high and {wide:.1f} mm wide, simulated as rods of "
            f"{2e3 * robot.antenna.radius:g} mm."
        )
    links = links_of(config)
    if links is not None and links[0].pitch is not None:
        offset = 1e3 * robot.link_pitch - (links[0].axis - links[0].rear)
        told.append(
            f"Joints: the axes of yaw and pitch stand {offset:.1f} mm apart, simulated in one "
            "point."
        )
    if links is not None and robot.elevation_count:
        told.append(
            "Elevation: no part is made for the joints that raise the antennae; the base servos "
            "sit in the head plate."
        )
    return told
