"""The boulder wall: which antenna passes a line of small spheres, which jams, which slips.

Everything is defined before any run. The base comes in along the wall's normal until the straight
antenna would reach behind the crests by the overlap, then moves along the wall. A trial *jams* if
the tip advances less than `jam_advance` over some `jam_travel` of the base, *slips* if no sphere is
touched for longer than `slip_time`, and succeeds if it does neither over the whole travel. The same
is counted once more without the `start`. A trial that does both counts as a jam.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from pydantic import model_validator

from antennate.antenna.statics import PROFILES, Profile, with_profile
from antennate.errors import SimulationError, WorkerError
from antennate.experiments.wall import measures
from antennate.experiments.wall.outcome import SAMPLE_PERIOD, Traverse, WallTrial, classify
from antennate.experiments.wall.way import COMMAND_PERIOD, from_crest, marks, ramp, spheres
from antennate.params.base import Params, number, require_different
from antennate.params.bench import BenchVariationParams, Solver, WallParams, solver
from antennate.params.scene import BenchPhysicsParams
from antennate.robots.antenna import AntennaSpec
from antennate.robots.sensor import SensorParams
from antennate.sim import chain
from antennate.sim.bench import Ball, Bench, Watch, compile_bench, unwatched
from antennate.studies.experiment import OnRow, OnStep, Trial, no_row, no_step
from antennate.studies.pool import gather
from antennate.studies.work import Failure
from antennate.telemetry.view.pace import Restart
from antennate.telemetry.view.simulation import SimulationView

REFERENCE: Profile = "descending"
"""The profile that all others are compared with."""
_SAMPLES = round(SAMPLE_PERIOD / COMMAND_PERIOD)
"""Commands to a sample."""
_CLEAR = 0.002
"""Distance between tip and crests before the approach [m]."""
_SETTLE = 0.5
"""Time to come to rest under gravity before the approach [s]."""
_GRAVITY = 9.81


class WallConfig(Params):
    """Everything that decides the outcome of `antennate wall`."""

    unread: ClassVar[tuple[str, ...]] = (
        "antenna.base_angle",
        "antenna.base_spacing",
        *(f"antenna.sensor.{n}" for n in SensorParams.model_fields if n != "active_length"),
    )
    trials: int = number(20, "1", "paper: 20 trials a profile", ge=1, le=10000)
    """Trials of every profile."""
    seed: int = number(1, "1", "assumed: any", ge=0)
    """Seed of all chance."""
    profiles: tuple[Profile, ...] = number(
        tuple(PROFILES), "1", "paper: its three; assumed: two controls it lacks", min_length=1
    )
    """Profiles to run."""
    solver: Solver = solver()
    """What steps the physics: the engine, or the compiled chain (extra `fast`; compiles once)."""
    wall: WallParams = WallParams()
    antenna: AntennaSpec = AntennaSpec()
    variation: BenchVariationParams = BenchVariationParams()
    physics: BenchPhysicsParams = BenchPhysicsParams()

    @model_validator(mode="after")
    def _sound(self) -> WallConfig:
        require_different("profiles", self.profiles)
        reach = self.antenna.length * math.sin(self.wall.base_angle)
        if self.wall.overlap + self.variation.overlap >= reach / 2:
            raise ValueError(
                f"wall.overlap must stay below half of the antenna's reach, {reach / 2:.4g} m, got "
                f"{self.wall.overlap:g} m"
            )
        if self.wall.travel <= max(self.wall.start + self.wall.jam_travel, self.wall.jam_travel):
            raise ValueError(
                f"wall.travel must exceed start and jam_travel together, "
                f"{self.wall.start + self.wall.jam_travel:g} m, got {self.wall.travel:g} m"
            )
        ratio = COMMAND_PERIOD / self.physics.timestep
        if abs(ratio - round(ratio)) > 1e-6 or round(ratio) < 1:
            raise ValueError(
                f"physics.timestep must divide {COMMAND_PERIOD:g} s, got {self.physics.timestep:g}"
            )
        chain.require_read(self.solver, self.physics)
        return self


@dataclass(frozen=True)
class WallOutcome:
    """All trials of a run.

    Attributes:
        config: What was run.
        rows: Sorted by profile and trial.
        examples: The first trial of every profile.
    """

    config: WallConfig
    rows: list[WallTrial]
    examples: dict[str, Traverse]

    def result(self) -> dict[str, Any]:
        """The content of result.json."""
        by_profile = {
            p: [row for row in self.rows if row.profile == p] for p in self.config.profiles
        }
        return {
            "schema": 2,
            "command": "wall",
            "seed": self.config.seed,
            "gravity": self.config.wall.gravity,
            "start_m": self.config.wall.start,
            "profiles": {p: measures.summary(rows) for p, rows in by_profile.items()},
            "border": measures.border(self.config.wall.jam_travel, self.rows),
            "paired": measures.paired(REFERENCE, by_profile),
        }


def passage(config: WallConfig, profile: str, trial: int, watch: Watch = unwatched) -> Traverse:
    """Move one antenna along the wall.

    Args:
        config: What is run.
        profile: Springs of the antenna.
        trial: Which of its trials.
        watch: Looks at the bench of the engine; the chain has none.

    Raises:
        MissingPackageError: The solver needs a package that is not installed.
        SimulationError: The physics became invalid.
    """
    rng = np.random.default_rng([config.seed, trial])
    wall, variation = config.wall, config.variation
    factors = np.exp(rng.normal(0.0, variation.stiffness, config.antenna.hinges))
    friction = max(0.0, config.antenna.friction + rng.normal(0.0, variation.friction))
    angle = wall.base_angle + rng.uniform(-1, 1) * variation.base_angle
    overlap = wall.overlap + rng.uniform(-1, 1) * variation.overlap
    phase = rng.uniform(0.0, 1.0) * wall.sphere_diameter
    antenna = with_profile(config.antenna, profile)
    antenna = antenna.model_copy(update={"friction": min(friction, 2.0)})
    crest = antenna.length * math.sin(angle) + antenna.radius + _CLEAR
    balls = spheres(wall, antenna, angle, phase, crest)
    pull = (0.0, {"down": -_GRAVITY, "up": _GRAVITY, "off": 0.0}[wall.gravity])
    way = (math.pi / 2 - angle, overlap + _CLEAR, crest)
    if config.solver == "chain":
        fast = chain.ChainBench(config.physics, antenna, balls, pull, factors=factors)
        return _drive_chain(config, antenna, fast, balls, *way)
    model = compile_bench(config.physics, antenna, balls, pull)
    for i, factor in enumerate(factors):
        joint = model.joint(f"antenna/hinge{i}")
        joint.stiffness *= factor
    return _drive(config, Bench(model, antenna), balls, *way, watch)


def _drive(
    config: WallConfig,
    bench: Bench,
    balls: Sequence[Ball],
    base: float,
    approach: float,
    crest: float,
    watch: Watch,
) -> Traverse:
    wall = config.wall
    bench.place(0.0, 0.0, base)
    bench.step(round(_SETTLE / config.physics.timestep))
    substeps = round(COMMAND_PERIOD / config.physics.timestep)
    for x in ramp(approach, wall.speed):
        bench.command(x, 0.0, wall.speed, 0.0, base)
        bench.step(substeps)
        watch(bench)
    begin = bench.tip()[1]
    path = ramp(wall.travel, wall.speed)
    rows, hinges, shapes = [], [], []
    shown_at = marks(path)
    for i, y in enumerate(path):
        bench.command(approach, y, 0.0, wall.speed, base)
        bench.step(substeps)
        watch(bench)
        if i in shown_at:
            shapes.append(bench.joints())
        if i % _SAMPLES == 0:
            force = float(np.hypot(*bench.contact_force()))
            tip = bench.tip()[1] - begin
            rows.append((y, tip, bench.touching(), force, bench.flex()))
            hinges.append(bench.hinges().copy())
    base_y, tip_y, touching, forces, flex = np.array(rows, float).T
    drawn = (np.array(hinges), np.array(shapes) - [crest, 0.0], from_crest(balls, crest))
    return Traverse(base_y, tip_y, touching, forces, flex, *drawn)


def _drive_chain(
    config: WallConfig,
    antenna: AntennaSpec,
    bench: chain.ChainBench,
    balls: Sequence[Ball],
    base: float,
    approach: float,
    crest: float,
) -> Traverse:
    """As `_drive`, all commands of a way at once."""
    speed, timestep = config.wall.speed, config.physics.timestep
    substeps = round(COMMAND_PERIOD / timestep)
    bench.place(0.0, 0.0, base)
    bench.drive(bench.commands(np.zeros((1, 2)), np.zeros(2), base), round(_SETTLE / timestep))
    ahead, path = np.array(ramp(approach, speed)), np.array(ramp(config.wall.travel, speed))
    there = np.column_stack([ahead, np.zeros_like(ahead)])
    came = bench.drive(bench.commands(there, np.array([speed, 0.0]), base), substeps)
    along = np.column_stack([np.full_like(path, approach), path])
    went = bench.drive(bench.commands(along, np.array([0.0, speed]), base), substeps)
    seen = went[::_SAMPLES]
    return Traverse(
        path[::_SAMPLES],
        seen.joints[:, -1, 1] - came[-1:].joints[-1, -1, 1],
        seen.touching.astype(float),
        np.hypot(*seen.force.T),
        seen.hinges[:, : antenna.sensed_hinges].sum(axis=1),
        seen.hinges,
        went[sorted(marks(path))].joints - [crest, 0.0],
        from_crest(balls, crest),
    )


_Task = tuple[WallConfig, str, int]


def _invalid(
    config: WallConfig, profile: str, trial: int, reason: str
) -> tuple[WallTrial, Traverse | None]:
    none = [math.nan] * 7
    row = WallTrial(config.seed, trial, profile, "invalid", "invalid", *none, reason=reason)
    return row, None


def every(config: WallConfig) -> list[Trial]:
    """All trials, number by number."""
    return [(profile, trial) for trial in range(config.trials) for profile in config.profiles]


def run_rows(config: WallConfig, trials: Sequence[Trial], emit: Callable[[int, Any], None]) -> None:
    """Run some trials; emit the index and the row of each."""
    for i, (profile, trial) in enumerate(trials):
        emit(i, run_trial(config, profile, trial)[0])


def run_trial(
    config: WallConfig, profile: str, trial: int, watch: Watch = unwatched
) -> tuple[WallTrial, Traverse | None]:
    """One trial, and of the first of a profile its passage."""
    try:
        seen = passage(config, profile, trial, watch)
    except SimulationError as error:
        return _invalid(config, profile, trial, str(error))
    row = classify(config.wall, config.seed, trial, profile, seen)
    return row, seen if trial == 0 else None


def _run_viewed(
    tasks: Sequence[_Task], on_step: OnStep, on_row: OnRow, view: SimulationView
) -> Iterator[tuple[WallTrial, Traverse | None]]:
    """All trials on a page, one after the other; with another seed whenever a person wants that."""

    def watch(bench: Bench) -> None:
        view.tick(bench.model, bench.data)

    for done, (config, profile, trial) in enumerate(tasks, start=1):
        seed = config.seed
        while True:
            view.begin(f"{profile}, trial {trial}", seed)
            changed = config.model_copy(update={"seed": seed})
            try:
                found = run_trial(changed, profile, trial, watch)
                break
            except Restart as wish:
                seed = wish.seed
        on_row(found[0])
        on_step(done, len(tasks))
        yield found


def run(
    config: WallConfig,
    workers: int = 1,
    on_step: OnStep = no_step,
    on_row: OnRow = no_row,
    view: SimulationView | None = None,
) -> WallOutcome:
    """Run all trials of all profiles.

    With a view they run in this process, one after the other, and give the same.

    Raises:
        MissingPackageError: The solver needs a package that is not installed.
        WorkerError: A worker process failed.
    """
    chain.warm_up(config.solver)
    trials = every(config)
    tasks: list[_Task] = [(config, *trial) for trial in trials]

    def lost(place: int, failure: Failure) -> tuple[WallTrial, Traverse | None]:
        if failure.status == "failed":
            raise failure.error or WorkerError(f"a worker failed: {failure.reason}")
        return _invalid(config, *trials[place], failure.reason)

    if view is None:
        how = {"on_result": lambda item: on_row(item[0]), "lost": lost}
        found = gather(run_trial, tasks, workers, on_step, **how)
    else:
        found = list(_run_viewed(tasks, on_step, on_row, view))
    found.sort(key=lambda item: config.profiles.index(item[0].profile))
    examples = {row.profile: seen for row, seen in found if seen is not None}
    return WallOutcome(config, [row for row, _ in found], examples)
