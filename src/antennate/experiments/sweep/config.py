"""Everything that decides the outcome of `bench sweep`."""

from __future__ import annotations

import math
from typing import Annotated, ClassVar

from pydantic import Field, model_validator

from antennate.antenna.statics import PROFILES, Profile
from antennate.params.base import Params, number, require_different, require_whole_steps
from antennate.params.bench import EstimateParams, ShapeParams, Solver, SweepParams, solver
from antennate.params.control import ConditioningParams
from antennate.params.scene import BenchPhysicsParams
from antennate.robots.antenna import AntennaSpec
from antennate.sim.chain import require_read


class SweepConfig(Params):
    """Everything that decides the outcome of `bench sweep`."""

    unread: ClassVar[tuple[str, ...]] = (
        "antenna.base_angle",
        *(f"conditioning.{n}" for n in ConditioningParams.model_fields if n != "averaging_time"),
    )
    seed: int = number(0, "1", "assumed: any", ge=0)
    """Seed of all chance."""
    profiles: tuple[Profile, ...] = number(
        tuple(PROFILES), "1", "assumed: the paper's three and both controls", min_length=1
    )
    """Profiles of the map."""
    profile: Profile = number("descending", "1", "paper: the robot's profile")
    """Profile of the estimates."""
    distances: tuple[float, ...] = number(
        (0.35, 0.5, 0.65, 0.8, 0.95), "1", "assumed: up to nearly out of reach", min_length=1
    )
    """Distances of the wall, over the length of the antenna."""
    centres: tuple[Annotated[float, Field(ge=0, le=2.0)], ...] = number(
        tuple(math.radians(a) for a in (47.0, 70.0, 90.0)),
        "rad",
        "assumed: the mounting angle, and on to sideways",
        min_length=1,
    )
    """Centres of the sweep."""
    amplitudes: tuple[Annotated[float, Field(gt=0, le=1.5)], ...] = number(
        tuple(math.radians(a) for a in (15.0, 30.0, 45.0)),
        "rad",
        "assumed: half and one and a half times the default",
        min_length=1,
    )
    """Amplitudes of the sweep."""
    sweeps: int = number(2, "1", "assumed: they repeat; one before them is left out", ge=1, le=100)
    """Sweeps measured."""
    speed: float = number(
        0.05, "m/s", "assumed: slowly; under half of the paper's 0.12 m/s", gt=0, le=1
    )
    """Speed of the base along the wall where it moves."""
    points: bool = number(False, "1", "assumed: a large file that few need")
    """Whether to save the points of the antenna of `profile` in every cell, for `tracks`."""
    solver: Solver = solver()
    """What steps the physics: the engine, or the chain solver (extra `fast`; compiles once)."""
    sweep: SweepParams = SweepParams()
    shape: ShapeParams = ShapeParams()
    estimate: EstimateParams = EstimateParams()
    antenna: AntennaSpec = AntennaSpec()
    conditioning: ConditioningParams = ConditioningParams()
    physics: BenchPhysicsParams = BenchPhysicsParams()

    @model_validator(mode="after")
    def _agree(self) -> SweepConfig:
        require_whole_steps("antenna.sensor.rate", self.antenna.sensor.rate, self.physics.timestep)
        require_different("profiles", self.profiles)
        require_read(self.solver, self.physics)
        least = self.antenna.radius / self.antenna.length
        for what, values in (
            ("distances", self.distances),
            ("estimate.distance", self.estimate.distance),
        ):
            if min(values) <= least:
                raise ValueError(
                    f"{what} must exceed the antenna's radius, {least:g} of its length, "
                    f"found {min(values):g}"
                )
        if not self.estimate.distance[0] < self.estimate.distance[1]:
            raise ValueError(f"estimate.distance must rise, found {self.estimate.distance}")
        return self
