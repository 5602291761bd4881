"""Masses and inertias of the parts beside those with which the robot is simulated."""

from __future__ import annotations

from antennate_build import kernel
from antennate_build.antenna_assembly import AntennaSolids
from antennate_build.build.result import Compared


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
    for n, name in enumerate(antenna.names):
        link = grams[name] + grams["pin"] + layout.springs[n].mass
        middle = layout.length * (n + 0.5)
        at_pin = grams["pin"] + layout.springs[n].mass
        inertia += grams[name] * (middle**2 + layout.length**2 / 12.0)
        inertia += at_pin * (layout.length * n) ** 2
        if n < layout.sensed:
            link += grams["cover"]
            inertia += grams["cover"] * middle**2
        links.append(link)
    rods = sum(
        1e3 * spec.link_mass * ((layout.length * (n + 0.5)) ** 2 + layout.length**2 / 12.0)
        for n in range(spec.hinges)
    )
    return {
        "antenna's mass": compared("g", 1e3 * spec.mass, sum(links) + bracket),
        "link's mass, mean": compared("g", 1e3 * spec.link_mass, sum(links) / len(links)),
        "bracket's mass": compared("g", 1e3 * spec.base_mass, bracket),
        "antenna's inertia about its base": compared("g·mm²", rods, inertia),
    }
