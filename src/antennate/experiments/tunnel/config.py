"""What `antennate tunnel` is told."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from pydantic import field_validator, model_validator

from antennate.control.knowledge import KNOWABLE, Kind
from antennate.control.readers import HARDWARE_ALONE, unread_by_all
from antennate.control.readings import (
    KINDS,
    OWN,
    YOKED,
    check_readings,
    condition,
    require_whole_delay,
)
from antennate.control.registry import BUILT_IN, CONTROLLERS, USUAL
from antennate.params.base import number, require_different, require_whole_steps
from antennate.params.control import ControlParams
from antennate.sim.trial import TrialConfig, require_own_curves


class TunnelConfig(TrialConfig):
    """Everything that decides the outcome of `antennate tunnel`."""

    unread: ClassVar[tuple[str, ...]] = HARDWARE_ALONE
    trials: int = number(
        30, "1", "assumed: the paper's ten leave an interval of half the range", ge=1, le=100000
    )
    """Trials of every controller."""
    controllers: tuple[str, ...] = number(
        USUAL,
        "1",
        "assumed: without touch, with the published rule and with ours",
        min_length=1,
        examples=[*BUILT_IN],
    )
    """Controllers to run: open, timed, paper, closed, closed-1, schedule, zigzag, random, map, or
    MODULE:NAME or FILE.py:NAME of your own."""
    readings: tuple[str, ...] = number(
        (OWN,), "1", "assumed: what the robot reads", min_length=1, examples=[*KINDS]
    )
    """What each controller is given to read: own, none, swapped, delayed:S or yoked."""
    knows: tuple[Kind, ...] = number(
        (), "1", "assumed: a robot knows nothing but its readings", examples=list(KNOWABLE)
    )
    """What the simulation gives to controllers that can use it."""
    time_limit: float | None = number(
        None, "s", "paper: 0.04 m/s without feedback; half of that on 2 m, 100 s", gt=0, le=3600
    )
    """Time after which a trial has failed; that of its scene if not given."""
    control: ControlParams = ControlParams()

    @field_validator("controllers")
    @classmethod
    def _names(cls, names: tuple[str, ...]) -> tuple[str, ...]:
        return tuple(map(CONTROLLERS.check, names))

    @field_validator("readings")
    @classmethod
    def _known_readings(cls, names: tuple[str, ...]) -> tuple[str, ...]:
        return tuple(map(check_readings, names))

    @property
    def conditions(self) -> tuple[str, ...]:
        """Each controller with each of the readings, by name."""
        return tuple(condition(name, given) for name in self.controllers for given in self.readings)

    def following(self, trial: int) -> int:
        """The trial after one; the first after the last."""
        return (trial + 1) % self.trials

    def unread_here(self) -> Mapping[str, str]:
        """What this robot does not have, and what none of the controllers reads."""
        control = unread_by_all(self.controllers, self.control, self.robot, self.knows)
        return {**super().unread_here(), **control}

    @model_validator(mode="after")
    def _agree(self) -> TunnelConfig:
        require_different("controllers", self.controllers)
        require_different("knows", self.knows)
        if {"side", "map"} <= set(self.knows):
            raise ValueError("knows: expected side or map, found both; map tells the side, too")
        require_different("readings", self.readings)
        for name in self.readings:
            require_whole_delay(name, self.control.period)
        if YOKED in self.readings and self.trials < 2:
            raise ValueError(
                f"readings {YOKED} are those of the next trial: expected trials of at least 2, "
                f"found {self.trials}"
            )
        require_whole_steps("control.rate", self.control.rate, self.physics.timestep)
        require_own_curves(self.robot, self.control)
        return self
