"""What a trial costs beside its physics, how fast it runs, and how the cost grows with cylinders.

- `trial_over_bare_engine`: CPU time of whole tunnel trials (sensing, control, recording),
  stepped twelve at a time as the program does, over CPU time of the bare engine that replays their
  commands, one trial after the other, on the same models from the same starts. Drawing and
  compiling a tunnel is in neither. The replay must end on the same bits. The table shows trials
  stepped one at a time as well.
- `realtime_factor`: simulated seconds per CPU second of whole trials, twelve at a time.
- `growth`: CPU time per simulated second with n cylinders over that with 10. The robot paces to and
  fro at the start of one long tunnel, of which only the n cylinders nearest to the start are kept:
  its own work is the same in every case, and what is measured is what the others cost.
"""

from __future__ import annotations

import argparse
import json
import statistics
import time
from collections.abc import Callable
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import Any
from unittest import mock

import numpy as np

from antennate.control.gait import Gait
from antennate.control.loop import run_loop
from antennate.experiments.tunnel import batch as experiment
from antennate.experiments.tunnel.run import TunnelConfig
from antennate.params.scene import TunnelParams
from antennate.sim.gears import Gears
from antennate.sim.scenes import geometry
from antennate.sim.scenes.tunnel import Tunnel, TunnelScene
from antennate.sim.sim_robot import SimRobot
from antennate.sim.trial import Trial, draw_trial, make_world
from antennate.sim.world import PREFIX, World
from antennate.types import AntennaFrame, Floats, Ints, JointCommand, Maneuver

CONTROLLER = "closed"
LOCKSTEP = 12
"""Trials the program steps at once."""
COUNTS = (10, 30, 60, 120)
_PACING = 3.0
"""Time walked each way while the cost of cylinders is measured [s]: about one body length."""


@dataclass
class Tape:
    """What one world was told: per control tick leg friction (or None), controls and steps."""

    ticks: list[tuple[Floats | None, Floats, int]] = field(default_factory=list)
    friction: Floats | None = None


def seconds_of(action: Callable[[], Any]) -> float:
    """CPU time of an action [s]."""
    before = time.process_time()
    action()
    return time.process_time() - before


def prepare(config: TunnelConfig, trials: int) -> list[Trial]:
    """The starts of all trials, fresh."""
    scene, control = TunnelScene(config.tunnel), config.control
    return [draw_trial(config, scene, i, control.gait, control.period) for i in range(trials)]


def run_whole(config: TunnelConfig, starts: list[Trial], batch: int) -> None:
    """Run prepared trials as `antennate tunnel` does."""
    with mock.patch.object(experiment, "draw_trial", lambda _, __, trial, *___: starts[trial]):
        experiment.run_trials(config, CONTROLLER, range(len(starts)), lambda _: None, batch)


@contextmanager
def recording(worlds: list[World]):
    """Record what worlds are told while they run; yields one tape a world."""
    tapes = {id(world): Tape() for world in worlds}
    step, set_leg_friction = World.step, World.set_leg_friction

    def recorded_friction(self: World, friction: Floats) -> None:
        tapes[id(self)].friction = friction.copy()
        set_leg_friction(self, friction)

    def recorded_step(self: World, count: int) -> None:
        tape = tapes[id(self)]
        tape.ticks.append((tape.friction, self.data.ctrl.copy(), count))
        tape.friction = None
        step(self, count)

    with (
        mock.patch.object(World, "set_leg_friction", recorded_friction),
        mock.patch.object(World, "step", recorded_step),
    ):
        yield list(tapes.values())


def record(config: TunnelConfig, trials: int) -> tuple[list[Tape], list[World]]:
    """The tapes of all trials and the worlds as they ended."""
    starts = prepare(config, trials)
    worlds = [start.world for start in starts]
    with recording(worlds) as tapes:
        run_whole(config, starts, batch=1)
    return tapes, worlds


def replay(tapes: list[Tape], worlds: list[World]) -> None:
    """The bare engine: tell fresh worlds what the tapes say, one after the other.

    The friction of loaded gears, where servos have it, belongs to the engine.
    """
    for tape, world in zip(tapes, worlds, strict=True):
        data = world.data
        ctrl, step = data.ctrl, Gears(world.model, world.robot, PREFIX).step
        for friction, controls, count in tape.ticks:
            if friction is not None:
                world.set_leg_friction(friction)
            ctrl[:] = controls
            step(data, count)


def check_same(worlds: list[World], others: list[World]) -> None:
    """Refuse worlds that did not end on the same bits."""
    for i, (one, other) in enumerate(zip(worlds, others, strict=True)):
        for name in ("qpos", "qvel", "time"):
            if not np.array_equal(getattr(one.data, name), getattr(other.data, name)):
                raise SystemExit(f"trial {i}: {name} differs between the trial and its replay")


