"""What a second core is worth: processes, and several ways to use threads in one process.

- `machine`: two processes with a few trials each at once, over the same two in turn. 2 is the most.
- `faster`: the same tunnel trials in one process and on two cores, which all must give the same
  rows. `two workers` is what `antennate tunnel --workers 2` runs, with the start of the processes;
  `two started` has processes that run already. `threads, rows` steps the rows of one lockstep batch
  on two threads, `threads, batches` has a batch of its own on each.
- `stepping`: twelve tunnels stepped without a controller's work, tick by tick: in turn, on two
  threads, by `mujoco.batch` and by `mujoco.rollout`; and whether they end on the same bits. The
  latter two need worlds of one layout, so the tunnels are filled up with parked cylinders.
"""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor, ThreadPoolExecutor
from dataclasses import fields, replace
from typing import Any, cast

import mujoco
import mujoco.batch
import mujoco.rollout
import numpy as np
from measuring import in_turn, ratios, spread, wall_seconds

from antennate.control.gait import Gait
from antennate.experiments.tunnel import experiment as experiment
from antennate.experiments.tunnel.batch import run_trials
from antennate.experiments.tunnel.lockstep import Apparatus, Bodies, cpu_bodies
from antennate.experiments.tunnel.physics import TrialResult, TunnelConfig
from antennate.sim.scenes.registry import make_scene
from antennate.sim.scenes.scene import Scene
from antennate.sim.sim_robot import Disturbance
from antennate.sim.trial import draw_scene, draw_trial
from antennate.sim.warp.robot import PaddedTunnels
from antennate.sim.world import World
from antennate.types import AntennaFrame, Floats, JointCommand

CONTROLLER = "closed"
CORES = 2
WORLDS = 12
"""Worlds stepped at once, and half of the trials."""


