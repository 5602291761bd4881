"""Episodes of a robot that walks beside a wall, its antennae held or sweeping as the gait says.

It walks straight on whatever it feels, so that the data belong to no controller. Head and body
swing with the gait: the labels are means over a window.
"""

from __future__ import annotations

import math

import numpy as np

from antennate.control.gait import Gait
from antennate.control.loop import run_loop
from antennate.errors import SimulationError
from antennate.params.gaits import GaitParams
from antennate.params.scene import VariationParams
from antennate.robots.spec import RobotSpec
from antennate.sim.scenes.wall import Wall
from antennate.sim.sim_robot import Disturbance, SimRobot
from antennate.sim.trial import MOST_OVERLAP, make_world, place_at_start
from antennate.sim.world import World
from antennate.types import AntennaFrame, Floats, JointCommand, Maneuver
from antennate_lab.dataset.columns import Windows, joints_of
from antennate_lab.dataset.config import HISTORY, DatasetConfig
from antennate_lab.dataset.episodes import Draw, individual

_LENGTH = 20.0
"""Length of the wall [m]: nobody comes to its end."""
_STARTS = 100
"""Most starts drawn until one is free of the wall."""


class Forward:
    """Control that walks forward from a gait phase, whatever the antennae feel."""

    def __init__(self, gait: GaitParams, robot: RobotSpec, period: float, phase: float) -> None:
        self._gait = Gait(gait, robot, 1, period)
        self._gait.reset(np.array([0]), phase)
        self._maneuver = np.array([int(Maneuver.FORWARD)])

    def step(self, frame: AntennaFrame) -> JointCommand:
        """The joint targets of the next tick."""
        return self._gait.step(self._maneuver)


def gait_of(config: DatasetConfig, factor: float) -> GaitParams:
    """The gait of an episode: faster by a factor."""
    gait = config.gait
    return gait.model_copy(
        update={
            "frequency": gait.frequency * factor,
            "antenna_frequency": min(1.0, gait.antenna_frequency * factor),
        }
    )


def axis_of(links: Floats) -> Floats:
    """Direction from the last link to the first [rad], shape (...,).

    Args:
        links: Places of the links, head first [m], shape (..., L, 2).
    """
    ahead = links[..., 0, :] - links[..., -1, :]
    return np.arctan2(ahead[..., 1], ahead[..., 0])


def walk_windows(config: DatasetConfig, draw: Draw) -> Windows:
    """The windows of a walk in which an antenna touches the wall."""
    rng, walk = draw.rng, config.walk
    robot = config.robot.model_copy(update={"antenna": individual(config, draw)})
    side = 1.0 if rng.uniform() < 0.5 else -1.0
    wall = Wall(_LENGTH, robot.width, side)
    world = make_world(config.physics, robot, wall)
    world.model.geom("wall").friction[0] = 0.0  # the larger of two counts: that of the antenna
    gait, phase = gait_of(config, draw.factor), float(rng.uniform(0.0, 2.0 * math.pi))
    if draw.split != "test_speed":
        robot.require_pace("gait.frequency", gait.frequency)
    _place(config, world, wall, gait, phase, side, rng)
    vary = VariationParams(joint_bias=config.antennae.joint_zero)
    ticks = _walked(config, world, gait, phase, Disturbance(rng, vary, robot, 1.0 / config.rate))
    count = len(ticks["t"])
    stride = round(walk.stride * config.rate)
    ends = [count - stride * k for k in reversed(range(walk.windows))]
    towards = side * axis_of(ticks["links"])
    distance = np.array([wall.gap(head) for head in ticks["links"][:, 0]]) + robot.width / 2.0
    kept = [end for end in ends if ticks["antenna"][end - HISTORY : end].any()]
    cut = [slice(end - HISTORY, end) for end in kept]

    def mean(values: Floats) -> Floats:
        return np.array([values[part].mean() for part in cut])

    def stacked(values: Floats) -> Floats:
        return np.array([values[part] for part in cut]).reshape(len(cut), HISTORY)

    joints = {
        name: stacked(ticks["positions"][:, i]) for i, name in enumerate(joints_of("walk", robot))
    }
    return {
        "counts_left": stacked(ticks["counts"][:, 0]),
        "counts_right": stacked(ticks["counts"][:, 1]),
        **joints,
        "distance_m": mean(distance),
        "angle_rad": mean(towards),
        "side": ["left" if side > 0 else "right"] * len(cut),
        "antenna_touch": mean(ticks["antenna"]),
        "body_touch": mean(ticks["body"]),
        "friction": np.full(len(cut), robot.antenna.friction),
        "end_s": np.array([ticks["t"][end - 1] for end in kept]),
    }


def _place(
    config: DatasetConfig,
    world: World,
    wall: Wall,
    gait: GaitParams,
    phase: float,
    side: float,
    rng: np.random.Generator,
) -> None:
    """Put the robot where it stands free of the wall, its body at the angle that is drawn."""
    middle = wall.gap(np.zeros(2)) + world.robot.width / 2.0
    for _ in range(_STARTS):
        distance = float(rng.uniform(*config.walk.distance))
        angle = side * float(rng.uniform(*config.walk.angle))
        lateral = side * (middle - distance)
        place_at_start(world, wall, gait, phase, lateral, 0.0)
        turned = float(axis_of(world.links()))
        place_at_start(world, wall, gait, phase, lateral, angle - turned)
        if world.obstacle_overlap() <= MOST_OVERLAP:
            return
    raise SimulationError(
        0, "walk.distance: expected room beside the wall, found none in 100 starts"
    )


def _walked(
    config: DatasetConfig, world: World, gait: GaitParams, phase: float, chance: Disturbance
) -> dict[str, Floats]:
    """Ticks of a walk: `t`, `counts`, `positions`, `links`, `antenna` and `body` at the wall."""
    period = 1.0 / config.rate
    body = SimRobot(1, world.robot, period, config.physics.timestep)
    body.load(0, world, chance)
    last = round(config.walk.time * config.rate)
    ticks: dict[str, list[Floats]] = {
        name: [] for name in ("t", "counts", "positions", "links", "antenna", "body")
    }

    def go_on(frame: AntennaFrame, command: JointCommand) -> bool:
        if (failure := body.failures.get(0)) is not None:
            raise failure
        names = world.obstacle_contacts()[1]
        at_wall = [name.startswith("antenna") for name in names]
        row = (
            frame.t[0],
            frame.counts[0],
            frame.positions[0],
            world.links().copy(),
            float(any(at_wall)),
            float(not all(at_wall)),
        )
        for values, value in zip(ticks.values(), row, strict=True):
            values.append(np.asarray(value))
        return len(ticks["t"]) < last

    run_loop(body, Forward(gait, world.robot, period, phase), period, go_on)
    return {name: np.array(values) for name, values in ticks.items()}
