"""The parameters of `antenna`, and the files that hold them or an antenna."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, ClassVar

from antennate.files import read_toml
from antennate.params.base import LARGEST_FILE, from_values, number, read_file
from antennate.params.scene import BenchPhysicsParams
from antennate.params.spring import SpringParams, TaperParams
from antennate.robots.antenna import AntennaSpec
from antennate.robots.spec import ROBOTS, RobotSpec


class AntennaConfig(SpringParams, TaperParams):
    """An antenna: its springs, the animal's taper, its sensor, and how it is let go."""

    unread: ClassVar[tuple[str, ...]] = ("antenna.base_angle", "antenna.base_spacing")
    largest_flex: float = number(
        math.pi / 2, "rad", "assumed: antenna bent to a right angle", gt=0.01, le=6
    )
    """Largest bend of the sensor."""
    points: int = number(19, "1", "assumed: every five degrees of a right angle", ge=3, le=1000)
    """Bends of the sensor's static curve."""
    loop_time: float = number(
        4.0, "s", "assumed: slow against the flex sensor's rise", gt=0.1, le=1000
    )
    """Time of a loop of the sensor."""
    hold_time: float = number(30.0, "s", "assumed: three slow time constants", gt=0.1, le=10000)
    """Time for which the sensor is held bent."""
    seed: int = number(0, "1", "assumed: any", ge=0)
    """Seed of the sensor's noise."""
    deflection: float = number(
        math.radians(5.0), "rad", "assumed: small, so that the chain is linear", gt=1e-4, le=0.5
    )
    """Sum of all angles before the antenna is let go."""
    cycles: float = number(3.0, "1", "assumed: little is left then", ge=1.5, le=50)
    """Cycles of the first mode that are recorded."""
    beside: tuple[str, ...] = number((), "1", "assumed: none", metavar="FILE")
    """Files of robots whose antennae stand beside this one, by the first mode of their chains."""
    antenna: AntennaSpec = AntennaSpec()
    physics: BenchPhysicsParams = BenchPhysicsParams()


def read(path: Path) -> AntennaConfig:
    """The configuration of a FILE: parameters of the command, a robot, or an antenna alone.

    Of a robot the antenna counts. What is not read of it, as its mounting angle, may stand there.

    Args:
        path: The file, or the name of a robot.
    """
    if str(path) in ROBOTS:
        return _with(RobotSpec.named(path).antenna)
    keys = read_toml(path, LARGEST_FILE).keys()
    own = AntennaConfig.model_fields.keys()
    if keys & AntennaSpec.model_fields.keys() - own:
        return _with(read_file(path, AntennaSpec))
    if keys <= {"antenna"} or keys & RobotSpec.model_fields.keys() - own:
        return _with(read_file(path, RobotSpec).antenna)
    return read_file(path, AntennaConfig)


def _with(antenna: AntennaSpec) -> AntennaConfig:
    unread = {name.rpartition(".")[2] for name in AntennaConfig.unread}
    stated: dict[str, Any] = antenna.model_dump(exclude_unset=True, exclude=unread)
    return from_values(AntennaConfig, {"antenna": stated})
