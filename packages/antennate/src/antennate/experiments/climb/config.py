"""What `antennate climb` is told, and the cells of its table: who meets which ground."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field, field_validator, model_validator

from antennate.control.climbing.body import require_pitch
from antennate.control.readers import HARDWARE_ALONE, unused
from antennate.control.registry import KEPT_BY_CLIMBERS, unread_by_all, unread_limits
from antennate.errors import ConfigError
from antennate.experiments.climb.grounds import FLAT, FLAT_TIME, USUAL, Terrain
from antennate.experiments.tunnel.physics import TunnelConfig
from antennate.params.base import (
    Params,
    from_values,
    number,
    put_over,
    require_different,
    require_whole_steps,
)
from antennate.params.control import ControlParams
from antennate.params.scene import GroundParams, PhysicsParams, VariationParams
from antennate.robots.servos import ServoName
from antennate.robots.spec import RobotSpec, WalkingRobot

ROBOT = "scuttle3d"
Condition = Literal["locked", "level", "lifted", "rhythm", "climb", "edges"]
"""Who climbs."""
CONTROLLERS: Mapping[Condition, str] = {
    "locked": "open",
    "level": "open",
    "lifted": "lifted",
    "rhythm": "rhythm",
    "climb": "climb",
    "edges": "edges",
}
"""Controller of each condition; `locked` has another robot."""
ABOUT: Mapping[Condition, str] = {
    "locked": "the pitch joints are locked; walks forward",
    "level": "the pitch servos stay at 0; walks forward",
    "lifted": "blind: walks with its head up",
    "rhythm": "blind: climbs by the clock",
    "climb": "feels steps with lowered antennae, and climbs",
    "edges": "climbs at edges that only a simulation can tell it",
}
GROUND: Mapping[str, tuple[str, float | None]] = {
    "flat": ("flat", None),
    **{f"step of {h} cm": ("step_up", h / 100) for h in (2, 3, 4, 6, 8, 10, 12, 15)},
    "drop of 8 cm": ("step_down", 0.08),
    "drop of 35 cm": ("step_down", 0.35),
    "wall of 35 cm": ("step_up", 0.35),
    "wall of 50 cm": ("step_up", 0.50),
    "rubble of 2 cm": ("rubble", None),
}
"""Scene and height of the grounds that are felt [m]."""
CLIFF = "drop of 35 cm"
"""A drop whose ground is out of reach: it is to be stopped at."""
BUMPY = "rubble of 2 cm"
LEVEL = ("flat", BUMPY)
"""Grounds without an edge, on which every climb is a false one."""


_OF_OTHERS = tuple(
    f"control.{path}"
    for path in (
        *("rule.strong", "rule.similar", "rule.hold_time", "rule.hold_forward"),
        "gait.turn_offset",
        *("escape.reverse_time", "escape.turn_time", "escape.alternate", "escape.second_turn"),
        "timed.walk_time",
    )
)
"""Parameters that none of these controllers reads."""


@dataclass(frozen=True, slots=True)
class Cell:
    """One cell of the table: who meets which ground.

    Attributes:
        part: `climbing`, `ground` or `sensing`.
        condition: Who.
        ground: The height in words where a step is climbed, a word of `grounds`, or a key of
            GROUND where it is felt.
        scene: Name of its scene.
        height: Height of its edge [m]; None without one, and in the part `ground`.
        divisor: Gain divisor of the body's servos.
    """

    part: str
    condition: Condition
    ground: str
    scene: str
    height: float | None
    divisor: float

    @property
    def name(self) -> str:
        """Name of the cell in the table."""
        return f"{self.part}: {self.condition}, {self.ground}, 1/{self.divisor:g}"


class ClimbConfig(Params):
    """Everything that decides the outcome of `antennate climb`."""

    unread: ClassVar[tuple[str, ...]] = (
        *(path for path in HARDWARE_ALONE if path not in KEPT_BY_CLIMBERS),
        *_OF_OTHERS,
    )
    trials: int = number(
        1, "1", "assumed: shows how it works in minutes; 25 tell something", ge=1, le=100_000
    )
    """Trials of each condition, ground and divisor."""
    heights: tuple[Annotated[float, Field(ge=0.001, le=0.5)], ...] = number(
        (0.05, 0.08, 0.10, 0.12, 0.15),
        "m",
        "assumed: 8 to 15 cm are to be climbed",
        min_length=1,
        max_length=50,
    )
    """Heights of the steps."""
    grounds: tuple[str, ...] = number(
        USUAL,
        "1",
        "assumed: one of each kind but the tunnel, and a gap that is too wide",
        max_length=50,
    )
    """Other grounds: flat, gap:WIDTH, step_down:HEIGHT, stairs:HEIGHT or step_tunnel:HEIGHT, to 0.5
    m, or ramp:SLOPE, to 45 deg."""
    conditions: tuple[Condition, ...] = number(
        ("locked", "level", "lifted", "rhythm", "climb", "edges"),
        "1",
        "assumed: without pitch, blind, by touch, and told where the edge is",
        min_length=1,
    )
    """Who climbs."""
    divisors: tuple[Annotated[float, Field(gt=0, le=10_000)], ...] = number(
        (256.0, 128.0),
        "1",
        "assumed: nobody has measured which; what is found has to hold with both",
        min_length=1,
        max_length=10,
    )
    """Gain divisors of the servos of the body."""
    sensing: int = number(
        1, "1", "assumed: shows how it works; 25 tell something", ge=0, le=100_000
    )
    """Trials of each ground that `climb` feels; 0 for none."""
    start: tuple[float, float] = number(GroundParams().start, "m", "assumed: as ground.start")
    """Distance of the first edge from the head at the start, nearest and farthest; not of what is
    felt, nor in tunnels."""
    time_limit: float = number(
        60.0, "s", "assumed: twice what a climb takes by the plan", gt=0, le=3600
    )
    """Time after which a trial on one step has failed; on stairs and in tunnels twice it."""
    seed: int = number(2711, "1", "assumed: any but 0, by which the controllers were tuned", ge=0)
    """Seed of all chance."""
    robot: WalkingRobot = RobotSpec.named(ROBOT)
    """scuttle3d or another with pitch servos, or a TOML file of your own (default: scuttle3d)."""
    control: ControlParams = ControlParams()
    variation: VariationParams = VariationParams()
    physics: PhysicsParams = PhysicsParams()

    @field_validator("grounds")
    @classmethod
    def _known(cls, words: tuple[str, ...]) -> tuple[str, ...]:
        return tuple(Terrain.of(word).word for word in words)

    @field_validator("start")
    @classmethod
    def _in_front(cls, start: tuple[float, float]) -> tuple[float, float]:
        return from_values(GroundParams, {"start": start}).start

    @field_validator("robot", mode="before")
    @classmethod
    def _over_base(cls, robot: Any) -> Any:
        """What is not given is that of the robot that climbs.

        A robot that has all that the default one writes is whole, and lacks nothing.
        """
        if not isinstance(robot, Mapping):
            return robot
        if RobotSpec().model_dump().keys() - robot.keys():
            robot = put_over(RobotSpec.named(ROBOT).model_dump(), robot)
        return _with_tuples(robot)

    def unread_here(self) -> Mapping[str, str]:
        """What this robot does not have, and what none of the controllers reads."""
        used = {CONTROLLERS[name] for name in self.conditions} | (
            {"climb"} if self.sensing else set()
        )
        names = [name for name in dict.fromkeys(CONTROLLERS.values()) if name in used]
        knows = ("edges",) if "edges" in used else ()
        reasons = {
            **unread_limits(names),
            **unused(self.robot),
            **unread_by_all(names, self.control, self.robot, knows),
        }
        if "locked" in self.conditions:
            reasons.pop("robot.pitch.stiffness", None)
        return reasons | {
            f"robot.servos.{name}.gain_divisor": "divisors says it"
            for name in _body_servos(self.robot)
        }

    @model_validator(mode="after")
    def _agree(self) -> ClimbConfig:
        for name in ("heights", "grounds", "conditions", "divisors"):
            require_different(name, getattr(self, name))
        require_different("heights", [f"{100 * height:g} cm" for height in self.heights])
        require_different("divisors", [f"{divisor:g}" for divisor in self.divisors])
        require_whole_steps("control.rate", self.control.rate, self.physics.timestep)
        self.robot.require_pace("control.gait.frequency", self.control.gait.frequency)
        try:
            require_pitch(self.robot)
        except ConfigError as error:
            raise ValueError(f"robot: {error}") from None
        lengths = [("heights", max(self.heights))]
        lengths += [(f"grounds: {t.scene}", t.length) for t in self.terrains]
        for name, length in lengths:
            if length > self.robot.length:
                raise ValueError(
                    f"{name}: expected at most the length of the robot, {self.robot.length:g} m, "
                    f"found {length:g}"
                )
        return self

    @property
    def terrains(self) -> tuple[Terrain, ...]:
        """The other grounds."""
        return tuple(map(Terrain.of, self.grounds))


def _with_tuples(value: Any) -> Any:
    """What a file holds as a model takes it: tuples in place of lists, at any depth."""
    if isinstance(value, Mapping):
        return {key: _with_tuples(inner) for key, inner in value.items()}
    return tuple(map(_with_tuples, value)) if isinstance(value, (list, tuple)) else value


def cells(config: ClimbConfig) -> Mapping[str, Cell]:
    """All cells by name, in the order of the table."""
    climbs = [
        Cell("climbing", condition, f"{100 * height:g} cm", "step_up", height, divisor)
        for divisor in config.divisors
        for condition in config.conditions
        for height in config.heights
    ]
    crosses = [
        Cell("ground", condition, terrain.word, terrain.scene, None, divisor)
        for divisor in config.divisors
        for condition in config.conditions
        for terrain in config.terrains
    ]
    feels = [
        Cell("sensing", "climb", ground, scene, height, divisor)
        for divisor in config.divisors
        for ground, (scene, height) in GROUND.items()
        if config.sensing
    ]
    return {cell.name: cell for cell in (*climbs, *crosses, *feels)}


def seed_of(config: ClimbConfig, cell: Cell) -> int:
    """Seed of the trials of a cell: the same for all who meet this ground.

    Steps of heights that differ by more than 0.1 mm have other ones, so that their trials can be
    pooled. A step that is felt has the same draws as one of that height that is climbed.
    """
    if cell.part == "ground":
        return config.seed + Terrain.of(cell.ground).seed
    return config.seed + round(10_000 * (cell.height or 0.0))


def limit_of(config: ClimbConfig, cell: Cell) -> float:
    """Time limit of the trials of a cell [s]."""
    if cell.part != "ground":
        return config.time_limit
    if cell.scene == FLAT:
        return min(config.time_limit, FLAT_TIME)
    return config.time_limit * Terrain.of(cell.ground).patience


def _body_servos(robot: RobotSpec) -> set[ServoName]:
    """The servos that turn the joints of the body."""
    return {robot.yaw.servo, robot.pitch.servo}


def config_of(config: ClimbConfig, cell: Cell) -> TunnelConfig:
    """What is simulated in a cell."""
    robot = config.robot
    servos = {
        name: robot.servos.of(name).model_copy(update={"gain_divisor": cell.divisor})
        for name in _body_servos(robot)
    }
    changes: dict[str, Any] = {"servos": robot.servos.model_copy(update=servos)}
    if cell.condition == "locked":
        changes["pitch"] = robot.pitch.model_copy(update={"kind": "locked"})
    values: dict[str, Any] = {"scene": cell.scene, "seed": seed_of(config, cell)}
    sizes = {} if cell.height is None else {"height": cell.height}
    if cell.part == "ground":
        sizes = Terrain.of(cell.ground).values
    if sizes and cell.part != "sensing" and cell.scene != "step_tunnel":
        sizes = {**sizes, "start": config.start}
    if sizes:
        values["ground"] = sizes
    scene = from_values(TunnelConfig, values)
    return scene.model_copy(
        update={
            "robot": robot.model_copy(update=changes),
            "control": config.control,
            "variation": config.variation,
            "physics": config.physics,
            "controllers": (CONTROLLERS[cell.condition],),
            "time_limit": limit_of(config, cell),
        }
    )
