"""The tunnel: does touch help? All controllers meet the same tunnels, starts and disturbances."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from antennate.control.registry import make_controller
from antennate.errors import ConfigError
from antennate.experiments.tunnel import measures
from antennate.experiments.tunnel.batch import Emit, run_trials
from antennate.experiments.tunnel.config import TunnelConfig
from antennate.experiments.tunnel.monitor import TrialPath, TrialResult
from antennate.sim.scenes.registry import TUNNEL
from antennate.sim.trial import check_start
from antennate.sim.world import World
from antennate.studies.experiment import OnRow, OnStep, no_row, no_step
from antennate.studies.pool import run_tasks
from antennate.telemetry.view.pace import Restart
from antennate.telemetry.view.simulation import SimulationView
from antennate.types import AntennaFrame, Controller

_TASK = 12
"""Most trials handed to a process at once."""


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
        by_name = {
            name: [row for row in self.rows if row.controller == name]
            for name in config.controllers
        }
        return {
            "schema": 2,
            "command": "tunnel",
            "seed": config.seed,
            "scene": config.scene,
            "time_limit_s": config.time_limit,
            "length_m": config.tunnel.length if config.scene == TUNNEL else None,
            "interrupted": self.interrupted,
            "controllers": {n: measures.summary(rows) for n, rows in by_name.items()},
            "paired": measures.paired(by_name),
        }


def check(config: TunnelConfig) -> None:
    """Find a bad scene or controller before anything is run.

    Raises:
        ConfigError: There is no such scene or controller, or it cannot be made.
        SceneError: The scene cannot be built, or the robot does not fit at its start.
    """
    check_start(config)
    for name in config.controllers:
        try:
            make_controller(name, config.control, config.robot)
        except ConfigError as error:
            raise ConfigError(f"--controllers: {error}") from error


_Task = tuple[TunnelConfig, str, list[int], Path | None]
"""Configuration, name of the controller, trials, folder for their logs."""


def _run_task(task: _Task, emit: Callable[[Any], None]) -> None:
    config, name, trials, logs = task
    run_trials(config, name, trials, emit, logs=logs)


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
    workers: int = 1,
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
        WorkerError: A worker process died.
    """
    total = config.trials * len(config.controllers)
    size = max(1, min(_TASK, math.ceil(total / (3 * workers))))
    chunks = [
        list(range(first, min(first + size, config.trials)))
        for first in range(0, config.trials, size)
    ]
    tasks = [(config, name, chunk, logs) for name in config.controllers for chunk in chunks]
    found: list[tuple[TrialResult, TrialPath]] = []

    def take(item: tuple[TrialResult, TrialPath]) -> None:
        found.append(item)
        on_row(item[0])
        on_step(len(found), total)

    interrupted = False
    try:
        if view is None:
            run_tasks(_run_task, tasks, workers, take)
        else:
            for name in config.controllers:
                for trial in range(config.trials):
                    _run_viewed(config, name, trial, take, logs, view)
    except KeyboardInterrupt:
        interrupted = True
    order = {name: i for i, name in enumerate(config.controllers)}
    found.sort(key=lambda item: (order[item[0].controller], item[0].trial))
    return TunnelOutcome(
        config=config,
        rows=[row for row, _ in found],
        paths={(row.controller, row.trial): path for row, path in found},
        interrupted=interrupted,
    )
