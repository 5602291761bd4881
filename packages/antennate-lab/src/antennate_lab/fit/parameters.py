"""What a fit may change of a robot, on which scale it is searched, and what is known before.

A parameter is searched on its logarithm, or as it is where it may be 0. What is known before a log
is read is a normal distribution there, about the value of the robot's file, with the width
`spread`. A list of the robot, as that of the yaw joints' backlash, is one parameter for each entry.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from antennate.params.base import put_over
from antennate.robots.spec import RobotSpec
from antennate.types import Floats

LEG = "legs.friction"
"""Friction of one leg on the floor: `leg_friction` times its `legs.friction_factors`."""
BACKLASH = "yaw.backlash"
"""Backlash of one yaw joint."""
SHORTEST = 0.002
"""Delays up to the timestep of the physics are alike, but for none at all [s]."""


@dataclass(frozen=True)
class Scale:
    """How a parameter is searched.

    Attributes:
        unit: Unit of the parameter.
        low, high: Bounds of the search.
        spread: Standard deviation of what is known before, on the scale of the search.
        nudge: Change by which a slope is found, on that scale.
        log: Whether that scale is the logarithm.
    """

    unit: str
    low: float
    high: float
    spread: float
    nudge: float
    log: bool = True


SCALES: Mapping[str, Scale] = {
    "gain_divisor": Scale("1", 8.0, 4000.0, 0.7, 0.02),
    "stall_torque": Scale("N·m", 0.01, 20.0, 0.3, 0.02),
    "no_load_speed": Scale("rad/s", 0.5, 200.0, 0.3, 0.02),
    "armature": Scale("kg·m²", 1e-5, 0.1, 0.7, 0.03),
    "friction": Scale("N·m", 0.0, 0.3, 0.05, 0.004, log=False),
    "load_friction": Scale("1", 0.0, 0.8, 0.2, 0.02, log=False),
    "delay": Scale("s", 0.0, 0.05, 0.02, 0.004, log=False),
    "gain_factor": Scale("1", 0.1, 10.0, 0.5, 0.02),
    "backlash": Scale("rad", 0.0, 0.1, 0.02, 0.004, log=False),
    "three_coil_stiffness_n_mm_per_deg": Scale("N·mm/deg", 0.01, 10.0, 0.5, 0.03),
    "damping_time": Scale("s", 1e-3, 0.5, 0.7, 0.05),
    "bend_gain": Scale("1/rad", 0.01, 10.0, 0.5, 0.03),
    "right_stiffness": Scale("1", 0.1, 10.0, 0.3, 0.03),
    "right_gain": Scale("1", 0.1, 10.0, 0.3, 0.03),
    LEG: Scale("1", 0.03, 2.0, 0.4, 0.2),
    "leg_friction": Scale("1", 0.03, 2.0, 0.4, 0.2),
    "friction_factors": Scale("1", 0.01, 2.0, 0.4, 0.2),
}
"""Scales of the parameters by the last part of their name."""


@dataclass(frozen=True)
class Parameter:
    """One number of a robot.

    Attributes:
        path: Its tables and name in a robot's file, dotted.
        place: Its place in a list, None for a number of its own.
        start: Its value in the robot that a fit begins with.
        scale: How it is searched.
    """

    path: str
    place: int | None
    start: float
    scale: Scale

    @property
    def name(self) -> str:
        """Path, and place if it stands in a list."""
        return self.path if self.place is None else f"{self.path}[{self.place}]"

    def searched(self, value: float) -> float:
        """A value on the scale of the search, within its bounds."""
        value = min(max(value, self.scale.low), self.scale.high)
        return math.log(value) if self.scale.log else value

    def value(self, searched: float) -> float:
        """The value at a place on the scale of the search; one that is nearly 0 is 0."""
        if self.scale.log:
            return min(max(math.exp(searched), self.scale.low), self.scale.high)
        return float(searched) if searched > self.scale.nudge / 50.0 else 0.0


def parameters(robot: RobotSpec, names: Iterable[tuple[str, int | None]]) -> list[Parameter]:
    """Parameters of these paths and places, that start as the robot has them."""
    made = []
    for path, place in names:
        scale = SCALES[path if path == LEG else path.rpartition(".")[2]]
        made.append(Parameter(path, place, float(_value(robot, path, place)), scale))
    return made


def _value(robot: RobotSpec, path: str, place: int | None) -> float:
    if path == LEG:
        return robot.leg_frictions[place or 0]
    if place is not None:
        return _list(robot, path)[place]
    value: Any = robot
    for part in path.split("."):
        value = getattr(value, part)
    return value


def _list(robot: RobotSpec, path: str) -> tuple[float, ...]:
    """A list of the robot in full, also where its file leaves it empty."""
    if path == BACKLASH:
        return robot.backlash
    return robot.factors


def bounds(chosen: Sequence[Parameter]) -> tuple[Floats, Floats]:
    """Ends of the search of each parameter, on its scale."""
    low = [each.searched(each.scale.low) for each in chosen]
    high = [each.searched(each.scale.high) for each in chosen]
    return np.array(low), np.array(high)


def table(robot: RobotSpec, chosen: Sequence[Parameter], values: Sequence[float]) -> dict[str, Any]:
    """What a robot's file says of these values, in nested tables."""
    flat: dict[str, Any] = {}
    legs = list(robot.leg_frictions)
    for each, value in zip(chosen, values, strict=True):
        if each.path == LEG:
            legs[each.place or 0] = value
        elif each.place is None:
            flat[each.path] = value
        else:
            flat.setdefault(each.path, list(_list(robot, each.path)))[each.place] = value
    if any(each.path == LEG for each in chosen):
        flat["leg_friction"] = common = float(np.median(legs))
        flat["legs.friction_factors"] = [min(leg / common, 2.0) for leg in legs]
    nested: dict[str, Any] = {}
    for path, value in flat.items():
        *groups, name = path.split(".")
        inner = nested
        for group in groups:
            inner = inner.setdefault(group, {})
        inner[name] = value
    return nested


def changed(robot: RobotSpec, chosen: Sequence[Parameter], values: Sequence[float]) -> RobotSpec:
    """The robot with other values of some parameters.

    Raises:
        ConfigError: It could not be such a robot.
    """
    over = table(robot, chosen, values)
    return RobotSpec.model_validate(put_over(robot.model_dump(), over))
