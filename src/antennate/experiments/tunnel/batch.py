"""Trials of one controller in lockstep: one NumPy call of the control serves them all."""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, Union

import numpy as np

from antennate.control.knowledge import Kind, given_to
from antennate.control.loop import CheckedController, run_loop, void_decisions
from antennate.control.readings import YOKED, Given, Readings, Yoked, make_readings, parts_of
from antennate.control.registry import ControllerMaker, make_controller
from antennate.errors import ConfigError, ControllerError, SceneError
from antennate.experiments.tunnel.physics import (
    TrialMonitor,
    TrialResult,
    TunnelConfig,
)
from antennate.sim.judge import LOOK_EVERY, time_limit_of
from antennate.sim.knowledge import Truths, require_route
from antennate.sim.scenes.scene import TIME_LIMIT, Scene, SceneInstance
from antennate.sim.sim_robot import SimRobot
from antennate.sim.trial import draw_trial, require_room, scene_of
from antennate.sim.world import World
from antennate.telemetry.header import Header, log_name
from antennate.telemetry.view import Restart
from antennate.types import AntennaFrame, Controller, Floats, Ints, JointCommand, Maneuver

if TYPE_CHECKING:
    from antennate.sim.warp.robot import WarpRobot
    from antennate.telemetry.simulated import Decisions, SimulatedLog
    from antennate.telemetry.view.simulation import SimulationView

BATCH = 24
"""Trials of one process stepped in lockstep. Each pays its share of what all cost together."""
SHOWN_TRIALS = 5
"""Trials of which the figure draws the paths; those of the others are not kept, as they take time.
"""
Emit = Callable[[tuple[Any, Any]], None]
"""Takes what a trial came to: a `TrialResult` and a `TrialPath` or None, unless watched otherwise.
"""
Watch = Callable[[World, AntennaFrame, Controller], Sequence[str]]
"""Takes world, frame and controller of the first row after each tick; returns events to log."""


class Monitor(Protocol):
    """What watches one trial and says how it ends, as `TrialMonitor` does."""

    trial: int
    scene: SceneInstance
    time_limit: float

    def bend(self, world: Any) -> None:
        """Look at the world after every tick."""
        ...

    def look(self, world: Any, t: float, maneuver: int) -> str | None:
        """Look every LOOK_EVERY ticks and at the time limit; the outcome once there is one."""
        ...

    def result(self, world: Any, outcome: Any, reason: str, ticks: Ints) -> Any:
        """The row of a trial that ended so, with `ticks` in each maneuver, shape (5,)."""
        ...

    def path(self, world: Any) -> Any:
        """What figures draw of the trial; asked of the first SHOWN_TRIALS."""
        ...


MakeMonitor = Callable[[int, int, SceneInstance, float], Monitor]
"""Takes row, trial, its scene and its time limit [s]."""
Bodies = Union[SimRobot, "WarpRobot"]
"""Robots in rows that trials are put into, on the CPU or in a batch on a device."""
Donors = dict[int, Floats]
"""Counts of trials, tick by tick, (ticks, 2), by number."""
MakeBodies = Callable[[int], tuple[Scene, Bodies]]
"""Takes the number of rows; the scene, drawn so that these robots can be put into it, and them."""


