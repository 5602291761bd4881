"""What `antennate tunnel` is told."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from pydantic import field_validator, model_validator

from antennate.control.readers import unread_by_all
from antennate.control.registry import CONTROLLERS, USUAL
from antennate.params.base import number, require_different, require_whole_steps
from antennate.params.control import ControlParams
from antennate.robots.readers import HARDWARE_ALONE
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
        "assumed: all of ours",
        min_length=1,
        examples=["open", "paper", "closed"],
    )
    """Controllers to run: open, paper, closed, or MODULE:NAME or FILE.py:NAME of your own."""
    time_limit: float | None = number(
        None, "s", "paper: 0.04 m/s without feedback; half of that on 2 m, 100 s", gt=0, le=3600
    )
    """Time after which a trial has failed; that of its scene if not given."""
    control: ControlParams = ControlParams()

    @field_validator("controllers")
    @classmethod
    def _names(cls, names: tuple[str, ...]) -> tuple[str, ...]:
        return tuple(map(CONTROLLERS.check, names))

    def unread_here(self) -> Mapping[str, str]:
        """What this robot does not have, and what none of the controllers reads."""
        control = unread_by_all(self.controllers, self.control, self.robot)
        return {**super().unread_here(), **control}

    @model_validator(mode="after")
    def _agree(self) -> TunnelConfig:
        require_different("controllers", self.controllers)
        require_whole_steps("control.rate", self.control.rate, self.physics.timestep)
        require_own_curves(self.robot, self.control)
        return self
