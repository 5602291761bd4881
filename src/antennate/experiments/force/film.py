"""Films of `antennate force`: the middle traverse of each profile past the post, in slow motion."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from antennate.experiments.bench import BenchRecorder
from antennate.experiments.force.loads import ForceConfig
from antennate.experiments.force.run import traverse
from antennate.telemetry.film import Film

_SPEED = 0.25
"""Speed of the film over that of the base: a picture for each sample at 100 Hz."""


def films(config: ForceConfig, trial: int) -> dict[str, Callable[[], Film]]:
    """A film of each profile; there is but one trial."""
    return {profile: partial(record, config, profile) for profile in config.profiles}


def record(config: ForceConfig, profile: str) -> Film:
    """Drag the antenna past the post, and record it.

    Raises:
        BadInputError: The physics became invalid at once.
    """
    recorder = BenchRecorder(config.antenna, _SPEED)
    row, _ = traverse(config, profile, config.traverses // 2, recorder.watch)
    invalid = f": {row.status}" if row.reason else ""
    return recorder.film(f"{profile}, {1 / _SPEED:g} times slower{invalid}", "post")
