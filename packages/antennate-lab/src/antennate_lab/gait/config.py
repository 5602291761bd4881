"""Everything that decides the outcome of `antennate gait`, and numbers that nobody measured.

Those are drawn from a range, and each is set alone to both of its ends.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Literal, TypeVar, cast

import numpy as np
from pydantic import model_validator

from antennate.control.readers import HARDWARE_ALONE, unread_lift, unused
from antennate.errors import ConfigError
from antennate.messages import nearest, shown
from antennate.params.base import (
    Params,
    from_values,
    number,
    require_default,
    require_different,
    require_whole_steps,
)
from antennate.params.control import GaitParams
from antennate.params.scene import PhysicsParams
from antennate.robots.mechanics import require_wave
from antennate.robots.spec import RobotSpec, WalkingRobot
from antennate.types import Floats

GROUPS = ("robot", "gait")
"""Groups of a configuration whose numbers may be unknown."""

Config = TypeVar("Config", bound=Params)


@dataclass(frozen=True)
class Unknown:
    """A number that lies somewhere in a range, each value of which is as likely.

    Attributes:
        name: The parameter, dotted.
    """

    name: str
    low: float
    high: float

    @classmethod
    def read(cls, text: str) -> Unknown:
        """From words such as `robot.leg_friction=0.18:0.25`."""
        name, _, span = text.partition("=")
        low, _, high = span.partition(":")
        try:
            unknown = cls(name.replace("-", "_"), float(low), float(high))
        except ValueError:
            unknown = cls("", 0.0, 0.0)
        if not unknown.name.startswith(tuple(f"{group}." for group in GROUPS)) or not (
            -math.inf < unknown.low < unknown.high < math.inf
        ):
            raise ValueError(
                "unknown: expected a number of robot or gait with its range, such as "
                f"robot.leg_friction=0.18:0.25, found {shown(text)}"
            )
        return unknown


def changed(config: Config, values: Mapping[str, float]) -> Config:
    """A configuration with other numbers in it, by their dotted names."""
    table = config.model_dump()
    places = {name: place for group in GROUPS for name, place in _numbers(table[group], group)}
    for name, value in values.items():
        if name not in places:
            raise ConfigError(
                f"unknown: expected a number of robot or gait that need not be whole"
                f"{nearest(name, places)}, found {shown(name)}"
            )
        group, last = places[name]
        group[last] = value
    try:
        return from_values(type(config), table)
    except ConfigError as error:
        raise ConfigError(f"unknown: {error}") from None


def _numbers(table: dict[str, Any], path: str) -> Iterator[tuple[str, tuple[dict[str, Any], str]]]:
    """The dotted name of each number in nested tables, and the table and key that hold it."""
    for key, value in table.items():
        if isinstance(value, dict):
            yield from _numbers(cast("dict[str, Any]", value), f"{path}.{key}")
        elif isinstance(value, float):
            yield f"{path}.{key}", (table, key)


def drawn(unknowns: Sequence[Unknown], draws: int, seed: int) -> Floats:
    """Values of the unknown numbers, each column stratified, shape (draws, unknowns)."""
    rng = np.random.default_rng(seed)
    strata = np.array([rng.permutation(draws) for _ in unknowns]).reshape(-1, draws).T
    share = (strata + rng.uniform(size=strata.shape)) / max(draws, 1)
    low, high = (np.array([getattr(one, end) for one in unknowns]) for end in ("low", "high"))
    return low + share * (high - low)


_OF_UNKNOWN = ("draws", "seed")


class GaitStudyConfig(Params):
    """Everything that decides the outcome of `antennate gait`."""

    unread: ClassVar[tuple[str, ...]] = HARDWARE_ALONE
    cycles: int = number(
        4, "1", "measured: antennate gait, six cycles give the same speeds to 0.3 %", ge=2, le=100
    )
    """Gait cycles measured."""
    settling_cycles: int = number(
        2, "1", "measured: antennate gait, 1 % from cycle to cycle then", ge=0, le=100
    )
    """Gait cycles before measuring."""
    sweep_points: int = number(24, "1", "assumed: steps of 15 deg", ge=2, le=360)
    """Leads of the body wave tried, evenly over a full turn."""
    rate: float = number(100.0, "Hz", "paper: about 100 Hz over serial", gt=0, le=1000)
    """Control ticks per second."""
    body_length: float | None = number(None, "m", "assumed: the links in a row", gt=0)
    """What counts as a body length; the length of the robot if not given."""
    measured: float | None = number(None, "1", "assumed: nobody measured it")
    """Body lengths a cycle that a real robot was measured to walk."""
    unknown: tuple[str, ...] = number((), "1", "assumed: all is known")
    """Numbers that are not known, each with its range: robot.leg_friction=0.18:0.25."""
    draws: int = number(100, "1", "assumed: enough for an interval", ge=1, le=10_000)
    """Draws of the unknown numbers, if there are any."""
    seed: int = number(1, "1", "assumed: any", ge=0)
    """Seed of the draws."""
    optimise: Literal["none", "speed", "cost", "turning"] = number(
        "none", "1", "assumed: the gait is walked as it is given"
    )
    """What one more gait is best at by the model; `cost` is that of gaits as fast as the given."""
    robot: WalkingRobot = RobotSpec()
    gait: GaitParams = GaitParams()
    physics: PhysicsParams = PhysicsParams()

    def unread_here(self) -> Mapping[str, str]:
        """What this robot does not have, and the step of legs that do not lift."""
        return unused(self.robot) | unread_lift(self.robot, "gait")

    @property
    def unknowns(self) -> list[Unknown]:
        """The unknown numbers."""
        return [Unknown.read(text) for text in self.unknown]

    @property
    def length(self) -> float:
        """A body length [m]."""
        return self.robot.length if self.body_length is None else self.body_length

    def at(self, values: Mapping[str, float]) -> GaitStudyConfig:
        """The configuration with all numbers known and these values of some."""
        known = {name: type(self).model_fields[name].default for name in _OF_UNKNOWN}
        return changed(self.model_copy(update={"unknown": (), **known}), values)

    @model_validator(mode="after")
    def _agree(self) -> GaitStudyConfig:
        require_whole_steps("rate", self.rate, self.physics.timestep)
        if not self.unknown:
            require_default(self, "all is known", *_OF_UNKNOWN)
        if self.optimise != "none":
            require_wave(self.robot, self.gait)
        unknowns = self.unknowns
        require_different("unknown", [one.name for one in unknowns])
        for one in unknowns:
            for value in (one.low, one.high):
                self.at({one.name: value})
        return self
