"""Films of `antennate tunnel`: one trial of each controller, run once more."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from antennate.control.readings import short_names
from antennate.experiments.tunnel.batch import run_trials
from antennate.experiments.tunnel.config import TunnelConfig
from antennate.experiments.tunnel.monitor import TrialResult
from antennate.sim.scenes.registry import TUNNEL
from antennate.sim.world import World
from antennate.telemetry.film import Film, WalkRecorder
from antennate.types import AntennaFrame, Controller

SPEED = 2.0
"""Films are so many times faster than the robot."""


def films(config: TunnelConfig, trial: int) -> dict[str, Callable[[], Film]]:
    """A film of each controller."""
    return {
        label: partial(record, config, name, trial, label)
        for name, label in short_names(config.conditions).items()
    }


def record(
    config: TunnelConfig, controller: str, trial: int, label: str, speed: float = SPEED
) -> Film:
    """Run one trial and record it.

    Raises:
        BadInputError: The controller failed at its first tick.
    """
    recorder, rows = WalkRecorder(config.robot, speed), list[TrialResult]()

    def watch(world: World, frame: AntennaFrame, control: Controller) -> tuple[()]:
        recorder.see(
            world,
            world.t,
            counts=frame.counts[0],
            level=control.level[0],
            contact=control.contact[0],
            maneuver=control.maneuver[0],
        )
        return ()

    run_trials(config, controller, [trial], lambda found: rows.append(found[0]), watch=watch)
    title = f"{label}, trial {trial}: {rows[0].outcome} ({speed:g}×)"
    return recorder.decided(title, config.control.rule.threshold, ending(rows[0], config))


def ending(row: TrialResult, config: TunnelConfig) -> str:
    """A word on what came out, and when."""
    there = "out" if config.scene == TUNNEL else "there"
    words = {
        "success": there,
        "timeout": "stuck" if row.stuck > row.recovered else f"not {there}",
        "left": "left the scene",
        "invalid": "invalid",
    }
    return f"{words[row.outcome]} after {row.time_s:.3g} s"
