"""One antenna along the wall: what chance draws, and the way that its base takes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from antennate.antenna.statics import with_profile
from antennate.experiments.wall.config import COMMAND_PERIOD, WallConfig
from antennate.experiments.wall.outcome import SAMPLE_PERIOD, Traverse
from antennate.params.bench import WallParams
from antennate.params.scene import GRAVITY
from antennate.robots.antenna import AntennaSpec
from antennate.sim import chain
from antennate.sim.bench import Ball, Bench, Watch, compile_bench, unwatched
from antennate.types import Floats

SETTLE = 0.5
"""Time to come to rest under gravity before the approach [s]."""
SAMPLES = round(SAMPLE_PERIOD / COMMAND_PERIOD)
"""Commands to a sample."""
_CLEAR = 0.002
"""Distance between tip and crests before the approach [m]."""


@dataclass(frozen=True)
class Passage:
    """What chance has drawn for a trial, and what follows from it.

    Attributes:
        antenna: The antenna, with the trial's friction.
        factors: What each spring's stiffness is multiplied with, shape (n,).
        base: Angle of the antenna's base [rad].
        approach: Way of the base towards the wall [m].
        crest: Distance of the crests from its start [m].
    """

    config: WallConfig
    antenna: AntennaSpec
    factors: Floats
    balls: Sequence[Ball]
    base: float
    approach: float
    crest: float

    @property
    def pull(self) -> tuple[float, float]:
        """Gravity in the plane [m/s²]."""
        ways = {"down": -GRAVITY, "up": GRAVITY, "off": 0.0}
        return 0.0, ways[self.config.wall.gravity]

    def bench(self) -> Bench:
        """The bench at the trial's start."""
        model = compile_bench(self.config.physics, self.antenna, self.balls, self.pull)
        for i, factor in enumerate(self.factors):
            joint = model.joint(f"antenna/hinge{i}")
            joint.stiffness *= factor
        bench = Bench(model, self.antenna)
        bench.place(0.0, 0.0, self.base)
        return bench

    def traverse(self, begin: float, went: chain.Motion) -> Traverse:
        """What was seen on the way.

        Args:
            begin: Place of the tip along the wall as the travel began [m].
            went: After the commands `kept`.
        """
        path = ramp(self.config.wall.travel, self.config.wall.speed)
        rows, shown_at = kept(len(path)), marks(path)
        sampled = [row for row, i in enumerate(rows) if i % SAMPLES == 0]
        shown = [row for row, i in enumerate(rows) if i in shown_at]
        seen = went[sampled]
        return Traverse(
            np.array(path[::SAMPLES]),
            seen.joints[:, -1, 1] - begin,
            seen.touching.astype(float),
            np.hypot(*seen.force.T),
            seen.hinges[:, : self.antenna.sensed_hinges].sum(axis=1),
            seen.hinges,
            went[shown].joints - [self.crest, 0.0],
            from_crest(self.balls, self.crest),
        )


def kept(count: int) -> list[int]:
    """Commands of a travel of so many after which something is kept: samples, and shapes."""
    return sorted({*range(0, count, SAMPLES), *marks(range(count))})


def draw(config: WallConfig, profile: str, trial: int) -> Passage:
    """Draw a trial of a profile; all profiles meet the same chance."""
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
    way = math.pi / 2 - angle, overlap + _CLEAR, crest
    return Passage(config, antenna, factors, balls, *way)


def passage(config: WallConfig, profile: str, trial: int, watch: Watch = unwatched) -> Traverse:
    """Move one antenna along the wall; `watch` looks at the bench of the engine, not at the chain.

    Raises:
        MissingPackageError: The solver needs a package that is not installed.
        SimulationError: The physics became invalid.
    """
    drawn = draw(config, profile, trial)
    return _on_chain(drawn) if config.solver == "chain" else _on_engine(drawn, watch)


def _on_engine(drawn: Passage, watch: Watch) -> Traverse:
    wall, physics = drawn.config.wall, drawn.config.physics
    bench, base, approach = drawn.bench(), drawn.base, drawn.approach
    bench.step(round(SETTLE / physics.timestep))
    substeps = round(COMMAND_PERIOD / physics.timestep)
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
        if i % SAMPLES == 0:
            force = float(np.hypot(*bench.contact_force()))
            tip = bench.tip()[1] - begin
            rows.append((y, tip, bench.touching(), force, bench.flex()))
            hinges.append(bench.hinges().copy())
    base_y, tip_y, touching, forces, flex = np.array(rows, float).T
    crest = drawn.crest
    drawing = np.array(hinges), np.array(shapes) - [crest, 0.0], from_crest(drawn.balls, crest)
    return Traverse(base_y, tip_y, touching, forces, flex, *drawing)


def _on_chain(drawn: Passage) -> Traverse:
    """As `_on_engine`, all commands of a way at once."""
    speed, physics = drawn.config.wall.speed, drawn.config.physics
    bench = chain.ChainBench(physics, drawn.antenna, drawn.balls, drawn.pull, factors=drawn.factors)
    substeps, base = round(COMMAND_PERIOD / physics.timestep), drawn.base
    bench.place(0.0, 0.0, base)
    still = bench.commands(np.zeros((1, 2)), np.zeros(2), base)
    bench.drive(still, round(SETTLE / physics.timestep))
    ahead = np.array(ramp(drawn.approach, speed))
    path = np.array(ramp(drawn.config.wall.travel, speed))
    there = np.column_stack([ahead, np.zeros_like(ahead)])
    came = bench.drive(bench.commands(there, np.array([speed, 0.0]), base), substeps)
    along = np.column_stack([np.full_like(path, drawn.approach), path])
    went = bench.drive(bench.commands(along, np.array([0.0, speed]), base), substeps)
    return drawn.traverse(came[-1:].joints[-1, -1, 1], went[kept(len(path))])


def spheres(
    wall: WallParams, antenna: AntennaSpec, angle: float, phase: float, crest: float
) -> list[Ball]:
    """Spheres all along the way, their crests clear of the tip at first.

    Args:
        wall: Its numbers.
        antenna: The antenna that passes.
        angle: Of the antenna against the way, at its base [rad].
        phase: How far the first sphere stands on along the way [m].
        crest: Distance of the crests from the base [m].
    """
    pitch = wall.sphere_diameter
    below = -2 * pitch - max(0.0, -antenna.length * math.cos(angle))
    above = wall.travel + 1.2 * antenna.length
    heights = np.arange(below + phase, above, pitch)
    return [Ball(crest + pitch / 2, float(y), pitch / 2) for y in heights]


def from_crest(balls: Sequence[Ball], crest: float) -> Floats:
    """Centres of spheres from the crest on, and their radii [m], shape (n, 3)."""
    return np.array([(ball.x - crest, ball.y, ball.radius) for ball in balls])


def marks(path: Sequence[float] | Floats) -> set[int]:
    """Indices on a way at which the antenna's shape is kept: both ends and each tenth between."""
    return {round(i * (len(path) - 1) / 10) for i in range(11)}


def ramp(length: float, speed: float) -> list[float]:
    """Places of the base on a way of this length [m] at a speed [m/s], one each command period."""
    count = max(1, math.ceil(length / (speed * COMMAND_PERIOD) - 1e-9))
    return (length * np.arange(1, count + 1) / count).tolist()
