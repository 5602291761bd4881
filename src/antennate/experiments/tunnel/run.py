"""The tunnel: does touch help? All controllers meet the same tunnels, starts and disturbances."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from pydantic import field_validator, model_validator

from antennate.control.loop import run_loop
from antennate.control.registry import BUILT_IN, CONTROLLERS, make_controller
from antennate.experiments.tunnel import measures
from antennate.experiments.tunnel.monitor import TrialMonitor, TrialPath, TrialResult
from antennate.params import ControlParams, number
from antennate.params.base import require_different, require_whole_steps
from antennate.robots.spec import HARDWARE_ALONE
from antennate.sim.scenes.registry import make_scene
from antennate.sim.sim_robot import SimRobot
from antennate.sim.trial import TrialConfig, draw_trial
from antennate.studies.pool import run_tasks
from antennate.types import AntennaFrame, JointCommand

SCHEMA = 2
_BATCH = 6
"""Trials of one process stepped in lockstep: one NumPy call serves them all."""
_TASK = 12
"""Most trials handed to a process at once."""


class TunnelConfig(TrialConfig):
    """Everything that decides the outcome of `antennate tunnel`."""

    unread: ClassVar[tuple[str, ...]] = HARDWARE_ALONE
    trials: int = number(
        30,
        "1",
        "assumed: the paper's ten leave an interval of half the range",
        "trials of every controller",
        ge=1,
        le=100000,
    )
    controllers: tuple[str, ...] = number(
        tuple(BUILT_IN),
        "1",
        "assumed: all of ours",
        "controllers to run: open, paper, closed, or MODULE:NAME or FILE.py:NAME of your own",
        min_length=1,
    )
    time_limit: float = number(
        100.0,
        "s",
        "paper: open loop made 0.04 m/s over its successes; half of that on 2 m takes this long",
        "time after which a trial has failed",
        gt=0,
        le=3600,
    )
    control: ControlParams = ControlParams()

    @field_validator("controllers")
    @classmethod
    def _names(cls, names: tuple[str, ...]) -> tuple[str, ...]:
        return tuple(map(CONTROLLERS.check, names))

    @model_validator(mode="after")
    def _agree(self) -> TunnelConfig:
        require_different("controllers", self.controllers)
        require_whole_steps("control.rate", self.control.rate, self.physics.timestep)
        return self


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
            "schema": SCHEMA,
            "command": "tunnel",
            "seed": config.seed,
            "time_limit_s": config.time_limit,
            "length_m": config.tunnel.length,
            "interrupted": self.interrupted,
            "controllers": {n: measures.summary(rows) for n, rows in by_name.items()},
            "paired": measures.paired(by_name),
        }


def run_trials(
    config: TunnelConfig,
    controller: str,
    trials: Sequence[int],
    emit: Callable[[tuple[TrialResult, TrialPath]], None],
    batch: int = _BATCH,
) -> None:
    """Run trials of one controller in lockstep; rows are refilled and emitted as trials end."""
    batch = min(batch, len(trials))
    control = make_controller(controller, config.control, config.robot, batch)
    body = SimRobot(batch, config.robot, config.control.period, config.physics.timestep)
    scene = make_scene(config.scene, config.tunnel)
    waiting = list(trials)
    monitors: list[TrialMonitor | None] = [None] * batch

    def fill(row: int) -> None:
        body.unload(row)
        monitors[row] = None
        if waiting:
            trial = waiting.pop(0)
            start = draw_trial(config, scene, trial, config.control.gait, config.control.period)
            body.load(row, start.world, start.chance)
            control.reset(np.array([row]), start.phase)
            before = start.world.outlines()[1]
            monitors[row] = TrialMonitor(
                config.seed, trial, controller, start.scene, before, config.time_limit
            )

    def go_on(frame: AntennaFrame, command: JointCommand) -> bool:
        for row, monitor in enumerate(monitors):
            if monitor is None:
                continue
            world, failure = body.world(row), body.failure(row)
            outcome = monitor.watch(world, int(control.maneuver[row]), failure is not None)
            if outcome is not None:
                emit((monitor.result(world, outcome, str(failure or "")), monitor.path(world)))
                fill(row)
        return any(monitor is not None for monitor in monitors)

    for row in range(batch):
        fill(row)
    run_loop(body, control, config.control.period, go_on)


def _run_task(task: tuple[TunnelConfig, str, list[int]], emit: Callable[[Any], None]) -> None:
    run_trials(*task, emit)


def run(
    config: TunnelConfig,
    workers: int = 1,
    on_step: Callable[[int, int], None] = lambda done, total: None,
    on_row: Callable[[TrialResult], None] = lambda row: None,
) -> TunnelOutcome:
    """Run all trials of all controllers.

    Args:
        config: What to run.
        workers: Processes to use; the outcome does not depend on it.
        on_step: Called after every trial with how many of how many are done.
        on_row: Called with every trial, in no particular order.

    Raises:
        SceneError: A scene cannot be built as described.
        WorkerError: A worker process died.
    """
    total = config.trials * len(config.controllers)
    size = max(1, min(_TASK, math.ceil(total / (3 * workers))))
    chunks = [
        list(range(first, min(first + size, config.trials)))
        for first in range(0, config.trials, size)
    ]
    tasks: list[tuple[TunnelConfig, str, list[int]]] = [
        (config, name, chunk) for name in config.controllers for chunk in chunks
    ]
    found: list[tuple[TrialResult, TrialPath]] = []

    def take(item: tuple[TrialResult, TrialPath]) -> None:
        found.append(item)
        on_row(item[0])
        on_step(len(found), total)

    interrupted = False
    try:
        run_tasks(_run_task, tasks, workers, take)
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