@dataclass(frozen=True)
class Cost:
    """Medians for one number of trials at once."""

    over_bare_engine: float
    realtime_factor: float


def measure_trials(config: TunnelConfig, trials: int, repetitions: int) -> dict[int, Cost]:
    """The cost of trials stepped one and twelve at a time, medians of interleaved repetitions."""
    tapes, ended = record(config, trials)
    simulated = sum(world.t for world in ended)
    ratios: dict[int, list[float]] = {1: [], LOCKSTEP: []}
    seconds: dict[int, list[float]] = {1: [], LOCKSTEP: []}
    for _ in range(repetitions):
        bare_worlds = [start.world for start in prepare(config, trials)]
        bare = seconds_of(lambda worlds=bare_worlds: replay(tapes, worlds))
        check_same(bare_worlds, ended)
        for batch in ratios:
            starts = prepare(config, trials)
            whole = seconds_of(lambda s=starts, b=batch: run_whole(config, s, b))
            check_same([start.world for start in starts], ended)
            ratios[batch].append(whole / bare)
            seconds[batch].append(whole)
    return {
        batch: Cost(statistics.median(ratios[batch]), simulated / statistics.median(seconds[batch]))
        for batch in ratios
    }


class Pacing:
    """A control that walks to and fro."""

    def __init__(self, config: TunnelConfig) -> None:
        self._gait = Gait(config.control.gait, config.robot, 1, config.control.period)

    def step(self, frame: AntennaFrame) -> JointCommand:
        back = int(frame.t[0] / _PACING) % 2
        return self._gait.step(np.array([int(Maneuver.REVERSE if back else Maneuver.FORWARD)]))


def long_tunnel(config: TunnelConfig) -> tuple[Tunnel, Ints]:
    """A tunnel with cylinders enough, and their order from the start."""
    segments = (1.0,) * 10
    turns = (90.0, -90.0) * 4 + (90.0,)
    params = TunnelParams(segments=segments, turns_deg=turns, mirror="never", strewn=20)
    drawn = TunnelScene(params).draw(config.robot, np.random.default_rng(0))
    along = [geometry.progress(drawn.centre, where) for where in drawn.cylinders]
    return drawn, np.argsort(along)


def seconds_with(config: TunnelConfig, drawn: Tunnel, seconds: float) -> float:
    """CPU time of pacing for some simulated seconds in this tunnel."""
    robot, period = config.robot, config.control.period
    world = make_world(config.physics, robot, drawn)
    world.place(0.0, 0.0, 0.0, np.zeros(robot.yaw_count), np.zeros((robot.links, 2)))
    body = SimRobot(1, robot, period, config.physics.timestep)
    chance = prepare(config, 1)[0].chance
    body.load(0, world, chance)
    control = Pacing(config)

    def go_on(frame: AntennaFrame, command: JointCommand) -> bool:
        return world.t < seconds

    return seconds_of(lambda: run_loop(body, control, period, go_on))


def measure_growth(config: TunnelConfig, seconds: float, repetitions: int) -> dict[str, float]:
    """Cost with n cylinders over the cost with the fewest, medians of interleaved repetitions."""
    drawn, order = long_tunnel(config)
    ratios: dict[int, list[float]] = {count: [] for count in COUNTS}
    for _ in range(repetitions):
        costs = {}
        for count in COUNTS:
            kept = replace(drawn, cylinders=drawn.cylinders[order[:count]])
            costs[count] = seconds_with(config, kept, seconds)
        for count in COUNTS:
            ratios[count].append(costs[count] / costs[COUNTS[0]])
    return {str(count): statistics.median(ratios[count]) for count in COUNTS}


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.add_argument("--trials", type=int, default=12, help="trials of the closed controller")
    parser.add_argument("--seconds", type=float, default=20.0, help="longest trial [s]")
    parser.add_argument("--repetitions", type=int, default=5, help="interleaved repetitions")
    options = parser.parse_args()
    config = TunnelConfig(time_limit=options.seconds)
    costs = measure_trials(config, options.trials, options.repetitions)
    growth = measure_growth(config, options.seconds, options.repetitions)
    if options.json:
        found = {
            "trial_over_bare_engine": costs[LOCKSTEP].over_bare_engine,
            "realtime_factor": costs[LOCKSTEP].realtime_factor,
            "growth": growth,
        }
        print(json.dumps(found, indent=2))
        return
    print("trials at once  over bare engine  realtime factor")
    for batch, cost in costs.items():
        print(f"{batch:14d}  {cost.over_bare_engine:16.2f}  {cost.realtime_factor:15.1f}")
    print("cylinders", *(f"{count:>6}" for count in growth))
    print("cost     ", *(f"{ratio:6.2f}" for ratio in growth.values()))


if __name__ == "__main__":
    main()