class Halves:
    """Robots in rows, stepped on as many threads as there are parts."""

    def __init__(self, parts: Sequence[Bodies], size: int, pool: Executor) -> None:
        self._parts, self._size, self._pool = parts, size, pool

    @property
    def clock(self) -> Halves:
        return self

    def now(self) -> float:
        return self._parts[0].clock.now()

    def sleep_until(self, t: float) -> None:
        for _ in self._pool.map(lambda part: part.clock.sleep_until(t), self._parts):
            pass

    def read(self) -> AntennaFrame:
        frames = [part.read() for part in self._parts]
        return AntennaFrame(
            t=np.concatenate([frame.t for frame in frames]),
            counts=np.concatenate([frame.counts for frame in frames]),
        )

    def write(self, command: JointCommand) -> None:
        for i, part in enumerate(self._parts):
            rows = slice(i * self._size, (i + 1) * self._size)
            cut = {f.name: getattr(command, f.name)[rows] for f in fields(command)}
            part.write(replace(command, **cut))

    def load(self, row: int, world: World, chance: Disturbance) -> None:
        self._parts[row // self._size].load(row % self._size, world, chance)

    def unload(self, row: int) -> None:
        self._parts[row // self._size].unload(row % self._size)

    def world(self, row: int) -> Any:
        return self._parts[row // self._size].world(row % self._size)

    @property
    def failures(self) -> Any:
        parts = enumerate(self._parts)
        return {i * self._size + row: e for i, part in parts for row, e in part.failures.items()}


def rows_of(config: TunnelConfig, trials: Sequence[int], **more: Any) -> list[TrialResult]:
    """The rows of some trials, run here in lockstep."""
    rows: list[TrialResult] = []
    run_trials(config, CONTROLLER, trials, lambda found: rows.append(found[0]), **more)
    return rows


def on_threads(config: TunnelConfig, trials: int, pool: Executor) -> list[TrialResult]:
    """The rows of all trials, in one lockstep batch whose rows are stepped on two threads."""

    def bodies(batch: int) -> tuple[Scene, Bodies]:
        size = -(-batch // CORES)
        made = [cpu_bodies(config)(len(range(batch)[i : i + size])) for i in range(0, batch, size)]
        return made[0][0], cast(Bodies, Halves([part for _, part in made], size, pool))

    return rows_of(config, range(trials), apparatus=Apparatus(bodies=bodies))


def shared(config: TunnelConfig, trials: int, pool: Executor) -> list[TrialResult]:
    """The rows of all trials, every second one by each of two workers of a pool."""
    parts = [pool.submit(rows_of, config, range(i, trials, CORES)) for i in range(CORES)]
    return [row for part in parts for row in part.result()]


def measure_trials(quick: bool) -> dict[str, Any]:
    """Two cores over one, for several ways to use them."""
    trials, seconds = (4, 2.0) if quick else (2 * WORLDS, 6.0)
    config = TunnelConfig(trials=trials, time_limit=seconds, controllers=(CONTROLLER,))
    expected = sorted(rows_of(config, range(trials)), key=lambda row: row.trial)
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(CORES, context) as started, ThreadPoolExecutor(CORES) as threads:
        shared(TunnelConfig(time_limit=0.1), CORES, started)  # so that both have imported all

        def checked(run: Callable[[], Sequence[TrialResult]]) -> Callable[[], float]:
            def timed() -> float:
                rows: list[TrialResult] = []
                taken = wall_seconds(lambda: rows.extend(run()))
                if sorted(rows, key=lambda row: row.trial) != expected:
                    raise SystemExit("the rows of a case differ from those of one process")
                return taken

            return timed

        few = range(trials // 4)

        def singles(at_once: bool) -> Callable[[], float]:
            def run() -> None:
                first = started.submit(rows_of, config, few)
                if not at_once:
                    first.result()
                started.submit(rows_of, config, few).result()
                first.result()

            return lambda: wall_seconds(run)

        cases = {
            "one": checked(lambda: experiment.EXPERIMENT.run(config, 1).rows),
            "two workers": checked(lambda: experiment.EXPERIMENT.run(config, CORES).rows),
            "two started": checked(lambda: shared(config, trials, started)),
            "threads, rows": checked(lambda: on_threads(config, trials, threads)),
            "threads, batches": checked(lambda: shared(config, trials, threads)),
            "in turn": singles(at_once=False),
            "at once": singles(at_once=True),
        }
        found = in_turn(cases, 2 if quick else 3)
    return {
        "trials": trials,
        "time_limit_s": seconds,
        "machine": spread(ratios(found["in turn"], found["at once"])),
        "seconds": {name: spread(found[name]) for name in list(cases)[:5]},
        "faster": {name: spread(ratios(found["one"], found[name])) for name in list(cases)[1:5]},
    }


class Stepping:
    """Twelve tunnels of one layout, and what their joints are told at each tick."""

    def __init__(self, config: TunnelConfig, ticks: int) -> None:
        gait = Gait(config.control.gait, config.robot, WORLDS, config.control.period)
        self._substeps = round(config.control.period / config.physics.timestep)
        self._config, plain = config, make_scene(config.scene, config.tunnel)
        drawn = (draw_scene(config, plain, trial) for trial in range(WORLDS))
        self._scene = PaddedTunnels(plain, drawn)
        worlds = self.worlds()
        self._targets: Floats = np.zeros((ticks, WORLDS, worlds[0].model.nu))
        for at in self._targets:
            command = gait.step(np.zeros(WORLDS, np.int64))
            parts = [getattr(command, name) for name in config.robot.command_shapes()]
            told = np.concatenate([part.reshape(WORLDS, -1) for part in parts], axis=1)
            at[:, worlds[0].places.drives] = told
        self.expected: Floats | None = None
        self.same: dict[str, bool] = {}

    def worlds(self) -> list[World]:
        """Fresh ones."""
        gait, period = self._config.control.gait, self._config.control.period
        trials = range(WORLDS)
        return [draw_trial(self._config, self._scene, i, gait, period).world for i in trials]

    def _some(self, worlds: Sequence[World], targets: Floats) -> None:
        for world, told in zip(worlds, targets, strict=True):
            world.data.ctrl[:] = told
            mujoco.mj_step(world.model, world.data, self._substeps)

    def in_turn(self, worlds: list[World]) -> Floats:
        """One world after the other at each tick."""
        for targets in self._targets:
            self._some(worlds, targets)
        return np.array([world.data.qpos for world in worlds])

    def threads(self, worlds: list[World], pool: Executor) -> Floats:
        """Half of the worlds on each thread at each tick."""
        half = WORLDS // CORES
        parts = [slice(i * half, (i + 1) * half) for i in range(CORES)]
        for targets in self._targets:
            list(pool.map(lambda part, t=targets: self._some(worlds[part], t[part]), parts))
        return np.array([world.data.qpos for world in worlds])

    def batch(self, worlds: list[World]) -> Floats:
        """The engine's own batch. Worlds with sleeping parts need one that keeps their data."""
        models = [world.model for world in worlds]
        made = mujoco.batch.Batch(models[0], nsim=WORLDS, nthread=CORES, persistent=True)
        made.set_models(models)
        for name in ("qpos", "qvel", "qacc_warmstart"):
            made.bind(name)[:] = [getattr(world.data, name) for world in worlds]
        told = made.bind("ctrl")
        for targets in self._targets:
            told[:] = targets
            made.step(nstep=self._substeps)
        return made.bind("qpos").copy()

    def rollout(self, worlds: list[World]) -> Floats:
        """The engine's rollout, one tick at a time, since the next targets come after it."""
        models, kind = [world.model for world in worlds], mujoco.mjtState.mjSTATE_FULLPHYSICS
        states = np.zeros((WORLDS, mujoco.mj_stateSize(models[0], kind)))
        for world, state in zip(worlds, states, strict=True):
            mujoco.mj_getState(world.model, world.data, state, kind)
        data = [mujoco.MjData(models[0]) for _ in range(CORES)]
        with mujoco.rollout.Rollout(nthread=CORES) as made:
            for targets in self._targets:
                told = np.repeat(targets[:, None], self._substeps, axis=1)
                found, _ = made.rollout(models, data, states, told, nstep=self._substeps)
                states = np.array(found)[:, -1].copy()
        return states[:, 1 : 1 + models[0].nq]

    def timed(self, name: str, run: Callable[..., Floats], *more: Any) -> float:
        """Time of a way on the clock; notes whether it ends on the same bits as the first."""
        worlds, found = self.worlds(), list[Floats]()
        seconds = wall_seconds(lambda: found.append(run(worlds, *more)))
        if self.expected is None:
            self.expected = found[0]
        self.same[name] = np.array_equal(found[0], self.expected)
        return seconds


def measure_stepping(quick: bool) -> dict[str, Any]:
    """Ways to step twelve worlds on two threads, over stepping them in turn."""
    stepping = Stepping(TunnelConfig(), 50 if quick else 300)
    stepping.timed("in turn", stepping.in_turn)
    with ThreadPoolExecutor(CORES) as pool:
        cases: dict[str, Callable[[], float]] = {
            "in turn": lambda: stepping.timed("in turn", stepping.in_turn),
            "threads": lambda: stepping.timed("threads", stepping.threads, pool),
            "mujoco.batch": lambda: stepping.timed("mujoco.batch", stepping.batch),
            "mujoco.rollout": lambda: stepping.timed("mujoco.rollout", stepping.rollout),
        }
        found = in_turn(cases, 2 if quick else 5)
    return {
        name: {"faster": spread(ratios(found["in turn"], times)), "same": stepping.same[name]}
        for name, times in list(found.items())[1:]
    }


def refused() -> str:
    """What the engine's batch says of tunnels as they are drawn."""
    config = TunnelConfig()
    gait, period = config.control.gait, config.control.period
    scene = make_scene(config.scene, config.tunnel)
    models = [draw_trial(config, scene, i, gait, period).world.model for i in range(WORLDS)]
    made = mujoco.batch.Batch(models[0], nsim=WORLDS, nthread=CORES, persistent=True)
    try:
        made.set_models(models)
    except mujoco.FatalError as error:
        return str(error).splitlines()[0]
    return ""


def measure(quick: bool) -> dict[str, Any]:
    """Whole trials, and stepping alone."""
    found = measure_trials(quick)
    return {**found, "stepping": measure_stepping(quick), "refused": refused()}
