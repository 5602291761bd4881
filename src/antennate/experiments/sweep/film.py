"""Films of `antennate sweep`: each profile in the middle cell of the map, its base at rest."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial

from antennate.antenna.statics import Profile
from antennate.experiments.bench import BenchRecorder
from antennate.experiments.sweep.config import SweepConfig
from antennate.experiments.sweep.run import map_cell
from antennate.telemetry.film import Film


def films(config: SweepConfig, trial: int) -> dict[str, Callable[[], Film]]:
    """A film of each profile; there is but one trial."""
    return {profile: partial(record, config, profile, trial) for profile in config.profiles}


def record(config: SweepConfig, profile: Profile, trial: int) -> Film:
    """Sweep in the middle cell of the map, and record it.

    Raises:
        BadInputError: The physics became invalid at once.
    """
    recorder = BenchRecorder(config.antenna)
    axes = (config.distances, config.centres, config.amplitudes)
    distance, centre, amplitude = (axis[len(axis) // 2] for axis in axes)
    cell = (profile, "fixed", trial, distance, centre, amplitude)
    row, _ = map_cell(config, *cell, recorder.watch)
    ends = [f"{math.degrees(centre + side * amplitude):.0f}" for side in (-1, 1)]
    invalid = f": {row.status}" if row.reason else ""
    return recorder.film(f"{profile}, {' to '.join(ends)} deg{invalid}", "wall")
