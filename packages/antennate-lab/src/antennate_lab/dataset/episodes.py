"""Episodes on the bench: what chance draws, and what becomes of it, as windows of a data set."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from antennate.antenna.sensor import reading_noise
from antennate.antenna.statics import with_profile
from antennate.errors import SimulationError
from antennate.experiments.bench import recorded
from antennate.experiments.force.physics import place_along, speed_at, way
from antennate.experiments.sweep.physics import Trace, Wall, record
from antennate.params.bench import SweepParams
from antennate.robots.antenna import AntennaSpec
from antennate.sim.bench import Ball, Bench, compile_bench
from antennate.studies.columns import CONDITION, column, tabular, tabular_row
from antennate.studies.pooling import total
from antennate.types import Floats
from antennate_lab.dataset.columns import Windows
from antennate_lab.dataset.config import HISTORY, KINDS, DatasetConfig, Kind, split_of


@tabular
class Kept:
    """Windows of episodes, kept and left out."""

    windows: int = column("windows", pool=total, form="d", default=0)
    """Windows in the file, a row each."""
    untouched: int = column("left out, untouched", pool=total, form="d", default=0)
    """Windows left out because nothing touched in them, or no longer at their end."""


@tabular_row
class EpisodeRow(Kept):
    """One episode, a row of trials.csv."""

    seed: int
    trial: int
    """Number of the episode."""
    kind: str = field(metadata=CONDITION)
    """`walk`, `gap` or `push`."""
    split: str
    """Split of the episode."""
    status: Literal["valid", "invalid"]
    """`valid`, or `invalid` if the physics became so."""
    profile: str
    """Springs of the antennae."""
    speed_factor: float | None
    """Speed over the usual one; empty if its worker died."""
    reason: str = ""


@dataclass(frozen=True, slots=True)
class Draw:
    """What an episode has of its split: springs, speed, and a source of further chance.

    Attributes:
        rng: What is drawn of an episode depends on the seed, its kind and its number alone.
    """

    split: str
    profile: str
    factor: float
    rng: np.random.Generator


def drawn(config: DatasetConfig, kind: Kind, episode: int) -> Draw:
    """The profile and the speed of an episode."""
    rng = np.random.default_rng([config.seed, KINDS.index(kind), episode])
    split = split_of(episode)
    profile = config.held_out_profile if split == "test_antenna" else config.profile
    speeds = config.held_out_speeds if split == "test_speed" else config.speeds
    return Draw(split, profile, float(rng.uniform(*speeds)), rng)


def individual(config: DatasetConfig, draw: Draw) -> AntennaSpec:
    """An antenna of the profile with springs, friction and gain of its own."""
    antenna, vary, rng = config.robot.antenna, config.antennae, draw.rng
    factors = np.exp(rng.normal(0.0, vary.stiffness, antenna.hinges))
    rub = 1.0 + vary.friction * rng.uniform(-1.0, 1.0)
    gain = 1.0 + rng.normal(0.0, vary.gain)
    antenna = with_profile(antenna, draw.profile)
    coils = tuple((np.array(antenna.active_coils) / factors).tolist())
    sensor = antenna.sensor
    changed = {"bend_gain": sensor.bend_gain * gain}
    if sensor.kind == "fsr":
        changed = {"pressed_resistance": sensor.pressed_resistance / gain}
    return antenna.model_copy(
        update={
            "active_coils": coils,
            "friction": antenna.friction * rub,
            "sensor": sensor.model_copy(update=changed),
        }
    )


def setting(draw: Draw, episode: int, count: int) -> Windows:
    """Columns that all windows of an episode share, and their numbers."""
    return {
        "episode": np.full(count, episode),
        "window": np.arange(count),
        "split": [draw.split] * count,
        "profile": [draw.profile] * count,
        "speed_factor": np.full(count, draw.factor),
    }


def _readings(antenna: AntennaSpec, flex: Floats, rng: np.random.Generator) -> Floats:
    """Counts of the last window of a record of the flex, shape (1, HISTORY)."""
    noise = reading_noise(antenna.sensor, rng, (len(flex),))
    return recorded(antenna.sensor, flex, noise)[None, -HISTORY:]


def gap_windows(config: DatasetConfig, draw: Draw) -> Windows:
    """One window between two walls; empty unless both antennae touch their wall in it."""
    rng, gap = draw.rng, config.gap
    spread = gap.spread * rng.uniform(-1.0, 1.0, 2)
    sweep = SweepParams(
        centre=max(0.0, gap.centre + float(spread[0])),
        amplitude=gap.amplitude + float(spread[1]),
        frequency=gap.frequency * draw.factor,
    )
    tilt = gap.tilt * float(rng.uniform(-1.0, 1.0))
    windows: Windows = {"tilt_rad": np.array([tilt])}
    width = config.robot.antenna.base_spacing * math.cos(tilt)
    touched = True
    for side, sign in (("left", 1.0), ("right", -1.0)):
        antenna = individual(config, draw)
        distance = float(rng.uniform(*gap.distance)) * antenna.length
        zero = float(rng.normal(0.0, config.antennae.joint_zero))
        trace = _swept(config, antenna, sweep, Wall(distance, sign * tilt))
        last = slice(-HISTORY, None)
        windows[f"counts_{side}"] = _readings(antenna, trace.flex, rng)
        windows[f"antenna_{side[0]}_base"] = (trace.base + zero - antenna.base_angle)[None, last]
        windows[f"distance_{side}_m"] = np.array([distance])
        windows[f"flex_{side}_rad"] = abs(trace.flex[last]).max(keepdims=True)
        if side == "left":
            most = int(abs(trace.flex[last]).argmax())
            windows["base_to_tip_m"] = trace.reach[last][most : most + 1]
        touched &= bool(trace.touching[last].any())
        width += distance
    windows["gap_m"] = np.array([width])
    return windows if touched else {}


def _swept(config: DatasetConfig, antenna: AntennaSpec, sweep: SweepParams, wall: Wall) -> Trace:
    """Sweeps for the length of a window, after the base has come from the heading."""
    trace = record(config.bench, antenna, sweep, wall, config.history * sweep.frequency)
    if trace.reason:
        raise SimulationError(0, trace.reason)
    return trace


def push_windows(config: DatasetConfig, draw: Draw) -> Windows:
    """One window of a turn of the head against a post; empty if it slipped off before the end.

    The bench has a left antenna; on the right all is mirrored.
    """
    rng, push, antenna = draw.rng, config.push, individual(config, draw)
    place = float(rng.uniform(*push.place)) * antenna.length
    depth = float(rng.uniform(*push.depth))
    left = bool(rng.uniform() < 0.5)
    zeros = rng.normal(0.0, config.antennae.joint_zero, 1)
    turn = HeadTurn(config, antenna, push.speed * draw.factor)
    post = turn.post(place, depth, push.post_radius)
    seen = turn.against(post)
    if seen.force <= 0.0:
        return {}
    touching, free = ("left", "right") if left else ("right", "left")
    sign = 1.0 if left else -1.0
    still = individual(config, draw)  # the other antenna, in free air
    return {
        f"counts_{touching}": _readings(antenna, seen.flex, rng),
        f"counts_{free}": _readings(still, np.zeros(HISTORY), rng),
        config.robot.yaw_names[0]: (zeros - sign * seen.turn)[None],
        f"antenna_{touching[0]}_base": seen.base[None],
        f"antenna_{free[0]}_base": np.zeros((1, HISTORY)),
        "place_m": np.array([seen.place]),
        "side": [touching],
        "first_place_m": np.array([place]),
        "force_n": np.array([seen.force]),
        "flex_rad": np.array([abs(seen.flex).max()]),
        "friction": np.array([antenna.friction]),
    }


@dataclass(frozen=True, slots=True)
class Push:
    """A turn of the head against a post, sample by sample.

    Attributes:
        turn: Turn of the head to the left [rad], shape (HISTORY,).
        base: Angle of the antenna's base about its mounting angle [rad], same shape.
        flex: Flex under the flex sensor [rad], same shape.
        place: Where the post touches at the end, along the antenna from its base [m].
        force: Force of the post there, mean over the last sample [N].
    """

    turn: Floats
    base: Floats
    flex: Floats
    place: float
    force: float


@dataclass(frozen=True, slots=True)
class HeadTurn:
    """The head turns to the left about its yaw joint at a steady speed, for a window.

    The frame has the yaw joint at its origin; the heading of the body is x.

    Attributes:
        antenna: The left antenna.
        speed: Speed of the turn [rad/s].
    """

    config: DatasetConfig
    antenna: AntennaSpec
    speed: float

    def angle(self, t: float) -> float:
        """Turn of the head at a time [rad]; it goes as far to the left as it began right."""
        return way(t, self.speed) - way(self.config.history, self.speed) / 2.0

    def base(self, angle: float) -> Floats:
        """Place of the antenna's base at a turn of the head [m], shape (2,)."""
        ahead, aside = self.config.robot.link_pitch, self.antenna.base_spacing / 2.0
        c, s = math.cos(angle), math.sin(angle)
        return np.array([c * ahead - s * aside, s * ahead + c * aside])

    def post(self, place: float, depth: float, radius: float) -> Ball:
        """A post that the straight antenna meets at a place [m], `depth` [rad] before the end."""
        angle = self.angle(self.config.history) - depth
        heading = angle + self.antenna.base_angle
        along = np.array([math.cos(heading), math.sin(heading)])
        across = np.array([-along[1], along[0]])
        x, y = self.base(angle) + place * along + (self.antenna.radius + radius) * across
        return Ball(float(x), float(y), radius)

    def against(self, post: Ball) -> Push:
        """Turn against a post."""
        config, antenna = self.config, self.antenna
        bench = Bench(compile_bench(config.bench, antenna, [post]), antenna)
        start = self.angle(0.0)
        x, y = self.base(start).tolist()
        bench.place(x, y, start + antenna.base_angle)
        steps = round(1.0 / (config.rate * config.bench.timestep))
        rows: list[tuple[float, float, float]] = []
        force = np.zeros(2)
        for _ in range(HISTORY):
            angle, pace = self.angle(bench.t), speed_at(bench.t, self.speed)
            x, y = self.base(angle).tolist()
            bench.command(x, y, -pace * y, pace * x, angle + antenna.base_angle)
            force = bench.press(steps)
            angle = self.angle(bench.t)
            base = bench.base_angle() - angle - antenna.base_angle
            rows.append((angle, base, bench.flex()))
        turn, base, flex = np.array(rows).T
        place = place_along(bench.joints(), post) * antenna.length
        return Push(turn, base, flex, place, float(np.linalg.norm(force)))