def run_trials(
    config: TunnelConfig,
    condition: str,
    trials: Sequence[int],
    emit: Emit,
    batch: int = BATCH,
    logs: Path | None = None,
    watch: Watch | None = None,
    make: ControllerMaker = make_controller,
    bodies: MakeBodies | None = None,
    donors: Donors | None = None,
    read: Donors | None = None,
    monitor: MakeMonitor | None = None,
) -> None:
    """Run trials of one condition; emit each as it ends, and keep its log if there is a folder.

    A trial in which the controller fails is invalid, and the others go on. Angles that are not
    finite, and a maneuver that does not exist, are faults of one row and end that trial alone. An
    exception, or an array of another shape, cannot be told apart by rows: then each trial of the
    batch that has not ended begins again with a controller of its own, and is invalid if that one
    fails too. With robots of another kind, there are no logs and nothing to watch.

    Args:
        config: What is run.
        condition: Name of the controller, with its readings if they are not its own.
        trials: Their numbers.
        emit: Takes each as it ends.
        batch: Trials at once.
        logs: Folder for their logs.
        watch: Looks at the first row.
        make: Makes the controller.
        bodies: Makes the robots; on the CPU if not given.
        donors: Counts that yoked trials are given, by trial, (ticks, 2); if not given, they are
            read in trials that are run for it, so many at once.
        read: Takes what the robot of each trial reads, likewise.
        monitor: Makes what watches a trial and makes its row; a `TrialMonitor` if not given. A
            trial whose scene cannot be drawn has a `TrialResult` all the same.
    """
    again = functools.partial(
        *(run_trials, config, condition),
        emit=emit,
        logs=logs,
        make=make,
        bodies=bodies,
        read=read,
        monitor=monitor,
    )
    if parts_of(condition)[1] == YOKED and donors is None:
        for first in range(0, len(trials), batch):
            some = trials[first : first + batch]
            counts = _donors(config, parts_of(condition)[0], some, batch)
            again(some, batch=batch, watch=watch, donors=counts)
        return
    size = min(batch, len(trials))
    made = (bodies or cpu_bodies(config))(size)
    rows = _Rows(config, condition, trials, emit, size, logs, watch, made, donors, read, monitor)
    try:
        rows.run(make)
    except Restart:
        rows.drop_logs()
        raise
    except ControllerError as error:
        if len(trials) == 1:
            rows.end(0, "invalid", f"controller: {error}")
            return
        for trial in rows.unfinished:
            rows.log_of(trial).unlink(missing_ok=True)
            again([trial], batch=1, donors=donors)


def _donors(config: TunnelConfig, controller: str, trials: Sequence[int], batch: int) -> Donors:
    """What robots with their own readings read in the trials that follow these, by these."""
    following = {trial: config.following(trial) for trial in trials}
    read: Donors = {}
    run_trials(config, controller, [*following.values()], lambda result: None, batch, read=read)
    return {trial: read[donor] for trial, donor in following.items() if donor in read}


def cpu_bodies(config: TunnelConfig) -> MakeBodies:
    """The scene as it is, and robots on the CPU."""
    robot, period = config.robot, config.control.period

    def make(batch: int) -> tuple[Scene, SimRobot]:
        scene = scene_of(config)
        return scene, SimRobot(batch, robot, period, config.physics.timestep)

    return make


def watched(view: SimulationView) -> dict[str, Any]:
    """What `run_trials` is given to show its trials on a page."""

    def watch(world: World, frame: AntennaFrame, control: Controller) -> Sequence[str]:
        return view.tick(world.model, world.data, frame, control)

    return {"watch": watch, "make": view.controller}


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


def _decisions(config: TunnelConfig, control: CheckedController, batch: int) -> Decisions:
    from antennate.telemetry.simulated import Decisions  # not without logs

    return Decisions(config.robot, control, batch)


