"""What a trial costs beside its physics, and a physics step beside that of a humanoid.

- `over_bare_engine`: CPU time of whole tunnel trials (sensing, control, recording), stepped as many
  at a time as the program does at most, over CPU time of the bare engine that replays their
  commands, one trial after the other, on the same models from the same starts. Drawing and
  compiling a tunnel is in neither. The replay must end on the same bits, and so must every timed
  trial.
- `bare_at_once`: the bare engine that steps as many worlds in turn, over one after the other.
- `step_over_humanoid`: a physics step of the tunnel over one of a humanoid that falls on a floor.
- `tick`: how long a controller takes for one control tick, alone and for many robots at once.
"""

from __future__ import annotations

import itertools
import math
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any
from unittest import mock

import mujoco
import numpy as np
from measuring import cpu_seconds, in_turn, ratios, spread

from antennate.control.registry import make_controller
from antennate.experiments.tunnel import lockstep
from antennate.experiments.tunnel.batch import BATCH, run_trials
from antennate.experiments.tunnel.lockstep import Apparatus
from antennate.experiments.tunnel.physics import TunnelConfig
from antennate.sim.places import Gears
from antennate.sim.scenes.tunnel import TunnelScene
from antennate.sim.trial import Trial, draw_trial
from antennate.sim.world import PREFIX, World
from antennate.types import AntennaFrame, Controller, Floats, JointCommand

CONTROLLER = "closed"
LOCKSTEP = BATCH
"""Trials the program steps at once."""
HUMANOID_STEPS = 10_000
HUMANOID_STEP = 0.005
"""Its physics step [s]."""


@dataclass
class Tape:
    """What one world was told: per control tick leg friction (or None), controls and steps."""

    ticks: list[tuple[Floats | None, Floats, int]] = field(default_factory=list)
    friction: Floats | None = None


def prepare(config: TunnelConfig, trials: int) -> list[Trial]:
    """The starts of all trials, fresh."""
    scene, control = TunnelScene(config.tunnel), config.control
    return [draw_trial(config, scene, i, control.gait, control.period) for i in range(trials)]


def run_whole(config: TunnelConfig, starts: list[Trial], batch: int, **more: Any) -> None:
    """Run prepared trials as `antennate tunnel` does."""
    with mock.patch.object(lockstep, "draw_trial", lambda _, __, trial, *___: starts[trial]):
        run_trials(config, CONTROLLER, range(len(starts)), lambda _: None, batch, **more)


@contextmanager
def recording(worlds: list[World]):
    """Record what worlds are told while they run; yields one tape a world."""
    tapes = {id(world): Tape() for world in worlds}
    advance, set_leg_friction = World.advance, World.set_leg_friction

    def recorded_friction(self: World, friction: Floats) -> None:
        tapes[id(self)].friction = friction.copy()
        set_leg_friction(self, friction)

    def recorded_advance(self: World, count: int) -> None:
        tape = tapes[id(self)]
        tape.ticks.append((tape.friction, self.data.ctrl.copy(), count))
        tape.friction = None
        advance(self, count)

    with (
        mock.patch.object(World, "set_leg_friction", recorded_friction),
        mock.patch.object(World, "advance", recorded_advance),
    ):
        yield list(tapes.values())


def record(config: TunnelConfig, trials: int) -> tuple[list[Tape], list[World]]:
    """The tapes of all trials and the worlds as they ended."""
    starts = prepare(config, trials)
    worlds = [start.world for start in starts]
    with recording(worlds) as tapes:
        run_whole(config, starts, batch=1)
    return tapes, worlds


def replay(tapes: list[Tape], worlds: list[World], batch: int = 1) -> None:
    """The bare engine: tell fresh worlds what the tapes say, so many in turn, a tick each.

    The friction of loaded gears, where servos have it, belongs to the engine.
    """
    players = [play(tape, world) for tape, world in zip(tapes, worlds, strict=True)]
    for begin in range(0, len(players), batch):
        for _ in itertools.zip_longest(*players[begin : begin + batch]):
            pass


def play(tape: Tape, world: World) -> Iterator[None]:
    """Tell a world what a tape says, and stop after each tick."""
    data = world.data
    ctrl, step = data.ctrl, Gears(world.model, world.robot, PREFIX).step
    for friction, controls, count in tape.ticks:
        if friction is not None:
            world.set_leg_friction(friction)
        ctrl[:] = controls
        step(data, count)
        yield


