"""The tunnel: does touch help? All controllers meet the same tunnels, starts and disturbances."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from antennate.control.knowledge import Kind, given_to
from antennate.control.readings import YOKED, parts_of, short_names
from antennate.control.registry import make_controller
from antennate.errors import ConfigError
from antennate.experiments.tunnel.batch import BATCH, on_cpu, run_trials
from antennate.experiments.tunnel.lockstep import Apparatus, Emit, lost_row
from antennate.experiments.tunnel.physics import TrialResult, TunnelConfig
from antennate.experiments.tunnel.result import TunnelResult, summarise
from antennate.experiments.tunnel.tables import sentence, tables
from antennate.sim.scenes.registry import TUNNEL
from antennate.sim.trial import check_start, draw_scene, scene_of
from antennate.sim.world import World
from antennate.studies.experiment import Experiment, checked
from antennate.studies.trials import Batches, Found, Trial, Trials
from antennate.telemetry.header import log_name
from antennate.types import AntennaFrame, Controller

if TYPE_CHECKING:
    from antennate.telemetry.film import Film


def check(config: TunnelConfig) -> None:
    """Find a bad scene or controller before anything is run."""
    check_start(config)
    given: dict[Kind, None] = {}
    for name in config.controllers:
        try:
            made = make_controller(name, config.control, config.robot)
        except ConfigError as error:
            where = "" if str(error).startswith("control.") else "--controllers: "
            raise ConfigError(f"{where}{error}") from error
        given |= dict.fromkeys(given_to(made, name, config.knows))
    if given:
        from antennate.sim.knowledge import require_route  # not of robots that know nothing

        require_route(config.scene, draw_scene(config, scene_of(config), 0), list(given))


def every(config: TunnelConfig) -> list[Trial]:
    """All trials, condition by condition."""
    return [(name, trial) for name in config.conditions for trial in range(config.trials)]


def tasks(config: TunnelConfig) -> list[tuple[str, int, int]]:
    """What each task is: its condition, its trial, and that whose readings it is given.

    With more trials the one that was last is followed by another, so its yoked run is a new task.
    """
    return [
        (name, trial, config.following(trial) if parts_of(name)[1] == YOKED else trial)
        for name, trial in every(config)
    ]


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
    """Run one trial and record it."""
    from antennate.telemetry.film import WalkRecorder  # slow to import

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

    seen = Apparatus(watch=watch)
    run_trials(config, controller, [trial], lambda result: rows.append(result[0]), apparatus=seen)
    title = f"{label}, trial {trial}: {rows[0].outcome} ({speed:g}×)"
    return recorder.decided(title, config.control.rule.threshold, ending(rows[0], config))


def ending(row: TrialResult, config: TunnelConfig) -> str:
    """A word on what came out, and when."""
    there = "out" if config.scene == TUNNEL else "there"
    words = {
        "success": there,
        "timeout": "stuck" if row.stuck > row.recovered else f"not {there}",
        "left": "left the scene",
        "overturned": "overturned",
        "fell": "fell",
        "invalid": "invalid",
    }
    return f"{words[row.outcome]} after {row.time_s:.3g} s"


CAPTIONS = {
    "trajectories": "Trials from above, the first five at most: the panels of a trial together, "
    "one for each controller, coloured by maneuver.",
    "summary": "Success of each controller with its Wilson 95 % interval, time in the scene, and "
    "restricted mean time, with a 95 % interval from five trials on.",
}


def on_warp(
    config: TunnelConfig,
    condition: str,
    trials: Sequence[int],
    emit: Emit,
    device: str | None,
    logs: Path | None,
) -> None:
    """Run trials of one condition in batches on a GPU."""
    if logs is not None:
        raise ConfigError("--log: expected another engine, found warp, which keeps no logs")
    if YOKED in config.readings:
        raise ConfigError(f"--readings {YOKED}: expected another engine, found warp")
    from antennate.experiments.tunnel.warp import run_trials_on_warp  # needs a GPU

    run_trials_on_warp(config, condition, trials, emit, device=device)


def _result_of(found: Found[TunnelConfig, TunnelResult, object]) -> TunnelResult:
    return summarise(found.config, found.frame)


EXPERIMENT = Experiment.of_folder(
    __name__,
    TunnelConfig,
    Trials[TunnelConfig](
        Batches(on_cpu, BATCH, on_warp),
        row=TrialResult,
        summarise=_result_of,
        every=every,
        invalid=lost_row,
    ),
    tables,
    sentence,
    result=TunnelResult,
    settled=checked(check),
    films=films,
    logs=lambda config: [log_name(f"{name}-{trial}") for name, trial in every(config)],
    tasks=tasks,
    captions=CAPTIONS,
)
