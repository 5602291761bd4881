"""Films of `antennate calibrate`: the first push of the rig at each speed, in slow motion."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from antennate.errors import ConfigError
from antennate.experiments.bench import BenchRecorder
from antennate.experiments.calibrate.run import CalibrateConfig, push
from antennate.telemetry.film import Film

_SPEED = 0.2
"""Speed of the film over that of the rod: the fastest push takes a third of a second."""


def films(config: CalibrateConfig, trial: int) -> dict[str, Callable[[], Film]]:
    """A film of each speed.

    Raises:
        ConfigError: There is a recording, and so no rig.
    """
    if config.recording is not None:
        raise ConfigError("video: expected the rig, which alone can be filmed, found a recording")
    speeds = enumerate(config.rig.speeds)
    return {f"{speed:g} m_s": partial(record, config, i) for i, speed in speeds}


def record(config: CalibrateConfig, which: int) -> Film:
    """Push once at one of the speeds, and record it.

    Raises:
        SimulationError: The physics became invalid.
    """
    recorder = BenchRecorder(config.antenna, _SPEED)
    push(config, which * config.rig.pushes, recorder.watch)
    speed = config.rig.speeds[which]
    return recorder.film(f"{speed:g} m/s, {1 / _SPEED:g} times slower", "rod")
