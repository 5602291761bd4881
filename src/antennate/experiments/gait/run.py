"""The gait on a flat floor: how far each maneuver goes, what the lead of the body wave is worth.

Every walk runs through the same interface and loop as a trial, without a random part. The gait is
its own mirror image half a cycle later, so over whole cycles FORWARD neither yaws nor drifts.
FORWARD is walked again for numbers that are not known, drawn from their ranges.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from antennate.colours import called
from antennate.control.gait import Gait
from antennate.control.loop import run_loop
from antennate.experiments.gait.config import GaitStudyConfig
from antennate.experiments.gait.metered import MeteredWorld
from antennate.experiments.gait.pace import Pace, Walk, measure, rolling_speed
from antennate.experiments.gait.unknown import drawn
from antennate.params.control import ControlParams
from antennate.params.gaits import GaitParams
from antennate.params.scene import VariationParams
from antennate.robots.spec import RobotSpec
from antennate.sim.scenes.scene import FlatScene
from antennate.sim.sim_robot import Disturbance, SimRobot
from antennate.sim.trial import place_at_start
from antennate.sim.world import World, compile_world
from antennate.studies.experiment import OnStep, Outcome, no_step
from antennate.studies.pool import Workers, gather
from antennate.telemetry.header import Header, log_name
from antennate.telemetry.simulated import Decisions, SimulatedLog
from antennate.telemetry.view.simulation import SimulationView
from antennate.types import AntennaFrame, Contact, Floats, JointCommand, Maneuver

MANEUVERS = (Maneuver.FORWARD, Maneuver.TURN_L, Maneuver.TURN_R, Maneuver.REVERSE)
WAVE_OFF = "wave_off"
_TINY = 1e-6
"""Rounding of times [s]."""


@dataclass(frozen=True, slots=True)
class GaitOutcome(Outcome):
    """All walks: four maneuvers by name, one without body wave, and the sweep over its lead.

    Attributes:
        drawn: FORWARD for each draw of the unknown numbers.
        ends: FORWARD with each of them alone at its lower and its upper end.
    """

    config: GaitStudyConfig
    maneuvers: dict[str, Walk]
    wave_off: Walk
    sweep: list[Walk]
    drawn: list[Walk]
    ends: dict[str, tuple[Walk, Walk]]

    def pace(self, walk: Walk) -> Pace:
        """What a walk of this study comes to."""
        return measure(walk, self.config.settling_cycles, self.config.cycles)

    def result(self) -> dict[str, Any]:
        """The content of result.json."""
        config = self.config
        rolling = None
        if config.robot.legs.kind == "rolling":
            rolling = rolling_speed(config.gait, config.robot)
        straight = self.pace(self.wave_off).speed
        chosen = self.pace(self.maneuvers["forward"]).speed
        swept = [self.pace(walk) for walk in self.sweep]
        speeds = [pace.speed for pace in swept]
        best = max(speeds)
        return {
            "schema": 1,
            "command": "gait",
            "body_length_m": config.length,
            "frequency_hz": config.gait.frequency,
            "maneuvers": {name: self._row(walk) for name, walk in self.maneuvers.items()},
            "wave_off": {
                "speed_m_s": straight,
                "expected_m_s": rolling,
                "ratio": None if rolling is None else straight / rolling,
            },
            "phase_sweep": [
                {
                    "body_phase_rad": walk.gait.body_phase,
                    "speed_m_s": pace.speed,
                    "body_lengths_per_cycle": pace.body_lengths,
                }
                for walk, pace in zip(self.sweep, swept, strict=True)
            ],
            "chosen_body_phase_rad": config.gait.body_phase,
            "best_body_phase_rad": self.sweep[speeds.index(best)].gait.body_phase,
            "cost_of_phase": {
                "chosen_over_best": chosen / best,
                "worst_over_best": min(speeds) / best,
            },
            "measured_body_lengths_per_cycle": config.measured,
            "unknown": self._unknown() if self.drawn else None,
        }

    def _unknown(self) -> dict[str, Any]:
        """What the unknown numbers make of FORWARD, in body lengths a cycle."""
        found = np.array([self.pace(walk).body_lengths for walk in self.drawn])
        ends = {n: [self.pace(walk).body_lengths for walk in both] for n, both in self.ends.items()}
        low, median, high = np.percentile(found, [2.5, 50.0, 97.5]).tolist()
        return {
            "draws": len(found),
            "median": median,
            "interval95": [low, high],
            "range": [float(found.min()), float(found.max())],
            "body_lengths_per_cycle": found.tolist(),
            "parameters": {
                one.name: {
                    "range": [one.low, one.high],
                    "body_lengths_per_cycle": ends[one.name],
                    "change": ends[one.name][1] - ends[one.name][0],
                }
                for one in self.config.unknowns
            },
        }

    def _row(self, walk: Walk) -> dict[str, Any]:
        pace = self.pace(walk)
        return {
            "speed_m_s": pace.speed,
            "body_lengths_per_cycle": pace.body_lengths,
            "yaw_deg_per_cycle": math.degrees(pace.yaw),
            "cost_of_transport": pace.cost_of_transport,
        }


class _Fixed:
    """A control of one idea: always the same maneuver, whatever the antennae feel."""

    def __init__(
        self, gait: GaitParams, robot: RobotSpec, maneuver: Maneuver, period: float
    ) -> None:
        self._gait = Gait(gait, robot, 1, period)
        self.maneuver = np.array([int(maneuver)])
        self.contact = np.full((1, 2), int(Contact.UNKNOWN))
        self.level = np.full((1, 2), math.nan)

    @property
    def phase(self) -> Floats:
        return self._gait.phase

    def step(self, frame: AntennaFrame) -> JointCommand:
        return self._gait.step(self.maneuver)


def check(config: GaitStudyConfig) -> None:
    """Find draws that make no robot or gait before anything is run.

    Raises:
        ConfigError: There is one.
    """
    _tasks(config)


_Task = tuple[GaitStudyConfig, str, GaitParams, Maneuver]
LOGGED = "gait"
"""What stands for the controller in the log of a walk: a maneuver that nobody decides."""


Watch = Callable[[World, AntennaFrame], None]
"""Takes world and frame after each tick."""


def walk_flat(
    config: GaitStudyConfig,
    name: str,
    gait: GaitParams,
    maneuver: Maneuver,
    watch: Watch = lambda world, frame: None,
    logs: Path | None = None,
) -> Walk:
    """Walk one maneuver on the flat floor from a straight start; its log goes to a folder `logs`.

    Raises:
        SimulationError: The physics became invalid.
        LogError: The log cannot be written.
    """
    robot, period = config.robot, 1.0 / config.rate
    scene = FlatScene().draw(robot, np.random.default_rng(0))
    world = MeteredWorld(compile_world(config.physics, robot, scene), robot)
    place_at_start(world, scene, gait)
    body = SimRobot(1, robot, period, config.physics.timestep)
    body.load(0, world, _no_chance(robot, period))
    end = (config.settling_cycles + config.cycles) / gait.frequency
    ticks: list[tuple[float, Floats, float]] = []
    control = _Fixed(gait, robot, maneuver, period)
    decisions = Decisions(robot, control)

    def go_on(frame: AntennaFrame, command: JointCommand) -> bool:
        failure = body.failures.get(0)
        if failure is not None:
            raise failure
        if log is not None:
            log.take(decisions.take(frame, command))
        watch(world, frame)
        ticks.append((world.t, world.links(), world.work))
        return world.t < end - _TINY

    with contextlib.ExitStack() as stack:
        log = (
            None
            if logs is None
            else stack.enter_context(_log(logs, config, name, world, decisions))
        )
        run_loop(body, control, period, go_on)
    links = np.array([tick[1] for tick in ticks])
    half = robot.links // 2
    axis = links[:, :half].mean(axis=1) - links[:, half:].mean(axis=1)
    return Walk(
        name=name,
        gait=gait,
        t=np.array([tick[0] for tick in ticks]),
        head=links[:, 0],
        centre=links.mean(axis=1),
        heading=np.unwrap(np.arctan2(axis[:, 1], axis[:, 0])),
        work=np.array([tick[2] for tick in ticks]),
        weight=float(world.model.body_mass.sum() * np.linalg.norm(world.model.opt.gravity)),
        length=config.length,
    )


def _log(
    folder: Path, config: GaitStudyConfig, name: str, world: World, decisions: Decisions
) -> SimulatedLog:
    """The log of a walk, in place of what a killed run left of it."""
    path = folder / log_name(name)
    path.unlink(missing_ok=True)
    params = ControlParams(rate=config.rate, gait=config.gait)
    header = Header(controller=LOGGED, params=params, robot=config.robot)
    return SimulatedLog(path, header, world, decisions)


def _no_chance(robot: RobotSpec, period: float) -> Disturbance:
    """A disturbance that disturbs nothing; the control here does not look at sensor noise."""
    still = VariationParams(start_lateral=0, start_heading=0, joint_bias=0, slip_log_sd=0)
    return Disturbance(np.random.default_rng(0), still, robot, period)


def log_names(config: GaitStudyConfig) -> list[str]:
    """Names of the logs of all walks."""
    return [log_name(name) for _, name, _, _ in _tasks(config)]


def _tasks(config: GaitStudyConfig) -> list[_Task]:
    gait = config.gait
    forward = {WAVE_OFF: _changed(gait, amplitude=0.0)}
    for i in range(config.sweep_points):
        lead = 2.0 * math.pi * i / config.sweep_points
        forward[f"sweep{i}"] = _changed(gait, body_phase=lead)
    return [
        *((config, m.name.lower(), gait, m) for m in MANEUVERS),
        *((config, name, one, Maneuver.FORWARD) for name, one in forward.items()),
        *((one, name, one.gait, Maneuver.FORWARD) for name, one in _unknown(config).items()),
    ]


def _unknown(config: GaitStudyConfig) -> dict[str, GaitStudyConfig]:
    """What is walked for the unknown numbers: each draw, then each number at its ends."""
    unknowns, found = config.unknowns, dict[str, GaitStudyConfig]()
    if not unknowns:
        return found
    names = [one.name for one in unknowns]
    for i, values in enumerate(drawn(unknowns, config.draws, config.seed).tolist()):
        found[f"draw{i}"] = config.at(dict(zip(names, values, strict=True)))
    for one in unknowns:
        found[f"{one.name}:low"] = config.at({one.name: one.low})
        found[f"{one.name}:high"] = config.at({one.name: one.high})
    return found


def _changed(gait: GaitParams, **values: float) -> GaitParams:
    return GaitParams(**{**gait.model_dump(), **values})


def _walk_logged(task: _Task, logs: Path | None) -> Walk:
    """One walk, with its log if there is a folder."""
    return walk_flat(*task, logs=logs)


def _walk_viewed(
    tasks: Sequence[_Task], on_step: OnStep, view: SimulationView, logs: Path | None
) -> Iterator[Walk]:
    """All walks on a page, one after the other."""
    for done, (config, name, gait, maneuver) in enumerate(tasks, start=1):

        def watch(world: World, frame: AntennaFrame, maneuver: Maneuver = maneuver) -> None:
            view.tick(world.model, world.data, frame, maneuver=int(maneuver))

        known = {each.name.lower(): called(each) for each in MANEUVERS}
        view.begin(known.get(name, name.replace("_", " ")))
        yield walk_flat(config, name, gait, maneuver, watch, logs)
        on_step(done, len(tasks))


def run(
    config: GaitStudyConfig,
    workers: int | Workers = 1,
    on_step: OnStep = no_step,
    view: SimulationView | None = None,
    logs: Path | None = None,
) -> GaitOutcome:
    """Walk all maneuvers, the one without body wave, the sweep, and the unknown numbers.

    With a view they run in this process, one after the other, and give the same. The log of each
    goes to a folder if one is given.

    Raises:
        ConfigError: A draw of the unknown numbers makes no robot or gait.
        LogError: A log cannot be written.
        SimulationError: The physics became invalid; from a worker it comes as a WorkerError.
    """
    tasks = _tasks(config)
    if view is None:
        walks = gather(_walk_logged, [(task, logs) for task in tasks], workers, on_step)
    else:
        walks = list(_walk_viewed(tasks, on_step, view, logs))
    found = {walk.name: walk for walk in walks}
    return GaitOutcome(
        config=config,
        maneuvers={m.name.lower(): found[m.name.lower()] for m in MANEUVERS},
        wave_off=found[WAVE_OFF],
        sweep=[found[f"sweep{i}"] for i in range(config.sweep_points)],
        drawn=[found[f"draw{i}"] for i in range(config.draws) if config.unknown],
        ends={
            one.name: (found[f"{one.name}:low"], found[f"{one.name}:high"])
            for one in config.unknowns
        },
    )
