"""Films of `bench wall`: one trial of each profile, run once more."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from antennate.antenna.statics import Profile
from antennate.experiments.bench_film import BenchRecorder
from antennate.experiments.wall.config import WallConfig
from antennate.experiments.wall.outcome import classify
from antennate.experiments.wall.passage import passage
from antennate.telemetry.film import Film


def films(config: WallConfig, trial: int) -> dict[str, Callable[[], Film]]:
    """A film of each profile."""
    return {profile: partial(record, config, profile, trial) for profile in config.profiles}


def record(config: WallConfig, profile: Profile, trial: int) -> Film:
    """Run one trial and record it.

    Raises:
        SimulationError: The physics became invalid.
    """
    recorder = BenchRecorder(config.antenna)
    seen = passage(config, profile, trial, recorder.watch)
    outcome = classify(config.wall, config.seed, trial, profile, seen).outcome
    return recorder.film(f"{profile}, trial {trial}: {outcome}", "wall")
