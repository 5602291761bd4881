"""Everything that decides the outcome of the wall."""

from __future__ import annotations

import math
from typing import ClassVar

from pydantic import model_validator

from antennate.antenna.statics import PROFILES, Profile
from antennate.params.base import Params, number, require_different
from antennate.params.bench import BenchVariationParams, Solver, WallParams, solver
from antennate.params.scene import BenchPhysicsParams
from antennate.robots.antenna import AntennaSpec, SensorParams
from antennate.sim import chain

COMMAND_PERIOD = 0.002
"""Time between commands to the carriage [s]."""


class WallConfig(Params):
    """Everything that decides the outcome of `bench wall`."""

    unread: ClassVar[tuple[str, ...]] = (
        "antenna.base_angle",
        "antenna.base_spacing",
        *(f"antenna.sensor.{n}" for n in SensorParams.model_fields if n != "active_length"),
    )
    trials: int = number(20, "1", "paper: 20 trials a profile", ge=1, le=10000)
    """Trials of every profile."""
    seed: int = number(1, "1", "assumed: any", ge=0)
    """Seed of all chance."""
    profiles: tuple[Profile, ...] = number(
        tuple(PROFILES), "1", "paper: its three; assumed: two controls it lacks", min_length=1
    )
    """Profiles to run."""
    solver: Solver = solver()
    """What steps the physics: the engine, or the chain solver (extra `fast`; compiles once)."""
    wall: WallParams = WallParams()
    antenna: AntennaSpec = AntennaSpec()
    variation: BenchVariationParams = BenchVariationParams()
    physics: BenchPhysicsParams = BenchPhysicsParams()

    @model_validator(mode="after")
    def _sound(self) -> WallConfig:
        require_different("profiles", self.profiles)
        reach = self.antenna.length * math.sin(self.wall.base_angle)
        if self.wall.overlap + self.variation.overlap >= reach / 2:
            raise ValueError(
                f"wall.overlap must stay below half of the antenna's reach, {reach / 2:.4g} m, "
                f"found {self.wall.overlap:g} m"
            )
        if self.wall.travel <= max(self.wall.start + self.wall.jam_travel, self.wall.jam_travel):
            raise ValueError(
                f"wall.travel must exceed start and jam_travel together, "
                f"{self.wall.start + self.wall.jam_travel:g} m, found {self.wall.travel:g} m"
            )
        ratio = COMMAND_PERIOD / self.physics.timestep
        if abs(ratio - round(ratio)) > 1e-6 or round(ratio) < 1:
            raise ValueError(
                f"physics.timestep must divide {COMMAND_PERIOD:g} s, found "
                f"{self.physics.timestep:g}"
            )
        chain.require_read(self.solver, self.physics)
        return self
