"""The parameters of `build`, and the files that hold them, a robot or an antenna."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path
from typing import ClassVar, Literal

from pydantic import model_validator

from antennate.errors import MissingPackageError
from antennate.files import read_toml
from antennate.messages import extra
from antennate.params.base import (
    LARGEST_FILE,
    Params,
    from_values,
    number,
    paths_of,
    read_file,
)
from antennate.robots.antenna import AntennaSpec
from antennate.robots.spec import ROBOTS, RobotSpec
from antennate_build.printing import PrintParams
from antennate_build.winding import WireParams

_PACKAGES = {"build123d": "build123d", "trimesh": "trimesh"}


_READ = {
    f"robot.{name}"
    for name in (
        *("baud", "leg_eccentricity", "leg_mass", "leg_radius", "leg_width", "link_pitch"),
        *("links", "mass", "width", "fitted", "imu.kind", "legs.kind", "pitch.kind"),
        "pitch.limit",
        *("yaw.limit", "antennae.kind", "antennae.limit", "elevation.kind", "elevation.mass"),
        *(f"{group}.ids" for group in ("yaw", "legs", "antennae", "pitch", "elevation")),
        *(f"{group}.servo" for group in ("yaw", "legs", "antennae", "pitch", "elevation")),
        *(
            f"antenna.{name}"
            for name in (
                *("active_coils", "three_coil_stiffness_n_mm_per_deg", "length", "radius"),
                *(
                    "link_mass",
                    "base_mass",
                    "range",
                    "ranges",
                    "base_angle",
                    "roll",
                    "base_spacing",
                ),
                *("sensor.active_length", "sensor.kind", "sensor.divider_resistance"),
            )
        ),
    )
}
"""Parameters of a robot that parts, their masses and the bill depend on."""


class BuildConfig(Params):
    """What is built, of which wire, and how it is printed."""

    unread: ClassVar[tuple[str, ...]] = (
        *(path for path in paths_of(RobotSpec, "robot") if path not in _READ),
        *(f"springs.{name}" for name in WireParams.unread),
    )
    what: Literal["robot", "antenna"] = number("robot", "1", "assumed: all of it")
    """Whether the whole robot is built, or one antenna."""
    robot: RobotSpec = RobotSpec()
    springs: WireParams = WireParams()
    print: PrintParams = PrintParams()

    @model_validator(mode="after")
    def _has_antennae(self) -> BuildConfig:
        if self.what == "antenna" and not self.robot.antenna_count:
            raise ValueError(
                "what: expected a robot with antennae for an antenna, found one without "
                "(robot.antennae.kind)"
            )
        return self


def read(path: Path) -> BuildConfig:
    """The configuration of a FILE: parameters of the command, a robot, or an antenna alone.

    Args:
        path: The file, the name of a robot, or `antenna`: the default antenna alone.
    """
    if str(path) == "antenna":
        return BuildConfig(what="antenna")
    if str(path) in ROBOTS:
        return BuildConfig(robot=RobotSpec.named(path))
    keys = read_toml(path, LARGEST_FILE).keys()
    if keys & BuildConfig.model_fields.keys():
        return read_file(path, BuildConfig)
    if keys & AntennaSpec.model_fields.keys():
        antenna = read_file(path, AntennaSpec).model_dump(exclude_unset=True)
        return from_values(BuildConfig, {"what": "antenna", "robot": {"antenna": antenna}})
    return BuildConfig(robot=read_file(path, RobotSpec))


def require_kernel() -> None:
    """Find out whether the kernel of solids is installed.

    Raises:
        MissingPackageError: It is not.
    """
    missing = [package for module, package in _PACKAGES.items() if find_spec(module) is None]
    if missing:
        raise MissingPackageError(
            f"build: expected the packages {' and '.join(_PACKAGES.values())}, found no "
            f"{' and no '.join(missing)}; install them with {extra('build', 'antennate-build')}"
        )
