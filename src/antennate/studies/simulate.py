"""One simulated trial and its time series."""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import Any

import numpy as np

from antennate import checks
from antennate.control.checked import CheckedController
from antennate.control.loop import run_loop
from antennate.control.registry import ControllerFactory, make_controller
from antennate.errors import ConfigError, ControllerError
from antennate.params.control import ControlParams
from antennate.params.reading import from_values
from antennate.sim.scenes.registry import make_scene
from antennate.sim.sim_robot import SimRobot
from antennate.sim.trial import (
    LOOK_EVERY,
    Trial,
    TrialConfig,
    draw_trial,
    end_of,
    require_own_curves,
    require_room,
)
from antennate.telemetry.header import Header
from antennate.telemetry.simulated import Decisions, SimulatedLog
from antennate.telemetry.time_series import TimeSeries, TimeSeriesRecorder
from antennate.types import AntennaFrame, JointCommand


def simulate(
    controller: str | ControllerFactory = "closed",
    trial: int = 0,
    time_limit: float = 100.0,
    control: ControlParams | None = None,
    log: str | Path | None = None,
    **settings: Any,
) -> TimeSeries:
    """Run one trial of one robot and return what was read, decided and commanded at each tick.

    It meets the same scene, start and disturbances as that trial of `antennate tunnel`.

    Args:
        controller: A name, as `closed` or `file.py:Class`, or a controller class.
        trial: Number of the trial, from 0.
        time_limit: Time above 0 after which it ends [s]; it ends earlier at the exit, or when the
            robot has left the scene or the physics failed.
        control: Parameters of the controller, the defaults if not given.
        log: A file that does not exist yet, with the ending .mcap, for the log of the trial.
        settings: Fields of the trial: seed, scene, robot, tunnel, variation, physics.

    Returns:
        The series; `meta["outcome"]` is success, timeout, left or invalid.

    Raises:
        ConfigError: A setting is unknown or out of bounds, there is no such controller, the log
            has another ending, or the control has the curve of another kind of flex sensor.
        SceneError: The scene cannot be built, or the robot starts inside an obstacle.
        ControllerError: The controller raised an exception, or what it answers is no command.
        LogError: The log cannot be written.
    """
    trial = checks.whole("trial", trial)
    time_limit = checks.real("time_limit", time_limit, "s", above=0.0)
    control = ControlParams() if control is None else control
    checks.instance("control", control, ControlParams)
    log = None if log is None else checks.path("log", log)
    if log is not None and log.suffix != ".mcap":
        raise ConfigError(f"log: expected a name with .mcap, found {log}")
    config = from_values(TrialConfig, settings)
    try:
        require_own_curves(config.robot, control)
    except ValueError as error:
        raise ConfigError(str(error)) from None
    scene = make_scene(config.scene, config.tunnel)
    start = draw_trial(config, scene, trial, control.gait, control.period)
    require_room(start.world)
    controlling = make_controller(controller, control, config.robot, 1)
    robot = SimRobot(1, config.robot, control.period, config.physics.timestep)
    robot.load(0, start.world, start.chance)
    controlling.reset(np.array([0]), start.phase)
    recorder = TimeSeriesRecorder(controlling, lambda: start.world.head[:2])
    checked = CheckedController(controlling, config.robot, 1)
    name = controller if isinstance(controller, str) else _name(controller)
    decisions = Decisions(config.robot, controlling)
    ticks, outcome = 0, "timeout"

    def go_on(frame: AntennaFrame, command: JointCommand) -> bool:
        nonlocal ticks, outcome
        if checked.faults:
            raise ControllerError(f"tick {ticks + 1}: {checked.faults[0]}")
        recorder.take(frame, command)
        if kept is not None:
            kept.take(decisions.take(frame, command))
        ticks += 1
        outcome = "invalid" if robot.failures else "timeout"
        if outcome == "timeout" and ticks % LOOK_EVERY == 0:
            outcome = _seen(start)
        return outcome == "timeout" and start.world.t < time_limit

    with contextlib.ExitStack() as stack:
        kept = None
        if log is not None:
            header = Header(
                controller=name,
                params=control,
                robot=config.robot,
                seed=config.seed,
                trial=trial,
                phase=start.phase,
            )
            kept = stack.enter_context(SimulatedLog(log, header, start.world, decisions))
        run_loop(robot, checked, control.period, go_on)
    return recorder.series(
        {
            "controller": name,
            "scene": config.scene,
            "seed": config.seed,
            "trial": trial,
            "period_s": control.period,
            "outcome": outcome,
        }
    )


def _name(factory: ControllerFactory) -> str:
    """What a log calls a controller that has no name in a registry."""
    return str(getattr(factory, "__name__", type(factory).__name__))


def _seen(trial: Trial) -> str:
    """How the trial has ended by what the scene says of the head; `timeout` if it goes on."""
    return end_of(trial.scene, trial.world.head[:2]) or "timeout"