def check_same(worlds: list[World], others: list[World]) -> None:
    """Refuse worlds that did not end on the same bits."""
    for i, (one, other) in enumerate(zip(worlds, others, strict=True)):
        for name in ("qpos", "qvel", "time"):
            if not np.array_equal(getattr(one.data, name), getattr(other.data, name)):
                raise SystemExit(f"trial {i}: {name} differs between the trial and its replay")


def humanoid() -> mujoco.MjModel:
    """A humanoid on a floor with the engine's own numerics at 5 ms.

    It is our own, as the engine's package holds none: as many degrees of freedom (27) and motors
    (21) as the humanoid of the engine's samples, and about as many capsules.
    """
    spec = mujoco.MjSpec()
    spec.compiler.degree = False
    spec.option.timestep = HUMANOID_STEP
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[20, 20, 1])
    capsule = mujoco.mjtGeom.mjGEOM_CAPSULE

    def part(parent: Any, name: str, at: tuple[float, ...], axes: str, *ends: tuple[float, ...]):
        """A body on hinges about some axes, of capsules from its origin (to x, y, z; radius)."""
        body = parent.add_body(name=name, pos=at)
        for axis in axes:
            joint = f"{name}_{axis}"
            body.add_joint(
                name=joint,
                axis=[float(axis == each) for each in "xyz"],
                range=[-1.2, 1.2],
                limited=mujoco.mjtLimited.mjLIMITED_TRUE,
                stiffness=5.0,
                damping=2.0,
                armature=0.01,
            )
            spec.add_actuator(
                name=joint, trntype=mujoco.mjtTrn.mjTRN_JOINT, target=joint, gear=[40] + [0] * 5
            )
        for *end, radius in ends:
            body.add_geom(type=capsule, fromto=[0, 0, 0, *end], size=[radius, 0, 0])
        return body

    chest = part(spec.worldbody, "chest", (0, 0, 1.4), "", (0, 0.1, 0, 0.07), (0, -0.1, 0, 0.07))
    chest.add_freejoint(name="root")
    part(chest, "head", (0, 0, 0.15), "", (0, 0, 0.08, 0.08))
    waist = part(chest, "waist", (0, 0, -0.2), "yz", (0, 0.06, 0, 0.06), (0, -0.06, 0, 0.06))
    pelvis = part(waist, "pelvis", (0, 0, -0.17), "x", (0, 0.07, 0, 0.09), (0, -0.07, 0, 0.09))
    for number, sign in (("1", 1.0), ("2", -1.0)):
        thigh = part(pelvis, f"thigh_{number}", (0, sign * 0.1, 0), "xzy", (0, 0, -0.34, 0.06))
        shin = part(thigh, f"shin_{number}", (0, 0, -0.4), "y", (0, 0, -0.3, 0.045))
        foot = part(shin, f"foot_{number}", (0, 0, -0.39), "yx", (0.14, 0.02, 0, 0.027))
        foot.add_geom(type=capsule, fromto=[-0.07, 0, 0, 0.14, -0.02, 0], size=[0.027, 0, 0])
        upper = (0.16, sign * 0.16, -0.16)
        arm = part(chest, f"arm_{number}", (0, sign * 0.17, 0.06), "xy", (*upper, 0.04))
        part(arm, f"forearm_{number}", (0.18, sign * 0.18, -0.18), "y", (0.17, 0, 0.17, 0.03))
    return spec.compile()


