"""Films of `antennate wall`: one trial of each profile, run once more."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial

import numpy as np

from antennate.antenna.statics import Profile
from antennate.experiments.wall.outcome import classify
from antennate.experiments.wall.run import WallConfig, passage
from antennate.sim.bench import Bench
from antennate.telemetry import film
from antennate.telemetry.film import Film, FilmRecorder


def films(config: WallConfig, trial: int) -> dict[str, Callable[[], Film]]:
    """A film of each profile."""
    return {profile: partial(record, config, profile, trial) for profile in config.profiles}


def record(config: WallConfig, profile: Profile, trial: int) -> Film:
    """Run one trial and record it.

    Raises:
        SimulationError: The physics became invalid.
    """
    recorder, models, start = FilmRecorder(), [], []

    def watch(bench: Bench) -> None:
        models[:] = [bench.model]
        start[:] = start or [bench.t]
        recorder.take(
            bench.t - start[0],
            bench.data.qpos,
            bench.joints().mean(axis=0),
            flex=[math.degrees(bench.flex())],
            force=[math.hypot(*bench.contact_force())],
            touching=[int(bench.touching())],
        )

    seen = passage(config, profile, trial, watch)
    outcome = classify(config.wall, config.seed, trial, profile, seen).outcome
    return recorder.film(
        f"{profile}, trial {trial}: {outcome}",
        models[0],
        film.bench_shot(config.antenna),
        [
            film.trace("flex [deg]", recorder.values("flex"), ".0f"),
            film.trace("force [N]", recorder.values("force")),
        ],
        film.contact_bands(np.array(recorder.values("touching")), ("wall",)),
    )
