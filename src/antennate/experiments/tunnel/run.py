"""The tunnel: does touch help? All controllers meet the same tunnels, starts and disturbances."""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from antennate.control.knowledge import Kind, given_to
from antennate.control.readings import YOKED, parts_of
from antennate.control.registry import make_controller
from antennate.errors import ConfigError
from antennate.experiments.tunnel import measures
from antennate.experiments.tunnel.batch import BATCH, Emit, lost_row, run_trials
from antennate.experiments.tunnel.config import TunnelConfig
from antennate.experiments.tunnel.monitor import TrialPath, TrialResult
from antennate.sim.knowledge import require_route
from antennate.sim.scenes.registry import TUNNEL
from antennate.sim.trial import check_start, draw_scene, scene_of
from antennate.sim.world import World
from antennate.studies.experiment import OnRow, OnStep, Trial, no_row, no_step
from antennate.studies.pool import Workers, chunk_of, gather
from antennate.studies.work import Fail, Failure, no_failure
from antennate.telemetry.view.pace import Restart
from antennate.telemetry.view.simulation import SimulationView
from antennate.types import AntennaFrame, Controller

_Found = tuple[TrialResult, TrialPath | None]


@dataclass(frozen=True, slots=True)
class TunnelOutcome:
    """All rows in the order of controllers and trials, and what figures need of them."""

    config: TunnelConfig
    rows: list[TrialResult]
    paths: dict[tuple[str, int], TrialPath]
    interrupted: bool

    def result(self) -> dict[str, Any]:
        """The content of result.json."""
        config = self.config
        shared = measures.limit_of(self.rows, config.time_limit)
        by_name = {
            name: [row for row in self.rows if row.controller == name] for name in config.conditions
        }
        return {
            "schema": 2,
            "command": "tunnel",
            "seed": config.seed,
            "scene": config.scene,
            "knows": list(config.knows),
            "time_limit_s": shared,
            "length_m": config.tunnel.length if config.scene == TUNNEL else None,
            "interrupted": self.interrupted,
            "controllers": {name: measures.summary(rows, shared) for name, rows in by_name.items()},
            "paired": measures.paired(by_name, shared),
        }


def check(config: TunnelConfig) -> None:
    """Find a bad scene or controller before anything is run.

    Raises:
        ConfigError: There is no such scene or controller, or it cannot be made.
        SceneError: The scene cannot be built, or the robot does not fit at its start.
    """
    check_start(config)
    given: dict[Kind, None] = {}
    for name in config.controllers:
        try:
            made = make_controller(name, config.control, config.robot)
        except ConfigError as error:
            raise ConfigError(f"--controllers: {error}") from error
        given |= dict.fromkeys(given_to(made, name, config.knows))
    if given:
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


def run_rows(
    config: TunnelConfig, trials: Sequence[Trial], emit: Callable[[int, Any], None]
) -> None:
    """Run some trials; emit the index and the row of each."""
    _run([(config, *trial, None) for trial in trials], lambda i, found: emit(i, found[0]))


def run_on_device(
    config: TunnelConfig,
    trials: Sequence[Trial],
    emit: Callable[[int, Any], None],
    device: str | None,
) -> None:
    """As `run_rows`, on a GPU.

    Raises:
        ConfigError: There is none.
    """
    tasks: list[_Task] = [(config, *trial, None) for trial in trials]
    _run_batched(tasks, lambda i, found: emit(i, found[0]), no_failure, device)


RunTrials = Callable[[TunnelConfig, str, Sequence[int], Emit], None]
"""Runs trials of one controller, and emits each as it ends."""
_Task = tuple[TunnelConfig, str, int, Path | None]
"""Configuration, name of the controller, trial, folder for its log."""


def _run(
    tasks: Sequence[_Task], emit: Callable[[int, _Found], None], run: RunTrials | None = None
) -> None:
    """Run trials, those of one controller in lockstep."""
    places = {(name, trial): i for i, (_, name, trial, _) in enumerate(tasks)}
    config, _, _, logs = tasks[0]
    run = run or functools.partial(run_trials, logs=logs)
    for name in dict.fromkeys(name for name, _ in places):
        numbers = [trial for controller, trial in places if controller == name]

        def take(found: _Found) -> None:
            emit(places[found[0].controller, found[0].trial], found)

        run(config, name, numbers, take)


def _run_batched(
    tasks: Sequence[_Task], emit: Callable[[int, _Found], None], fail: Fail, device: str | None
) -> None:
    """The same on a GPU; what fails is an invalid row, and nothing is told to `fail`."""
    from antennate.experiments.tunnel.warp import run_trials_on_warp

    if tasks[0][3] is not None:
        raise ConfigError("--log: expected another engine, found warp, which keeps no logs")
    if YOKED in tasks[0][0].readings:
        raise ConfigError(f"--readings {YOKED}: expected another engine, found warp")
    _run(tasks, emit, functools.partial(run_trials_on_warp, device=device))


def _lost(config: TunnelConfig, trial: Trial, failure: Failure) -> _Found:
    """What is told of a trial whose worker died, or that did not end."""
    if failure.status == "failed":
        raise failure.raised()
    name, number = trial
    key = config.seed, number, name
    return lost_row(key, config, failure.reason), None


def _run_viewed(
    config: TunnelConfig, name: str, trial: int, emit: Emit, logs: Path | None, view: SimulationView
) -> None:
    """One trial on a page; begun anew with another seed whenever a person wants that."""

    def watch(world: World, frame: AntennaFrame, control: Controller) -> Sequence[str]:
        return view.tick(world.model, world.data, frame, control)

    while True:
        view.begin(f"{name}, trial {trial}", config.seed)
        try:
            run_trials(config, name, [trial], emit, logs=logs, watch=watch, make=view.controller)
        except Restart as wish:
            config = config.model_copy(update={"seed": wish.seed})
        else:
            return


def run(
    config: TunnelConfig,
    workers: int | Workers = 1,
    on_step: OnStep = no_step,
    on_row: OnRow = no_row,
    logs: Path | None = None,
    view: SimulationView | None = None,
) -> TunnelOutcome:
    """Run all trials of all controllers, with the log of each in a folder if one is given.

    With a view they run in this process, one after the other, and give the same.

    Raises:
        LogError: A log cannot be written.
        SceneError: A scene cannot be built as described.
        WorkerError: A worker process failed.
    """
    trials = every(config)
    size = chunk_of(len(trials), workers, BATCH)
    found: list[_Found] = []

    def take(item: _Found) -> None:
        found.append(item)
        on_row(item[0])

    interrupted = False
    try:
        if view is None:
            gather(
                *(_run, [(config, *trial, logs) for trial in trials], workers, on_step, take),
                chunk=size,
                together=True,
                batched=_run_batched,
                lost=lambda place, failure: _lost(config, trials[place], failure),
            )
        else:
            for done, trial in enumerate(trials, start=1):
                _run_viewed(config, *trial, take, logs, view)
                on_step(done, len(trials))
    except KeyboardInterrupt:
        interrupted = True
    order = {name: i for i, name in enumerate(config.conditions)}
    found.sort(key=lambda item: (order[item[0].controller], item[0].trial))
    return TunnelOutcome(
        config=config,
        rows=[row for row, _ in found],
        paths={(row.controller, row.trial): path for row, path in found if path is not None},
        interrupted=interrupted,
    )