def fall(model: mujoco.MjModel, steps: int) -> float:
    """CPU time of physics steps of a humanoid that moves all motors at random [s]."""
    data, rng = mujoco.MjData(model), np.random.default_rng(0)
    ticks = rng.uniform(-0.3, 0.3, (steps // 10, model.nu))

    def go() -> None:
        for targets in ticks:
            data.ctrl[:] = targets
            mujoco.mj_step(model, data, 10)

    return cpu_seconds(go)


def measure(quick: bool) -> dict[str, Any]:
    """Trials one and many at a time over the bare engine, and its step over a humanoid's."""
    config = TunnelConfig(time_limit=3.0 if quick else 8.0)
    trials = 6 if quick else LOCKSTEP
    tapes, ended = record(config, trials)
    simulated = sum(world.t for world in ended)
    ticks = sum(len(tape.ticks) for tape in tapes)
    model, steps = humanoid(), HUMANOID_STEPS

    def bare(batch: int) -> float:
        worlds = [start.world for start in prepare(config, trials)]
        seconds = cpu_seconds(lambda: replay(tapes, worlds, batch))
        check_same(worlds, ended)
        return seconds

    def whole(batch: int) -> float:
        starts = prepare(config, trials)
        seconds = cpu_seconds(lambda: run_whole(config, starts, batch))
        check_same([start.world for start in starts], ended)
        return seconds

    cases: dict[Any, Callable[[], float]] = {
        "bare": lambda: bare(1),
        "bare at once": lambda: bare(LOCKSTEP),
        1: lambda: whole(1),
        LOCKSTEP: lambda: whole(LOCKSTEP),
        "humanoid": lambda: fall(model, steps),
    }
    found = in_turn(cases, 3 if quick else 5)
    step = [1e6 * s / simulated * config.physics.timestep for s in found["bare"]]
    step_humanoid = [1e6 * s / steps for s in found["humanoid"]]
    return {
        "trials": trials,
        "simulated_s": round(simulated, 1),
        "at_once": {
            str(n): {
                "over_bare_engine": spread(ratios(found[n], found["bare"])),
                "realtime_factor": spread([simulated / s for s in found[n]]),
                "own_us_per_tick": spread(
                    [1e6 * (a - b) / ticks for a, b in zip(found[n], found["bare"], strict=True)]
                ),
            }
            for n in (1, LOCKSTEP)
        },
        "bare_at_once": spread(ratios(found["bare at once"], found["bare"])),
        "step_us": spread(step),
        "humanoid_step_us": spread(step_humanoid),
        "step_over_humanoid": spread(ratios(step, step_humanoid)),
        "humanoid": {"dof": model.nv, "motors": model.nu, "geoms": model.ngeom},
        "tunnel": {"dof": ended[0].model.nv, "geoms": ended[0].model.ngeom},
    }


class Noting:
    """A controller that keeps what it reads."""

    def __init__(self, made: Controller) -> None:
        self._made, self.frames = made, list[AntennaFrame]()

    def __getattr__(self, name: str) -> Any:
        return getattr(self._made, name)

    def step(self, frame: AntennaFrame) -> JointCommand:
        self.frames.append(frame)
        return self._made.step(frame)


def frames_of(config: TunnelConfig, trials: int) -> list[AntennaFrame]:
    """What a controller reads in real trials, until the first of them ends."""
    kept = list[Noting]()

    def make(name: str, *arguments: Any) -> Any:
        kept.append(Noting(make_controller(name, *arguments)))
        return kept[-1]

    run_whole(config, prepare(config, trials), trials, apparatus=Apparatus(make))
    return [frame for frame in kept[0].frames if np.isfinite(frame.t).all()]


def tick_times(config: TunnelConfig, frames: list[AntennaFrame], rows: int) -> Floats:
    """Time on the clock of each control tick for so many robots [µs]."""
    control = make_controller(CONTROLLER, config.control, config.robot, rows)
    control.reset(np.arange(rows), np.linspace(0.0, 2.0 * math.pi, rows))
    columns = np.arange(rows) % len(frames[0].t)
    wide = [AntennaFrame(t=f.t[columns], counts=f.counts[columns]) for f in frames]
    times = np.zeros(len(wide))
    for i, frame in enumerate(wide):
        before = time.perf_counter_ns()
        control.step(frame)
        times[i] = time.perf_counter_ns() - before
    return times / 1e3


def measure_ticks(quick: bool) -> dict[str, Any]:
    """Median and 99th percentile of a control tick, for one robot and for many at once."""
    config = TunnelConfig(time_limit=3.0 if quick else 10.0)
    frames = frames_of(config, LOCKSTEP)
    sizes = (1, 12, 128, 1024)
    taken: dict[int, list[Floats]] = {rows: [] for rows in sizes}
    for i in range(3 if quick else 7):
        for rows in sizes[:: -1 if i % 2 else 1]:
            taken[rows].append(tick_times(config, frames, rows))
    return {
        "ticks": len(frames),
        "period_us": 1e6 * config.control.period,
        "robots": {
            str(rows): {
                name: spread([float(np.percentile(t, share)) for t in times])
                for name, share in (("p50", 50), ("p99", 99))
            }
            for rows, times in taken.items()
        },
    }
