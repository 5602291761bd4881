"""Films of `antennate gait`: each maneuver on the flat floor, walked once more."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from antennate.experiments.gait.run import MANEUVERS, GaitStudyConfig, walk_flat
from antennate.sim.world import World
from antennate.telemetry import film
from antennate.telemetry.film import Film, WalkRecorder
from antennate.types import AntennaFrame, Maneuver


def films(config: GaitStudyConfig, trial: int) -> dict[str, Callable[[], Film]]:
    """A film of each maneuver; walks have no chance, so that `trial` says nothing."""
    return {m.name.lower(): partial(record, config, m) for m in MANEUVERS}


def record(config: GaitStudyConfig, maneuver: Maneuver) -> Film:
    """Walk one maneuver and record it.

    Raises:
        SimulationError: The physics became invalid.
    """
    recorder = WalkRecorder(config.robot, width=2.2)

    def watch(world: World, frame: AntennaFrame) -> None:
        recorder.see(world, world.t, counts=frame.counts[0], centre=world.links().mean(axis=0))

    walk_flat(config, maneuver.name.lower(), config.gait, maneuver, watch)
    way = recorder.values("centre") - recorder.values("centre")[0]
    return recorder.walk(
        maneuver.name,
        [film.trace("way of the middle: x, y [m]", way)],
        [film.maneuver_band(np.full(len(recorder), int(maneuver)))],
    )
