"""Films of `bench touch`: one traverse of each profile along one wall, run once more."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from antennate.antenna.statics import Profile
from antennate.errors import BadInputError
from antennate.experiments.touch.config import TouchConfig
from antennate.experiments.touch.sensing import compare, readings
from antennate.experiments.touch.traverse import run_traverse
from antennate.sim.bench import Bench
from antennate.telemetry import film
from antennate.telemetry.film import Film, FilmRecorder
from antennate.types import Floats


def films(config: TouchConfig, trial: int) -> dict[str, Callable[[], Film]]:
    """A film of each profile, at the wall and the speed of the example."""
    return {profile: partial(record, config, profile, trial) for profile in config.profiles}


def record(config: TouchConfig, profile: Profile, trial: int) -> Film:
    """Run one traverse and record it; then the control reads it.

    Raises:
        BadInputError: The physics became invalid.
    """
    recorder, models, ticks = FilmRecorder(), [], 0
    wall, speed = config.example()

    def watch(bench: Bench) -> None:
        nonlocal ticks
        models[:] = [bench.model]
        middle = bench.joints().mean(axis=0)
        t = ticks / config.antenna.sensor.rate
        recorder.take(t, bench.data.qpos, middle, tick=ticks)
        ticks += 1

    traverse = run_traverse(config, wall, speed, profile, trial, watch)
    found = compare(config, [traverse])[0]
    if found is None:
        raise BadInputError(f"video: {profile}: the physics became invalid: {traverse.reason}")
    at = recorder.values("tick")

    def column(values: Floats) -> Floats:
        return values[at][:, np.newaxis]

    level = 1.0 / (1.0 + np.exp(-column(found.level)))
    states = np.stack([found.alarm[at], found.truth[at]], axis=1).astype(np.int64)
    return recorder.film(
        f"{profile}, {wall}, trial {trial}",
        models[0],
        film.bench_shot(config.antenna),
        [
            film.counts_trace(column(readings(config, [traverse])[:, 0])),
            film.level_trace(level, config.rule.threshold),
            film.trace("force [N]", column(traverse.force)),
        ],
        film.contact_bands(states, ("sensed", "true")),
    )