class _Rows:
    """The trials that run at once; a row takes the next trial when its own has ended."""

    def __init__(
        self,
        config: TunnelConfig,
        name: str,
        trials: Sequence[int],
        emit: Emit,
        batch: int,
        logs: Path | None,
        watch: Watch | None,
        made: tuple[Scene, Bodies],
        donors: Donors | None,
        read: Donors | None,
        monitor: MakeMonitor | None = None,
    ) -> None:
        self._controller, self._readings = parts_of(name)
        self._donors, self._read, self._counts = donors or {}, read, list[Floats]()
        self._config, self._name, self._emit, self._batch = config, name, emit, batch
        self._folder, self._looks = logs, watch
        self._logs: dict[int, SimulatedLog] = {}
        self._waiting = list(trials)
        self._scene, self._robot = made
        self._monitors: dict[int, Monitor] = {}
        self._watches = monitor or self._usual
        self._every: Ints = np.arange(batch)
        self._made: Controller | None = None
        self._known: tuple[Kind, ...] = ()
        self._truths: Truths | None = None
        self._ticks, self._begun, self._blocked = 0, dict[int, int](), dict[int, str]()
        self._maneuvers: Ints = np.zeros((batch, len(Maneuver)), np.int64)

    @property
    def unfinished(self) -> list[int]:
        """Trials that were not emitted, in order."""
        running = [monitor.trial for monitor in self._monitors.values()]
        return sorted(running + self._waiting)

    def run(self, make: ControllerMaker) -> None:
        """Run all trials, with the controller that `make` makes."""
        config = self._config
        phases = [self._place(row) for row in range(self._batch)]
        if not self._monitors:
            return
        made = self._made = self._make(make)
        control = CheckedController(made, config.robot, self._batch)
        decisions = None if self._folder is None else _decisions(config, control, self._batch)
        nothing = [np.full((1, 2), np.nan)] * self._batch
        readings = make_readings(self._readings, config.control, self._batch, nothing)
        given = Given(control, readings)
        for row, phase in enumerate(phases):
            self._reset(row, phase, control, readings, decisions)
        self._inform(control)

        def go_on(frame: AntennaFrame, command: JointCommand) -> bool:
            if self._read is not None:
                self._counts.append(frame.counts.copy())
            frame = given.frame or frame
            if decisions is not None and self._logs:
                decided = decisions.take(frame, command)
                for log in self._logs.values():
                    log.take(decided)
            if self._looks is not None:
                self._look(self._looks, frame, made)
            for row in self._watch(control):
                self._reset(row, self._place(row), control, readings, decisions)
            self._inform(control)
            return bool(self._monitors)

        run_loop(self._robot, given, config.control.period, go_on)

    def _make(self, make: ControllerMaker) -> Controller:
        """The controller, and what is to be known of its rows."""
        config = self._config
        try:
            made = make(self._controller, config.control, config.robot, self._batch)
            self._known = given_to(made, self._controller, config.knows)
        except ConfigError as error:
            raise ControllerError(str(error)) from error
        if self._known:
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
                lost = lost_row(self._config, self._name, trial, str(error))
                self._emit((lost, None))
        return None

    def _begin(self, row: int, trial: int) -> float:
        """Put a trial into a row; its gait phase [rad]."""
        config = self._config
        if self._readings == YOKED and trial not in self._donors:
            other = config.following(trial)
            raise SceneError(f"{YOKED}: expected readings of trial {other}, found none")
        gait, period = config.control.gait, config.control.period
        start = draw_trial(config, self._scene, trial, gait, period)
        require_route(config.scene, start.scene, self._known)
        limit = time_limit_of(start.scene, config.time_limit)
        self._robot.load(row, start.world, start.chance)
        self._begun[row], self._maneuvers[row] = self._ticks, 0
        self._monitors[row] = self._watches(row, trial, start.scene, limit)
        try:
            require_room(start.world)
        except SceneError as error:
            self._blocked[row] = str(error)
        return start.phase

    def _usual(self, row: int, trial: int, scene: SceneInstance, limit: float) -> TrialMonitor:
        """What watches a trial unless another is given."""
        before = self._robot.world(row).outlines()[1] if trial < SHOWN_TRIALS else []
        return TrialMonitor(self._config.seed, trial, self._name, scene, before, limit)

    def _reset(
        self,
        row: int,
        phase: float | None,
        control: CheckedController,
        readings: Readings,
        decisions: Decisions | None,
    ) -> None:
        """Let the controller, its readings and the log begin with the trial in a row, if any."""
        if phase is not None:
            control.reset(np.array([row]), phase)
            if isinstance(readings, Yoked):
                readings.give(row, self._donors[self._monitors[row].trial])
            readings.reset(np.array([row]))
            if self._truths is not None:
                self._truths.begin(row, self._monitors[row].scene)
            self._log(row, phase, decisions)

    def _inform(self, control: CheckedController) -> None:
        """Give the controller what it may know of all rows for its next step."""
        if self._truths is not None:
            for row in self._monitors:
                self._truths.look(row, self._robot.world(row), control.maneuver.item(row))
            control.know(self._truths.knowledge())

    def log_of(self, trial: int) -> Path:
        """The log of a trial."""
        return (self._folder or Path()) / log_name(f"{self._name}-{trial}")

    def _log(self, row: int, phase: float, decisions: Decisions | None) -> None:
        """Begin the log of the trial that was put into a row."""
        config, monitor, world = self._config, self._monitors[row], self._robot.world(row)
        if decisions is None or not isinstance(world, World):
            return
        from antennate.telemetry.simulated import SimulatedLog  # not without logs

        header = Header(
            controller=self._controller,
            readings=self._readings,
            params=config.control,
            robot=config.robot,
            seed=config.seed,
            trial=monitor.trial,
            phase=phase,
            joint_bias=tuple(self._robot.joint_bias(row).tolist()),
            knows=self._known,
        )
        path = self.log_of(monitor.trial)
        path.unlink(missing_ok=True)  # what a killed worker left of it
        self._logs[row] = SimulatedLog(path, header, world, decisions, row)

    def _look(self, watch: Watch, frame: AntennaFrame, controller: Controller) -> None:
        """Let somebody look at the first row after a tick, and keep the events in the logs."""
        world = self._robot.world(0)
        if isinstance(world, World):
            for text in watch(world, frame, controller):
                for log in self._logs.values():
                    log.event(text)

    def drop_logs(self) -> None:
        """Remove the logs of trials that are given up."""
        for log in self._logs.values():
            log.close()
            log.path.unlink(missing_ok=True)

    def _watch(self, control: CheckedController) -> list[int]:
        """Watch all rows after a tick, by the time of each world; those whose trials have ended."""
        maneuvers, ended = control.maneuver, list[int]()
        broken = {row: str(error) for row, error in self._robot.failures.items()} | self._blocked
        self._blocked.clear()
        if control.faults:
            broken |= {row: f"controller: {fault}" for row, fault in control.faults.items()}
            maneuvers = np.clip(maneuvers, 0, max(Maneuver))
        for row in broken.keys() & self._monitors:
            self.end(row, "invalid", broken[row])
            ended.append(row)
        self._maneuvers[self._every, maneuvers] += 1
        self._ticks += 1
        for row, begun in [*self._begun.items()]:
            world = self._robot.world(row)
            self._monitors[row].bend(world)
            t, monitor = world.t, self._monitors[row]
            if (self._ticks - begun) % LOOK_EVERY and t < monitor.time_limit:
                continue
            maneuver = maneuvers.item(row)
            try:
                outcome, reason = monitor.look(world, t, maneuver), ""
            except SceneError as error:
                outcome, reason = "invalid", str(error)
            if outcome is not None:
                self.end(row, outcome, reason)
                ended.append(row)
        return ended

    def end(self, row: int, outcome: str, reason: str = "") -> None:
        """Emit the trial of a row, and empty the row."""
        if (log := self._logs.pop(row, None)) is not None:
            log.close()
        monitor, world = self._monitors.pop(row), self._robot.world(row)
        begun = self._begun.pop(row)
        if self._read is not None and (ticks := self._counts[begun:]):
            self._read[monitor.trial] = np.array([counts[row] for counts in ticks])
        path = monitor.path(world) if monitor.trial < SHOWN_TRIALS else None
        result = monitor.result(world, outcome, reason, self._maneuvers[row])
        if isinstance(result, TrialResult) and (void := void_decisions(self._made, row)):
            result = replace(result, void_decisions=void)
        self._emit((result, path))
        self._robot.unload(row)
