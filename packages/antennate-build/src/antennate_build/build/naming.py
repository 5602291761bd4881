"""Names of all files of a run, from its configuration alone: known before anything is made."""

from __future__ import annotations

import math

from antennate.robots.antenna import BASE
from antennate.robots.spec import ANTENNA_PREFIXES, RobotSpec
from antennate_build.build.config import BuildConfig
from antennate_build.flange import hinge_height
from antennate_build.layout import AntennaLayout, layout_of, segment_names
from antennate_build.link_layout import LinkLayout, link_layout
from antennate_build.link_layout import part_names as link_part_names
from antennate_build.mounts import Mount, mount_of
from antennate_build.winding import springs_of

MESHES = "meshes"
"""Folder of the meshes of bodies, beside robot.toml."""
SHEETS = ("antenna", "assembly", "bracket")
"""Drawings of an antenna."""


def antenna_of(config: BuildConfig) -> tuple[AntennaLayout, Mount] | None:
    """Sizes of the antenna and the servo of its base; None for a robot without antennae."""
    if not config.robot.antenna_count:
        return None
    springs = springs_of(config.robot.antenna, config.springs)
    layout = layout_of(config.robot.antenna, springs, config.print)
    return layout, mount_of(config.robot.antennae.servo, "robot.antennae.servo")


def links_of(config: BuildConfig) -> tuple[LinkLayout, float] | None:
    """Sizes of the links, and the height of the horns of the base servos over the antennae [mm].

    None where an antenna is built alone; the height is 0 for a robot without antennae.
    """
    if config.what == "antenna":
        return None
    horn = head = 0.0
    if (found := antenna_of(config)) is not None:
        layout, mount = found
        horn = hinge_height(layout, mount, config.robot.antenna.roll)
        head = horn + mount.horn.top - mount.z[0] + 3.0
    return link_layout(config.robot, config.print, head), horn


def brackets(config: BuildConfig) -> tuple[tuple[str, float], ...]:
    """Brackets of the antennae, and how each turns its antenna about its own axis [rad].

    On a robot both hang upside down, so each bracket turns its antenna by half a turn more.
    """
    roll = config.robot.antenna.roll
    if config.what == "antenna":
        return (("bracket", roll),)
    return (("bracket_left", math.pi + roll), ("bracket_right", -roll))


def part_names(config: BuildConfig) -> tuple[str, ...]:
    """Printed parts."""
    names: list[str] = []
    if (found := antenna_of(config)) is not None:
        names += [name for name, _ in brackets(config)]
        names += [*dict.fromkeys(segment_names(found[0])), "pin", "cover"]
    if (links := links_of(config)) is not None:
        names += link_part_names(links[0], found is not None)
    return tuple(names)


def sheet_names(config: BuildConfig) -> tuple[str, ...]:
    """Drawings."""
    links = ("link",) if config.what == "robot" else ()
    return (*SHEETS, *links) if config.robot.antenna_count else links


def _robot_files(robot: RobotSpec) -> tuple[str, ...]:
    """Files with which a robot is simulated as it is built."""
    antenna = (BASE, *robot.antenna.hinge_names)
    prefixes = ANTENNA_PREFIXES[: robot.antenna_count]
    antennae = (prefix + name for prefix in prefixes for name in antenna)
    bodies = (*robot.link_names, *robot.leg_names, *antennae)
    return ("robot.toml", "robot.xml", *(f"{MESHES}/{name}.stl" for name in bodies))


def file_names(config: BuildConfig) -> tuple[str, ...]:
    """All files beside those that every run has."""
    parts = part_names(config)
    robot = _robot_files(config.robot) if config.what == "robot" else ()
    return (
        *robot,
        *(f"stl/{name}.stl" for name in parts),
        *(f"step/{name}.step" for name in parts),
        "step/assembly.step",
        *(f"drawings/{name}.pdf" for name in sheet_names(config)),
        "assembly.md",
        "bom.csv",
    )
