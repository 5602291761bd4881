"""One simulated trial and its time series."""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import Any

import numpy as np

from antennate import checks
from antennate.control.knowledge import require_own_senses
from antennate.control.loop import CheckedController, run_loop
from antennate.control.registry import ControllerFactory, make_controller
from antennate.errors import ConfigError, ControllerError
from antennate.params.base import from_values
from antennate.params.control import ControlParams
from antennate.robots.spec import RobotSpec
from antennate.sim.episode import Episode
from antennate.sim.sim_robot import SimRobot
from antennate.sim.trial import (
    Trial,
    TrialConfig,
    draw_trial,
    require_own_curves,
    require_room,
    scene_of,
)
from antennate.telemetry.header import Header
from antennate.telemetry.simulated import Decisions, SimulatedLog
from antennate.telemetry.time_series import TimeSeries, TimeSeriesRecorder
from antennate.types import AntennaFrame, Controller, JointCommand


def simulate(
    controller: str | ControllerFactory = "closed",
    trial: int = 0,
    time_limit: float | None = None,
    control: ControlParams | None = None,
    log: str | Path | None = None,
    **settings: Any,
) -> TimeSeries:
    """Run one trial of one robot and return what was read, decided and commanded at each tick.

    It meets the same scene, start and disturbances as that trial of `antennate tunnel`.

    Args:
        controller: A name, as `closed` or `file.py:Class`, or a controller class.
        trial: Number of the trial, from 0.
        time_limit: Time above 0 after which it ends [s], that of the scene if not given; it ends
            earlier at the exit, or when the robot has left the scene or the physics failed.
        control: Parameters of the controller, the defaults if not given.
        log: A file that does not exist yet, with the ending .mcap, for the log of the trial.
        settings: Fields of the trial: seed, scene, robot, tunnel, corridors, ground, variation,
            physics.

    Returns:
        The series; `meta["outcome"]` is success, timeout, left, overturned, fell or
        invalid.

    Raises:
        ConfigError: A setting is unknown or out of bounds, there is no such controller, the log
            has another ending, or the control has the curve of another kind of flex sensor.
        SceneError: The scene cannot be built, or the robot starts inside an obstacle.
        ControllerError: The controller raised an exception, or what it answers is no command.
        LogError: The log cannot be written.
    """
    trial = checks.whole("trial", trial)
    if time_limit is not None:
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
    scene = scene_of(config)
    start = draw_trial(config, scene, trial, control.gait, control.period)
    require_room(start.world)
    controlling = make_controller(controller, control, config.robot, 1)
    require_own_senses(controlling, str(controller), "simulate")
    robot = SimRobot(1, config.robot, control.period, config.physics.timestep)
    robot.load(0, start.world, start.chance)
    controlling.reset(np.array([0]), start.phase)
    walk = _Walk(config.robot, robot, controlling, start, start.episode(time_limit))
    name = controller
    if not isinstance(name, str):  # without a name in a registry
        name = str(getattr(controller, "__name__", type(controller).__name__))
    with contextlib.ExitStack() as stack:
        if log is not None:
            header = Header(
                controller=name,
                params=control,
                robot=config.robot,
                seed=config.seed,
                trial=trial,
                phase=start.phase,
                joint_bias=tuple(start.chance.joint_bias.tolist()),
            )
            logged = SimulatedLog(log, header, start.world, walk.decisions)
            walk.log = stack.enter_context(logged)
        run_loop(robot, walk.checked, control.period, walk.go_on)
    return walk.recorder.series(
        {
            "controller": name,
            "scene": config.scene,
            "seed": config.seed,
            "trial": trial,
            "period_s": control.period,
            "threshold": control.rule.threshold,
            "outcome": walk.episode.outcome,
        }
    )


class _Walk:
    """One trial while it goes on: it is recorded, and ended.

    Args:
        spec: The robot's description.
        robot: The robot, with the trial in its only row.
        controller: What moves it.
        start: The trial.
        episode: Its episode.

    Attributes:
        episode: As given.
        checked: The controller with its answers checked.
        recorder: What was read, decided and commanded.
        decisions: The same for a log.
        log: Takes them, None if none is kept.
    """

    def __init__(
        self,
        spec: RobotSpec,
        robot: SimRobot,
        controller: Controller,
        start: Trial,
        episode: Episode,
    ) -> None:
        self._robot, self._start, self.episode = robot, start, episode
        self.checked = CheckedController(controller, spec, 1)
        self.recorder = TimeSeriesRecorder(self.checked, lambda: start.world.head[:2])
        self.decisions = Decisions(spec, self.checked)
        self.log: SimulatedLog | None = None

    def go_on(self, frame: AntennaFrame, command: JointCommand) -> bool:
        """Keep a tick; whether there is a next one."""
        if self.checked.faults:
            raise ControllerError(f"tick {self.episode.ticks + 1}: {self.checked.faults[0]}")
        self.recorder.take(frame, command)
        if self.log is not None:
            self.log.take(self.decisions.take(frame, command))
        ended = self.episode.tick(self._start.world, self._robot.failures.get(0))
        if self.episode.error is not None:
            raise self.episode.error
        return ended is None
