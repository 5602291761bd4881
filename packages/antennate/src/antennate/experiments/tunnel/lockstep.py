"""Trials of one controller in lockstep: one NumPy call of the control serves them all."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, Union

import numpy as np

from antennate.control.knowledge import Kind, given_to
from antennate.control.loop import CheckedController, run_loop, void_decisions
from antennate.control.readings import YOKED, Given, Readings, Yoked, make_readings, parts_of
from antennate.control.registry import ControllerMaker, make_controller
from antennate.errors import ConfigError, ControllerError, SceneError
from antennate.experiments.tunnel.physics import TrialMonitor, TrialResult, TunnelConfig
from antennate.sim.episode import Episode
from antennate.sim.scenes.scene import TIME_LIMIT, Scene
from antennate.sim.sim_robot import SimRobot
from antennate.sim.trial import draw_trial, require_room, scene_of
from antennate.sim.world import World
from antennate.telemetry.header import Header
from antennate.types import AntennaFrame, Controller, Floats, JointCommand, Maneuver

if TYPE_CHECKING:
    from antennate.experiments.tunnel.logs import Logs
    from antennate.sim.knowledge import Truths
    from antennate.sim.warp.robot import WarpRobot

SHOWN_TRIALS = 5
"""Trials of which the figure draws the paths; those of the others are not kept, as they take time.
"""
Emit = Callable[[tuple[Any, Any]], None]
"""Takes what a trial came to: a `TrialResult` and a `TrialPath` or None, unless watched otherwise.
"""
Watch = Callable[[World, AntennaFrame, Controller], Sequence[str]]
"""Takes world, frame and controller of the first row after each tick; returns events to log."""
Bodies = Union[SimRobot, "WarpRobot"]
"""Robots in rows that trials are put into, on the CPU or in a batch on a device."""
MakeBodies = Callable[[int], tuple[Scene, Bodies]]
"""Takes the number of rows; the scene, drawn so that these robots can be put into it, and them."""
Donors = Mapping[int, Floats]
"""Counts that yoked trials are given, tick by tick, (ticks, 2), by number of the trial."""


class Monitor(Protocol):
    """What watches the episode of one trial, as `TrialMonitor` does."""

    episode: Episode

    def tick(self, world: Any, maneuver: int, failure: object = None) -> Any:
        """Let a control tick pass; the outcome once there is one."""
        ...

    def result(self, world: Any) -> Any:
        """The row of the trial, which has ended."""
        ...

    def path(self, world: Any) -> Any:
        """What figures draw of the trial; asked of the first SHOWN_TRIALS."""
        ...


@dataclass(frozen=True)
class Apparatus:
    """What trials are run with: who makes controller, robots and monitors, and who looks on.

    Attributes:
        controller: Makes the controller.
        bodies: Makes the robots; on the CPU if None.
        monitor: monitor(row, episode) makes what watches a trial; a `TrialMonitor` if None.
        watch: Looks at the first row.
    """

    controller: ControllerMaker = make_controller
    bodies: MakeBodies | None = None
    monitor: Callable[[int, Episode], Monitor] | None = None
    watch: Watch | None = None


def cpu_bodies(config: TunnelConfig) -> MakeBodies:
    """The scene as it is, and robots on the CPU."""
    robot, period = config.robot, config.control.period

    def make(batch: int) -> tuple[Scene, SimRobot]:
        scene = scene_of(config)
        return scene, SimRobot(batch, robot, period, config.physics.timestep)

    return make


def lost_row(config: TunnelConfig, condition: str, trial: int, reason: str) -> TrialResult:
    """The row of a trial of which there is nothing else."""
    limit = config.time_limit or TIME_LIMIT
    return TrialResult(
        seed=config.seed,
        trial=trial,
        controller=condition,
        outcome="invalid",
        time_s=limit,
        limit_s=limit,
        reason=reason,
    )


def _logs(folder: Path, batch: int) -> Logs:
    """Logs in a folder."""
    from antennate.experiments.tunnel.logs import Logs  # imports the writer of logs

    return Logs(folder, batch)


class Lockstep:
    """The trials that run at once; a row takes the next trial when its own has ended.

    Args:
        config: What is run.
        condition: Name of the controller, with its readings if they are not its own.
        emit: Takes each trial as it ends.
        batch: Trials at once.
        logs: Folder for their logs; None for none.
        apparatus: What they are run with.
        donors: Counts that yoked trials are given.

    Attributes:
        logs: Logs of the trials that run, None without a folder.
    """

    _control: CheckedController
    _readings: Readings

    def __init__(
        self,
        config: TunnelConfig,
        condition: str,
        emit: Emit,
        batch: int,
        logs: Path | None,
        apparatus: Apparatus,
        donors: Donors,
    ) -> None:
        self._config, self._condition, self._emit, self._batch = config, condition, emit, batch
        self._controller, self._given = parts_of(condition)
        self._apparatus, self._donors = apparatus, donors
        self.logs = None if logs is None else _logs(logs, batch)
        self._scene, self._robot = (apparatus.bodies or cpu_bodies(config))(batch)
        self._monitors: dict[int, Monitor] = {}
        self._waiting: list[int] = []
        self._blocked: dict[int, str] = {}
        self._made: Controller | None = None
        self._known: tuple[Kind, ...] = ()
        self._truths: Truths | None = None

    @property
    def unfinished(self) -> list[int]:
        """Trials that were not emitted, in order."""
        running = [monitor.episode.number for monitor in self._monitors.values()]
        return sorted(running + self._waiting)

    def give_up(self) -> None:
        """Remove the logs of the trials that have not ended.

        Raises:
            LogError: A log cannot be written.
        """
        if self.logs is not None:
            self.logs.drop()

    def run(self, trials: Sequence[int]) -> None:
        """Run trials of these numbers."""
        config, self._waiting = self._config, list(trials)
        phases = [self._place(row) for row in range(self._batch)]
        if not self._monitors:
            return
        made = self._made = self._make()
        self._control = CheckedController(made, config.robot, self._batch)
        nothing = [np.full((1, 2), np.nan)] * self._batch
        self._readings = make_readings(self._given, config.control, self._batch, nothing)
        given = Given(self._control, self._readings)
        for row, phase in enumerate(phases):
            self._reset(row, phase)
        self._inform()

        def go_on(frame: AntennaFrame, command: JointCommand) -> bool:
            frame = given.frame or frame
            if self.logs is not None:
                self.logs.take(frame, command)
            self._show(frame, made)
            for row in self._tick():
                self._reset(row, self._place(row))
            self._inform()
            return bool(self._monitors)

        run_loop(self._robot, given, config.control.period, go_on)

    def fail(self, row: int, reason: str) -> None:
        """End the trial of a row as invalid."""
        self._monitors[row].episode.fail(reason)
        self._end(row)

    def _make(self) -> Controller:
        """The controller, and what is to be known of its rows."""
        config, make = self._config, self._apparatus.controller
        try:
            made = make(self._controller, config.control, config.robot, self._batch)
            self._known = given_to(made, self._controller, config.knows)
        except ConfigError as error:
            raise ControllerError(str(error)) from error
        if self._known:
            from antennate.sim.knowledge import Truths  # not of robots that know nothing

            cycle = 1.0 / (config.control.gait.frequency * config.control.period)
            self._truths = Truths(self._known, self._batch, cycle)
        return made

    def _place(self, row: int) -> float | None:
        """Put the next trial whose scene can be drawn into a row; its gait phase [rad], if any."""
        while self._waiting:
            trial = self._waiting.pop(0)
            try:
                return self._begin(row, trial)
            except SceneError as error:
                self._emit((lost_row(self._config, self._condition, trial, str(error)), None))
        return None

    def _begin(self, row: int, trial: int) -> float:
        """Put a trial into a row; its gait phase [rad]."""
        config = self._config
        if self._given == YOKED and trial not in self._donors:
            other = config.following(trial)
            raise SceneError(f"{YOKED}: expected readings of trial {other}, found none")
        gait, period = config.control.gait, config.control.period
        start = draw_trial(config, self._scene, trial, gait, period)
        if self._known:
            from antennate.sim.knowledge import require_route  # as above

            require_route(config.scene, start.scene, self._known)
        episode = start.episode(config.time_limit)
        self._robot.load(row, start.world, start.chance)
        self._monitors[row] = (self._apparatus.monitor or self._usual)(row, episode)
        try:
            require_room(start.world)
        except SceneError as error:
            self._blocked[row] = str(error)
        return start.phase

    def _usual(self, row: int, episode: Episode) -> TrialMonitor:
        """What watches a trial unless another is given."""
        shown = episode.number < SHOWN_TRIALS
        before = self._robot.world(row).outlines()[1] if shown else []
        return TrialMonitor(episode, self._condition, before)

    def _reset(self, row: int, phase: float | None) -> None:
        """Let the controller, its readings and the log begin with the trial in a row, if any."""
        if phase is None:
            return
        episode = self._monitors[row].episode
        self._control.reset(np.array([row]), phase)
        if isinstance(self._readings, Yoked):
            self._readings.give(row, self._donors[episode.number])
        self._readings.reset(np.array([row]))
        if self._truths is not None:
            self._truths.begin(row, episode.scene)
        if self.logs is None:
            return
        header = Header(
            controller=self._controller,
            readings=self._given,
            params=self._config.control,
            robot=self._config.robot,
            seed=episode.seed,
            trial=episode.number,
            phase=phase,
            joint_bias=tuple(self._robot.joint_bias(row).tolist()),
            knows=self._known,
        )
        self.logs.begin(row, self._robot.world(row), header, self._control)

    def _inform(self) -> None:
        """Give the controller what it may know of all rows for its next step."""
        if self._truths is not None:
            for row in self._monitors:
                maneuver = self._control.maneuver.item(row)
                self._truths.look(row, self._robot.world(row), maneuver)
            self._control.know(self._truths.knowledge())

    def _show(self, frame: AntennaFrame, controller: Controller) -> None:
        """Let somebody look at the first row after a tick, and keep the events in the logs."""
        if (watch := self._apparatus.watch) is None:
            return
        world = self._robot.world(0)
        if isinstance(world, World):
            for text in watch(world, frame, controller):
                if self.logs is not None:
                    self.logs.event(text)

    def _tick(self) -> list[int]:
        """Let a control tick of all trials pass; the rows of those that have ended."""
        faults, maneuvers, ended = self._control.faults, self._control.maneuver, list[int]()
        failures: dict[int, object] = {**self._robot.failures, **self._blocked}
        self._blocked.clear()
        if faults:
            failures |= {row: f"controller: {fault}" for row, fault in faults.items()}
            maneuvers = np.clip(maneuvers, 0, max(Maneuver))
        for row, monitor in [*self._monitors.items()]:
            world, maneuver = self._robot.world(row), maneuvers.item(row)
            if monitor.tick(world, maneuver, failures.get(row)) is not None:
                self._end(row)
                ended.append(row)
        return ended

    def _end(self, row: int) -> None:
        """Emit the trial of a row, and empty the row."""
        if self.logs is not None:
            self.logs.close(row)
        monitor, world = self._monitors.pop(row), self._robot.world(row)
        path = monitor.path(world) if monitor.episode.number < SHOWN_TRIALS else None
        result = monitor.result(world)
        if isinstance(result, TrialResult) and (void := void_decisions(self._made, row)):
            result = replace(result, void_decisions=void)
        self._emit((result, path))
        self._robot.unload(row)
