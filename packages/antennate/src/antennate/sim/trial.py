"""One trial: its scene, the robot's start and its disturbances, from a seed and a number."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from pydantic import field_validator, model_validator

from antennate.control.gait import targets
from antennate.control.readers import unused
from antennate.errors import FAILURES, ConfigError, SceneError, raised
from antennate.params.base import Params, changes, from_values, number, paths_of
from antennate.params.control import ControlParams
from antennate.params.gaits import GaitParams
from antennate.params.scene import (
    GROUND_READS,
    CorridorsParams,
    GroundParams,
    PhysicsParams,
    TunnelParams,
    VariationParams,
)
from antennate.robots.antenna import require_own_curve
from antennate.robots.spec import RobotSpec, WalkingRobot
from antennate.sim.episode import Episode
from antennate.sim.scenes.registry import CORRIDORS, SHIPPED, TUNNEL, check_name, make_scene
from antennate.sim.scenes.scene import Scene, SceneInstance
from antennate.sim.sim_robot import Disturbance
from antennate.sim.world import World, compile_world

MOST_OVERLAP = 0.005
"""Deepest that the robot may be in an obstacle at the start [m]: legs stand on edges."""
MEMBERS = ("start", "length", "exit", "build", "progress", "left")
"""What a SceneInstance has."""


class TrialConfig(Params):
    """What decides how a trial starts."""

    offered: ClassVar[Mapping[str, Collection[str]]] = {"scene": SHIPPED}

    seed: int = number(0, "1", "assumed: any", ge=0)
    """Seed of all chance."""
    scene: str = number(TUNNEL, "1", "paper: a cluttered tunnel")
    """{offered}, a MJCF file.xml, MODULE:CLASS or file.py:CLASS."""
    tunnel: TunnelParams = TunnelParams()
    corridors: CorridorsParams = CorridorsParams()
    ground: GroundParams = GroundParams()
    robot: WalkingRobot = RobotSpec()
    variation: VariationParams = VariationParams()
    physics: PhysicsParams = PhysicsParams()

    @field_validator("scene")
    @classmethod
    def _known(cls, name: str) -> str:
        return check_name(name)

    def unread_here(self) -> Mapping[str, str]:
        """What this robot does not have, and ranges of a scene that is another."""
        ranges = () if self.scene == CORRIDORS else paths_of(CorridorsParams, CORRIDORS)
        return {
            **unused(self.robot),
            **dict.fromkeys(ranges, f"it belongs to the scene {CORRIDORS!r}"),
            **{f"ground.{name}": why for name, why in self._unread_ground()},
        }

    def _unread_ground(self) -> Iterator[tuple[str, str]]:
        """Sizes of ground that the scene does not have, and whose they are."""
        for name in GroundParams.model_fields:
            scenes = [scene for scene, read in GROUND_READS.items() if name in read]
            if self.scene not in scenes:
                yield name, f"it belongs to the scenes {', '.join(scenes)}"

    @model_validator(mode="after")
    def _scene_and_robot_agree(self) -> TrialConfig:
        if self.scene != TUNNEL and self.tunnel != TunnelParams():
            raise ValueError(
                f"tunnel belongs to the scene {TUNNEL!r}, found the scene {self.scene!r}"
            )
        widths = {TUNNEL: self.tunnel.free_width, CORRIDORS: self.corridors.free_width[0]}
        width = widths.get(self.scene, math.inf)
        if width < self.robot.width:
            raise ValueError(
                f"{self.scene}.free_width must be at least robot.width, {self.robot.width:g} m, "
                f"found {width:g} m"
            )
        return self


def scene_of(config: TrialConfig) -> Scene:
    """The scene of a configuration."""
    return make_scene(config.scene, config.tunnel, config.corridors, config.ground)


def require_own_curves(robot: RobotSpec, control: ControlParams) -> None:
    """Check that the curves of both antennae can belong to the robot's flex sensors."""
    for name in ("conditioning", "conditioning_right"):
        require_own_curve(robot.antenna.sensor, f"control.{name}", getattr(control, name))


@dataclass(frozen=True, slots=True)
class Trial:
    """A trial at its start.

    Attributes:
        world: The robot in its scene, placed.
        chance: What chance does to it.
        phase: Gait phase [rad].
        scene: The scene that was drawn.
        seed, number: What it follows from.
    """

    world: World
    chance: Disturbance
    phase: float
    scene: SceneInstance
    seed: int
    number: int

    def episode(self, limit: float | None = None, on_its_back: bool = False) -> Episode:
        """The episode that begins so.

        Args:
            limit: Time after which it has failed [s]; None for that of the scene.
            on_its_back: Whether a robot on its back ends it in any scene.
        """
        return Episode(self.scene, limit, on_its_back, self.seed, self.number)


