"""The tunnel: does touch help? All arms meet the same tunnels, starts and disturbances."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from itertools import combinations
from typing import Any

import numpy as np
from pydantic import model_validator

from antennate.control.controllers import ARMS, Arm, Controller
from antennate.control.loop import run_loop
from antennate.experiments.tunnel.monitor import TrialMonitor, TrialPath, TrialResult
from antennate.params import ControlParams, number
from antennate.sim.scenes.registry import make_scene
from antennate.sim.sim_robot import SimRobot
from antennate.sim.trial import TrialConfig, draw_trial
from antennate.studies import statistics
from antennate.studies.pool import run_tasks
from antennate.types import AntennaFrame, JointCommand

SCHEMA = 1
_BATCH = 6
"""Trials of one process stepped in lockstep: one NumPy call serves them all."""
_TASK = 12
"""Most trials handed to a process at once."""


class TunnelConfig(TrialConfig):
    """Everything that decides the outcome of `antennate tunnel`."""

    trials: int = number(
        10, "1", "paper: ten trials an arm", "trials of every arm", ge=1, le=100000
    )
    arms: tuple[Arm, ...] = number(ARMS, "1", "assumed: all", "arms to run", min_length=1)
    time_limit: float = number(
        100.0,
        "s",
        "paper: open loop made 0.04 m/s over its successes; half of that on 2 m takes this long",
        "time after which a trial has failed",
        gt=0,
        le=3600,
    )
    control: ControlParams = ControlParams()

    @model_validator(mode="after")
    def _agree(self) -> TunnelConfig:
        if len(set(self.arms)) < len(self.arms):
            raise ValueError(f"arms must differ, got {', '.join(self.arms)}")
        steps = self.control.period / self.physics.timestep
        if abs(steps - round(steps)) > 1e-6:
            raise ValueError(
                "control.rate must be a whole fraction of the physics rate "
                f"{1 / self.physics.timestep:g} Hz, got {self.control.rate:g} Hz"
            )
        return self


@dataclass(frozen=True, slots=True)
class TunnelOutcome:
    """All rows in the order of arms and trials, what figures need, and the summary per arm."""

    config: TunnelConfig
    rows: list[TrialResult]
    paths: dict[tuple[str, int], TrialPath]
    interrupted: bool

    def result(self) -> dict[str, Any]:
        """The content of result.json."""
        config = self.config
        by_arm: dict[Arm, list[TrialResult]] = {
            a: [r for r in self.rows if r.arm == a] for a in config.arms
        }
        return {
            "schema": SCHEMA,
            "command": "tunnel",
            "seed": config.seed,
            "time_limit_s": config.time_limit,
            "length_m": config.tunnel.length,
            "interrupted": self.interrupted,
            "arms": {a: summarise(rows, config.time_limit) for a, rows in by_arm.items()},
            "paired": _paired(by_arm),
        }


def run_trials(
    config: TunnelConfig,
    arm: Arm,
    trials: Sequence[int],
    emit: Callable[[tuple[TrialResult, TrialPath]], None],
    batch: int = _BATCH,
) -> None:
    """Run trials of one arm in lockstep, rows refilled as trials end; emit each as it ends."""
    batch = min(batch, len(trials))
    controller = Controller(config.control, arm, batch)
    body = SimRobot(batch, config.robot.sensor, config.control.period, config.physics.timestep)
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
            controller.reset(np.array([row]), start.phase)
            before = start.world.outlines()[1]
            monitors[row] = TrialMonitor(arm, trial, start.scene, before, config.time_limit)

    def go_on(frame: AntennaFrame, command: JointCommand) -> bool:
        for row, monitor in enumerate(monitors):
            if monitor is None:
                continue
            world, failure = body.world(row), body.failure(row)
            status = monitor.watch(world, int(controller.maneuver[row]), failure is not None)
            if status is not None:
                emit((monitor.result(world, status, str(failure or "")), monitor.path(world)))
                fill(row)
        return any(monitor is not None for monitor in monitors)

    for row in range(batch):
        fill(row)
    run_loop(body, controller, config.control.period, go_on)


def _run_task(task: tuple[TunnelConfig, Arm, list[int]], emit: Callable[[Any], None]) -> None:
    run_trials(*task, emit)


def run(
    config: TunnelConfig,
    workers: int = 1,
    on_trial: Callable[[TrialResult, TrialPath], None] = lambda row, path: None,
) -> TunnelOutcome:
    """Run all trials of all arms.

    Args:
        config: What to run.
        workers: Processes to use; the outcome does not depend on it.
        on_trial: Called after every trial, in no particular order.

    Raises:
        SceneError: A scene cannot be built as described.
        WorkerError: A worker process died.
    """
    size = max(1, min(_TASK, math.ceil(config.trials * len(config.arms) / (3 * workers))))
    chunks = [
        list(range(first, min(first + size, config.trials)))
        for first in range(0, config.trials, size)
    ]
    tasks: list[tuple[TunnelConfig, Arm, list[int]]] = [
        (config, arm, chunk) for arm in config.arms for chunk in chunks
    ]
    found: list[tuple[TrialResult, TrialPath]] = []

    def take(item: tuple[TrialResult, TrialPath]) -> None:
        found.append(item)
        on_trial(*item)

    interrupted = False
    try:
        run_tasks(_run_task, tasks, workers, take)
    except KeyboardInterrupt:
        interrupted = True
    found.sort(key=lambda item: (config.arms.index(item[0].arm), item[0].trial))
    return TunnelOutcome(
        config=config,
        rows=[row for row, _ in found],
        paths={(row.arm, row.trial): path for row, path in found},
        interrupted=interrupted,
    )


def summarise(rows: list[TrialResult], time_limit: float) -> dict[str, Any]:
    """One arm in numbers; invalid trials are counted and left out of every other figure."""
    valid = [r for r in rows if r.status != "invalid"]
    won = [r for r in valid if r.status == "success"]
    times = np.array([r.time_s for r in valid])
    mean, low, high = statistics.mean95(times)
    recovered, stuck = sum(r.recovered for r in valid), sum(r.stuck for r in valid)
    return {
        "trials": len(rows),
        "successes": len(won),
        "timeouts": sum(r.status == "timeout" for r in valid),
        "left": sum(r.status == "left" for r in valid),
        "invalid": len(rows) - len(valid),
        "wilson95": statistics.wilson95(len(won), len(valid)),
        "speed_m_s": _mean([r.progress_m / r.time_s for r in won]),
        "time_over_successes_s": _mean([r.time_s for r in won]),
        "progress_per_time_m_s": sum(r.progress_m for r in valid) / float(times.sum())
        if valid
        else None,
        "restricted_mean_time_s": mean if valid else None,
        "restricted_mean_time_95": (low, high) if valid else None,
        "stuck": stuck,
        "recovered": recovered,
        "share": {
            name: _mean([getattr(r, f"share_{name}") for r in valid])
            for name in ("forward", "turn_l", "turn_r", "reverse", "hold")
        },
        "force_mean_n": _mean([r.force_mean_n for r in valid]),
        "force_max_n": max((r.force_max_n for r in valid), default=None),
    }


def _mean(values: list[float]) -> float | None:
    return float(np.mean(values)) if values else None


def _paired(by_arm: dict[Arm, list[TrialResult]]) -> dict[str, Any]:
    """Every two arms on the trials that are valid in both."""
    tests = {}
    for first, second in combinations(by_arm, 2):
        ours = {r.trial: r for r in by_arm[first] if r.status != "invalid"}
        theirs = {r.trial: r for r in by_arm[second] if r.status != "invalid"}
        both = sorted(ours.keys() & theirs.keys())
        if both:
            test = statistics.compare(
                np.array([ours[k].status == "success" for k in both]),
                np.array([theirs[k].status == "success" for k in both]),
                np.array([ours[k].time_s for k in both]),
                np.array([theirs[k].time_s for k in both]),
            )
            tests[f"{first}-{second}"] = {"trials": len(both), **asdict(test)}
    return tests
