"""What a policy is given and what it answers, as data: the one table of names, units and scales.

Environments make their spaces of it, policy files carry it, docs/envs.md shows it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from pydantic import model_validator

from antennate.params.base import Params, number
from antennate.params.control import ControlParams
from antennate.robots.spec import RobotSpec
from antennate.types import SIDES, Floats

ActionMode = Literal["maneuver", "gait", "joints"]
VERSION = 1
"""Version of the tables below; a file of another one is refused."""
LARGEST_FREQUENCY = 1.0
"""Fastest cycle of a gait or turn of a leg [Hz]: the bound of `gait.frequency`."""
CHOICES = ("FORWARD", "TURN_L", "TURN_R", "REVERSE")
"""Maneuvers that a policy chooses from, in the order of its scores; HOLD is not its choice."""


class PolicyInterface(Params):
    """What a policy is given, and what its answer means."""

    action: ActionMode = number("maneuver", "1", "assumed: what our controllers choose")
    """What it decides: a maneuver, the gait, or the targets of all joints."""
    felt: Literal["flex", "level", "counts"] = number(
        "flex", "1", "assumed: in proportion to the bend; levels saturate"
    )
    """What it is given of each antenna: flex as a share of the calibrated range, level, counts."""
    ticks: int = number(10, "1", "assumed: ten decisions a second at 100 Hz", ge=1, le=100)
    """Control ticks from one decision to the next."""
    history: int = number(32, "1", "assumed: 3.2 s, about two gait cycles", ge=1, le=500)
    """Samples that it is given, one a decision."""
    memory_time: float = number(
        8.0, "s", "assumed: longer than an escape of `closed` takes", gt=0, le=300
    )
    """Time constant of the mean of each channel."""
    servos: bool = number(False, "1", "assumed: by touch alone")
    """Whether it is given how far each joint is from its goal."""
    turn_offset: float = number(0.52, "rad", "assumed: as escape.turn_offset", gt=0, le=1.0)
    """Yaw offset of a turn; the largest one where the gait is decided."""
    frequency: tuple[float, float] = number(
        (0.2, 0.8), "Hz", "assumed: a third of the usual one to the fastest (docs/science/pace.md)"
    )
    """Slowest and fastest gait that it can choose."""

    def unread_here(self) -> Mapping[str, str]:
        """What belongs to another action."""
        theirs = {"maneuver": ("frequency",), "gait": (), "joints": ("frequency", "turn_offset")}
        return dict.fromkeys(theirs[self.action], f"the action {self.action!r} does not have it")

    def fastest_gait(self, frequency: float) -> float:
        """Fastest gait of its answers [Hz]: `frequency` for maneuvers, 0 where they move joints."""
        paces = {"maneuver": frequency, "gait": self.frequency[1], "joints": 0.0}
        return paces[self.action]

    @model_validator(mode="after")
    def _range(self) -> PolicyInterface:
        low, high = self.frequency
        if not 0.0 < low < high <= LARGEST_FREQUENCY:
            raise ValueError(
                f"frequency must rise from above 0 to at most {LARGEST_FREQUENCY:g} Hz, found "
                f"{low:g} and {high:g}"
            )
        return self


@dataclass(frozen=True, slots=True)
class Quantity:
    """One number that a policy is given or answers.

    Attributes:
        name: What it is called.
        unit: Its unit before scaling.
        scale: What one unit of the number stands for, in `unit`.
        low: Least number; what is smaller is clipped.
        high: Largest number.
        meaning: What it is, for the table in the docs.
    """

    name: str
    unit: str
    scale: float
    low: float
    high: float
    meaning: str


_FELT = {
    "flex": ("1", 1.0, -1.0, 2.0, "flex of the {} antenna: 0 straight, 1 the end of its range"),
    "level": ("1", 1.0, 0.0, 1.0, "bending level b of the {} antenna"),
    "counts": ("counts", 4095.0, 0.0, 1.0, "reading of the {} antenna, mean over T_avg"),
}


def channels(interface: PolicyInterface, robot: RobotSpec) -> tuple[Quantity, ...]:
    """What a policy is given the history and the mean of, newest first."""
    unit, scale, low, high, text = _FELT[interface.felt]
    names = tuple(zip(SIDES, ("left", "right"), strict=True))
    felt = [
        Quantity(f"{interface.felt}_{side}{end}", unit, scale, low, high, begin + text.format(word))
        for end, begin in (("", ""), (" most", "at the strongest bend since the last decision, "))
        for side, word in names
    ]
    gait = [
        Quantity("pace", "Hz", 1.0, -1.0, 1.0, "gait cycles a second, negative backwards"),
        Quantity("offset", "rad", 1.0, -1.6, 1.6, "yaw offset of the gait, positive to the right"),
    ]
    if interface.action == "gait":
        gait.append(Quantity("amplitude", "rad", 1.0, 0.0, 1.6, "amplitude of the body wave"))
    return *felt, *gait


def observations(
    interface: PolicyInterface, control: ControlParams, robot: RobotSpec
) -> tuple[Quantity, ...]:
    """Every number of an observation, in order: histories, means, phase, goals, servos."""
    period = interface.ticks * control.period
    each = channels(interface, robot)
    past = [
        Quantity(f"{c.name} {-i * period:g} s", c.unit, c.scale, c.low, c.high, c.meaning)
        for c in each
        for i in range(interface.history)
    ]
    means = [
        Quantity(f"{c.name} mean", c.unit, c.scale, c.low, c.high, f"mean of {c.meaning}")
        for c in each
    ]
    phase = [
        Quantity(f"phase {f}", "1", 1.0, -1.0, 1.0, f"{word} of the gait phase")
        for f, word in (("sin", "sine"), ("cos", "cosine"))
    ]
    goals = goal_quantities(robot) if interface.action == "joints" else ()
    servos = servo_quantities(robot) if interface.servos else ()
    return *past, *means, *phase, *goals, *servos


def servo_quantities(robot: RobotSpec) -> tuple[Quantity, ...]:
    """How far all joints are from their goals, now and on average."""
    text = "reported angle less the goal of the tick before, within half a turn; 0 if there is none"
    return tuple(
        Quantity(f"lag {name}{end}", "rad", 1.0, -math.pi, math.pi, begin + text)
        for end, begin in (("", ""), (" mean", "mean of "))
        for name in robot.joint_names
    )


def goal_quantities(robot: RobotSpec) -> tuple[Quantity, ...]:
    """Goals of all joints: the angle, or sine and cosine where a leg turns without end."""
    goals: list[Quantity] = []
    for name, limit in zip(robot.joint_names, robot.limits, strict=True):
        if math.isfinite(limit):
            goals.append(Quantity(f"goal {name}", "rad", 1.0, -limit, limit, "goal of the joint"))
        else:
            goals += [
                Quantity(f"goal {name} {f}", "1", 1.0, -1.0, 1.0, f"{word} of the leg's goal")
                for f, word in (("sin", "sine"), ("cos", "cosine"))
            ]
    return tuple(goals)


def actions(interface: PolicyInterface, robot: RobotSpec) -> tuple[Quantity, ...]:
    """Every number of an answer, in order; the scale is what 1 stands for."""
    if interface.action == "maneuver":
        text = "score of the maneuver; the largest is done, the first of equal ones"
        return tuple(Quantity(name, "1", 1.0, -math.inf, math.inf, text) for name in CHOICES)
    if interface.action == "gait":
        low, high = interface.frequency
        return (
            Quantity("amplitude", "rad", robot.yaw_limit, -1, 1, "-1 is no wave, 1 the largest"),
            Quantity("offset", "rad", interface.turn_offset, -1, 1, "positive turns right"),
            Quantity("frequency", "Hz", high, -1, 1, f"-1 is {low:g} Hz, 1 is {high:g} Hz"),
            Quantity("direction", "1", 1.0, -1, 1, "forward from 0 on, backward below"),
        )
    names = zip(robot.joint_names, robot.limits, strict=True)
    turn = 2.0 * math.pi * LARGEST_FREQUENCY
    return tuple(
        Quantity(name, "rad", limit, -1, 1, "goal as a share of the joint's limit")
        if math.isfinite(limit)
        else Quantity(name, "rad/s", turn, -1, 1, "speed of the leg's goal")
        for name, limit in names
    )


def bounds(quantities: tuple[Quantity, ...]) -> tuple[Floats, Floats]:
    """Least and largest numbers, shape (n,)."""
    return np.array([q.low for q in quantities]), np.array([q.high for q in quantities])
