"""Film of `antennate ringdown`: the antenna after it is let go, in slow motion."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from antennate.experiments.bench import BenchRecorder
from antennate.experiments.ringdown.run import RingdownConfig, run
from antennate.telemetry.film import Film

_SPEED = 0.2
"""Speed of the film over that of the antenna: the robot's swings 3 times in 1.2 s."""


def films(config: RingdownConfig, trial: int) -> dict[str, Callable[[], Film]]:
    """The one film; there is but one trial."""
    return {"antenna": partial(record, config)}


def record(config: RingdownConfig) -> Film:
    """Let the antenna go, and record it.

    Raises:
        SimulationError: The physics became invalid.
    """
    recorder = BenchRecorder(config.antenna, _SPEED)
    run(config, recorder.watch)
    return recorder.film(f"let go, {1 / _SPEED:g} times slower", None, ".1f")