def draw_trial(
    config: TrialConfig, scene: Scene, trial: int, gait: GaitParams, period: float
) -> Trial:
    """Draw and compile one trial; it depends on the seed and its number alone.

    Args:
        config: What to draw from.
        scene: The scene of that name, made once for many trials.
        trial: Its number.
        gait: The pose at the start is one of this gait.
        period: Control period [s].
    """
    for_scene, for_start, for_chance = _generators(config.seed, trial)
    robot, variation = config.robot, variation_of(config, scene)
    drawn = _drawn(config, scene, for_scene)
    with _errors_of(config.scene):
        world = make_world(config.physics, robot, drawn)
    phase = float(for_start.uniform(0.0, 2.0 * math.pi))
    lateral, heading = for_start.uniform(-1.0, 1.0, 2)
    lateral, heading = lateral * variation.start_lateral, heading * variation.start_heading
    place_at_start(world, drawn, gait, phase, lateral, heading)
    chance = Disturbance(for_chance, variation, robot, period)
    return Trial(world, chance, phase, drawn, config.seed, trial)


def draw_scene(config: TrialConfig, scene: Scene, trial: int) -> SceneInstance:
    """The instance of the scene that `draw_trial` draws."""
    return _drawn(config, scene, _generators(config.seed, trial)[0])


def variation_of(config: TrialConfig, scene: Scene) -> VariationParams:
    """What differs between the trials of a configuration, with the changes of its scene."""
    own = dict(getattr(scene, "variation", {}))
    for name, *_ in changes(config.variation, [n for n in own if hasattr(config.variation, n)]):
        raise SceneError(
            f"variation.{name}: expected the default, as the scene {config.scene!r} sets it, found "
            f"{getattr(config.variation, name)}"
        )
    try:
        checked = from_values(VariationParams, own)
    except ConfigError as error:
        raise SceneError(f"scene {config.scene!r}: variation: {error}") from error
    return config.variation.model_copy(update={name: getattr(checked, name) for name in own})


def check_start(config: TrialConfig) -> None:
    """Find a bad scene before anything is run: draw trial 0, and compile it if it is not ours."""
    scene = scene_of(config)
    variation_of(config, scene)
    if config.scene == TUNNEL:
        draw_scene(config, scene, 0)
    else:
        still_trial(config, scene, GaitParams())


def still_trial(config: TrialConfig, scene: Scene, gait: GaitParams) -> tuple[World, SceneInstance]:
    """Trial 0 without chance: the robot at the start of its scene, at phase 0 of a gait."""
    drawn = draw_scene(config, scene, 0)
    with _errors_of(config.scene):
        world = make_world(config.physics, config.robot, drawn)
        place_at_start(world, drawn, gait)
        require_room(world)
    return world, drawn


def _drawn(config: TrialConfig, scene: Scene, rng: np.random.Generator) -> SceneInstance:
    with _errors_of(config.scene):
        drawn = scene.draw(config.robot, rng)
        lacking = [name for name in MEMBERS if not hasattr(drawn, name)]
    if lacking:
        raise SceneError(
            f"scene {config.scene!r}: expected draw to return a SceneInstance, found "
            f"{type(drawn).__name__} without {', '.join(lacking)}"
        )
    return drawn


@contextmanager
def _errors_of(name: str) -> Iterator[None]:
    """Name the scene in whatever its code raises."""
    try:
        yield
    except (*FAILURES, KeyboardInterrupt):
        raise
    except BaseException as error:  # SystemExit too
        raise SceneError(f"scene {name!r} failed: {raised(error)}") from error


def require_room(world: World) -> None:
    """Check that the robot stands free."""
    overlap = world.obstacle_overlap()
    if overlap > MOST_OVERLAP:
        raise SceneError(
            "expected room for the robot at the start of the scene, found an obstacle "
            f"{overlap:.3f} m deep in it"
        )


def make_world(physics: PhysicsParams, robot: RobotSpec, scene: SceneInstance) -> World:
    """Compile the robot in a scene."""
    return World(compile_world(physics, robot, scene), robot, getattr(scene, "top", 0.0))


def place_at_start(
    world: World,
    scene: SceneInstance,
    gait: GaitParams,
    phase: float = 0.0,
    lateral: float = 0.0,
    heading: float = 0.0,
) -> None:
    """Put the robot at the start of its scene, in the pose of a gait phase, on all lifting legs.

    Args:
        world: Where it is.
        scene: Says where the start is.
        gait: Gives the pose.
        phase: Gait phase [rad].
        lateral: Offset to the left of the start [m].
        heading: Turn to the left from the start's heading [rad].
    """
    x, y, ahead = scene.start
    command = targets(gait, world.robot, np.array([phase]), np.zeros(1), lifting=False)
    world.place(
        x - lateral * math.sin(ahead),
        y + lateral * math.cos(ahead),
        ahead + heading,
        command.yaw[0],
        command.leg[0],
        getattr(scene, "ground", 0.0),
    )


def _generators(seed: int, trial: int) -> list[np.random.Generator]:
    """Generators of the scene, the start and the disturbances."""
    return [np.random.default_rng(s) for s in np.random.SeedSequence([seed, trial]).spawn(3)]
