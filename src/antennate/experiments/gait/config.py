"""Everything that decides the outcome of `antennate gait`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from pydantic import model_validator

from antennate.control.readers import HARDWARE_ALONE, unread_lift, unused
from antennate.errors import ConfigError
from antennate.experiments.gait.unknown import Unknown, changed
from antennate.params.base import (
    Params,
    number,
    require_default,
    require_different,
    require_whole_steps,
)
from antennate.params.gaits import GaitParams
from antennate.params.scene import PhysicsParams
from antennate.robots.spec import RobotSpec

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
    robot: RobotSpec = RobotSpec()
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
        """The same with all numbers known and these values of some.

        Raises:
            ConfigError: They make no robot or gait.
        """
        known = {name: type(self).model_fields[name].default for name in _OF_UNKNOWN}
        return changed(self.model_copy(update={"unknown": (), **known}), values)

    @model_validator(mode="after")
    def _agree(self) -> GaitStudyConfig:
        require_whole_steps("rate", self.rate, self.physics.timestep)
        if not self.unknown:
            require_default(self, "all is known", *_OF_UNKNOWN)
        unknowns = self.unknowns
        require_different("unknown", [one.name for one in unknowns])
        for one in unknowns:
            for value in (one.low, one.high):
                try:
                    self.at({one.name: value})
                except ConfigError as error:
                    raise ValueError(str(error)) from None
        return self
