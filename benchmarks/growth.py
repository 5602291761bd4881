"""How the CPU time of a simulated second grows with hinges, links, cylinders and robots.

- `hinges`, `links`: the robot walks on a flat floor with more hinges an antenna, or more links.
- `cylinders`: it paces to and fro at the start of one long tunnel, of which only the n cylinders
  nearest to the start are kept. Its own work is the same in every case, and what is measured is
  what resting cylinders cost.
- `robots`: the same tunnel trials with so many of them stepped in lockstep.

Every figure is a ratio to the first case of its kind.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import trial
from measuring import cpu_seconds, in_turn, ratios, spread

from antennate.control.gait import Gait
from antennate.control.loop import run_loop
from antennate.experiments.tunnel.physics import TunnelConfig
from antennate.params.scene import TunnelParams
from antennate.robots.antenna import AntennaSpec
from antennate.robots.spec import RobotSpec
from antennate.sim.scenes import geometry
from antennate.sim.scenes.scene import FlatScene, SceneInstance
from antennate.sim.scenes.tunnel import Tunnel, TunnelScene
from antennate.sim.sim_robot import Disturbance, SimRobot
from antennate.sim.trial import make_world, place_at_start
from antennate.types import AntennaFrame, Ints, JointCommand, Maneuver

CYLINDERS = (10, 30, 60, 120)
HINGES = (6, 12, 24, 48)
LINKS = (6, 12, 24)
ROBOTS = (1, 2, 4, 12, 24)
_PACING = 3.0
"""Time walked each way while the cost of cylinders is measured [s]: about one body length."""


class Pacing:
    """A control that walks on, or to and fro."""

    def __init__(self, config: TunnelConfig, fro: bool) -> None:
        self._gait = Gait(config.control.gait, config.robot, 1, config.control.period)
        self._fro = fro

    def step(self, frame: AntennaFrame) -> JointCommand:
        back = self._fro and int(frame.t[0] / _PACING) % 2
        return self._gait.step(np.array([int(Maneuver.REVERSE if back else Maneuver.FORWARD)]))


def long_tunnel(config: TunnelConfig) -> tuple[Tunnel, Ints]:
    """A tunnel with cylinders enough, and their order from the start."""
    segments = (1.0,) * 10
    turns = (90.0, -90.0) * 4 + (90.0,)
    params = TunnelParams(segments=segments, turns_deg=turns, mirror="never", strewn=20)
    drawn = TunnelScene(params).draw(config.robot, np.random.default_rng(0))
    along = [geometry.progress(drawn.centre, where) for where in drawn.cylinders]
    return drawn, np.argsort(along)


def walk(config: TunnelConfig, drawn: SceneInstance, seconds: float, fro: bool = False) -> float:
    """CPU time of walking in this scene, sensing and control included, for a simulated time [s]."""
    robot, period = config.robot, config.control.period
    world = make_world(config.physics, robot, drawn)
    place_at_start(world, drawn, config.control.gait)
    body = SimRobot(1, robot, period, config.physics.timestep)
    body.load(0, world, Disturbance(np.random.default_rng(0), config.variation, robot, period))
    control = Pacing(config, fro)

    def go_on(frame: AntennaFrame, command: JointCommand) -> bool:
        return body.failures.get(0) is None and world.t < seconds

    taken = cpu_seconds(lambda: run_loop(body, control, period, go_on))
    if failure := body.failures.get(0):
        raise SystemExit(f"a robot of {robot.links} links failed: {failure}")
    return taken


def flat(seconds: float, robot: RobotSpec = RobotSpec()) -> float:  # noqa: B008  (it is frozen)
    """CPU time of walking on a flat floor [s]."""
    config = TunnelConfig(robot=robot)
    return walk(config, FlatScene().draw(robot, np.random.default_rng(0)), seconds)


def with_hinges(count: int) -> RobotSpec:
    """The robot with the springs of its antennae cut into shorter ones, which bend as much."""
    usual = AntennaSpec()
    cut = count // usual.hinges
    coils = np.repeat(usual.active_coils, cut) / cut
    antenna = usual.model_copy(
        update={
            "active_coils": tuple(coils.tolist()),
            "link_mass": usual.link_mass / cut,
            "sensor_stiffness_n_mm_per_deg": usual.sensor_stiffness_n_mm_per_deg * cut,
        }
    )
    return RobotSpec(antenna=antenna)


def with_links(count: int) -> RobotSpec:
    """The robot with more links, each as heavy as now."""
    usual = RobotSpec()
    return RobotSpec(links=count, mass=usual.mass / usual.links * count)


def measure(quick: bool) -> dict[str, Any]:
    """All growths, medians over repetitions in turn."""
    seconds, repetitions = (1.0, 2) if quick else (4.0, 3)
    config = TunnelConfig()
    drawn, order = long_tunnel(config)

    def tunnel(count: int) -> Callable[[], float]:
        kept = replace(drawn, cylinders=drawn.cylinders[order[:count]])
        return lambda: walk(config, kept, 2 * seconds, fro=True)

    short = TunnelConfig(time_limit=seconds / 2)

    def lockstep(count: int) -> Callable[[], float]:
        def run() -> float:
            starts = trial.prepare(short, max(ROBOTS))
            return cpu_seconds(lambda: trial.run_whole(short, starts, count))

        return run

    kinds: dict[str, tuple[Sequence[int], Callable[[int], Callable[[], float]]]] = {
        "hinges": (HINGES, lambda n: lambda: flat(seconds, with_hinges(n))),
        "links": (LINKS, lambda n: lambda: flat(seconds, with_links(n))),
        "cylinders": (CYLINDERS, tunnel),
        "robots": (ROBOTS, lockstep),
    }
    cases = {(kind, n): make(n) for kind, (sizes, make) in kinds.items() for n in sizes}
    found = in_turn(cases, repetitions)
    simulated = {
        "hinges": seconds,
        "links": seconds,
        "cylinders": 2 * seconds,
        "robots": max(ROBOTS) * seconds / 2,
    }
    return {
        kind: {
            str(n): {
                "ratio": spread(ratios(found[kind, n], found[kind, sizes[0]])),
                "ms_per_s": spread([1e3 * s / simulated[kind] for s in found[kind, n]]),
            }
            for n in sizes
        }
        for kind, (sizes, _) in kinds.items()
    }
