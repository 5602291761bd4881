"""What `antennate tunnel` is told."""

from __future__ import annotations

from pydantic import field_validator, model_validator

from antennate.control.registry import BUILT_IN, CONTROLLERS
from antennate.params import ControlParams, number
from antennate.sim.trial import TrialConfig


class TunnelConfig(TrialConfig):
    """Everything that decides the outcome of `antennate tunnel`."""

    trials: int = number(
        30,
        "1",
        "assumed: the paper's ten leave an interval of half the range",
        "trials of every controller",
        ge=1,
        le=100000,
    )
    controllers: tuple[str, ...] = number(
        tuple(BUILT_IN),
        "1",
        "assumed: all of ours",
        "controllers to run: open, paper, closed, or MODULE:NAME or FILE.py:NAME of your own",
        min_length=1,
        examples=["open", "paper", "closed"],
    )
    time_limit: float = number(
        100.0,
        "s",
        "paper: open loop made 0.04 m/s over its successes; half of that on 2 m takes this long",
        "time after which a trial has failed",
        gt=0,
        le=3600,
    )
    control: ControlParams = ControlParams()

    @field_validator("controllers")
    @classmethod
    def _names(cls, names: tuple[str, ...]) -> tuple[str, ...]:
        return tuple(map(CONTROLLERS.check, names))

    @model_validator(mode="after")
    def _agree(self) -> TunnelConfig:
        if len(set(self.controllers)) < len(self.controllers):
            raise ValueError(f"controllers must differ, got {', '.join(self.controllers)}")
        steps = self.control.period / self.physics.timestep
        if abs(steps - round(steps)) > 1e-6:
            raise ValueError(
                "control.rate must be a whole fraction of the physics rate "
                f"{1 / self.physics.timestep:g} Hz, got {self.control.rate:g} Hz"
            )
        return self
