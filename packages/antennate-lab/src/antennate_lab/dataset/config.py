"""What decides the content of a data set, and which episode belongs to which split."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, ClassVar, Literal, get_args

from pydantic import Field, model_validator

from antennate.antenna.statics import Profile
from antennate.control.readers import HARDWARE_ALONE, unread_lift, unused
from antennate.params.base import Params, number, require_different, require_whole_steps
from antennate.params.gaits import GaitParams
from antennate.params.scene import BenchPhysicsParams, PhysicsParams
from antennate.robots.spec import RobotSpec, WalkingRobot

FORMAT = 1
"""Version of columns, splits and definitions; any change of them raises it."""
HISTORY = 200
"""Samples of a window."""
Kind = Literal["walk", "gap", "push"]
KINDS: tuple[Kind, ...] = get_args(Kind)
"""Beside a wall, between two walls, against a post."""
SPLITS = ("train", "validation", "test", "test_antenna", "test_speed")
"""The last two hold antennae and speeds that the others do not have."""
TESTS = SPLITS[2:]
_PATTERN = ("train",) * 5 + ("validation", "test", "test", "test_antenna", "test_speed")
"""Splits of ten episodes in a row."""

_Factor = Annotated[float, Field(gt=0.1, le=3)]
_Share = Annotated[float, Field(gt=0.2, le=1)]
_Distance = Annotated[float, Field(gt=0, le=1)]
_Turn = Annotated[float, Field(gt=0, le=1.5)]
_Angle = Annotated[float, Field(ge=-1.5, le=1.5)]


def split_of(episode: int) -> str:
    """The split of an episode of any kind, whatever the number of episodes and the seed."""
    return _PATTERN[episode % len(_PATTERN)]


class AntennaVariationParams(Params):
    """What differs from one antenna to the next."""

    stiffness: float = number(
        0.05, "1", "assumed: makers quote 10 % of the rate, taken as two sigma", ge=0, le=0.3
    )
    """Standard deviation of the logarithm of a spring's stiffness."""
    gain: float = number(0.05, "1", "assumed: strips repeat within 10 % (2 sigma)", ge=0, le=0.2)
    """Standard deviation of the flex sensor's gain."""
    friction: float = number(1.0 / 3.0, "1", "assumed: walls differ", ge=0, le=1)
    """Half range of the friction, over the antenna's."""
    joint_zero: float = number(
        0.02, "rad", "assumed: a horn mounted by hand, about 1 deg", ge=0, le=0.3
    )
    """Standard deviation of the zero of a yaw joint, and of an antenna's base in a gap."""


class WalkParams(Params):
    """Episodes beside a wall; distances are those of the middle of the head."""

    time: float = number(6.0, "s", "assumed: three windows that overlap by half a second", ge=1)
    """Length of an episode."""
    windows: int = number(3, "1", "assumed: the robot has turned or gone on in between", ge=1)
    """Windows of an episode; the last one ends with it."""
    stride: float = number(1.5, "s", "assumed: nearly a gait cycle", gt=0)
    """Time from the end of one window to that of the next."""
    distance: tuple[_Distance, _Distance] = number(
        (0.12, 0.24), "m", "assumed: from touch by the legs to out of reach of the antennae"
    )
    """Range of the distance of the head at the start."""
    angle: tuple[_Angle, _Angle] = number(
        (-0.3, 0.3), "rad", "assumed: a robot that follows a wall; more is a collision"
    )
    """Range of the angle of the body to the wall at the start, positive towards the wall."""
    touch_flex: float = number(
        math.radians(10.0),
        "rad",
        "measured: in 9 of 10 windows the other antenna, in free air, stays below 8 deg",
        gt=0,
        le=1,
    )
    """Flex from which estimates take an antenna of a walking robot to touch."""


class GapParams(Params):
    """Episodes between two parallel walls, in which both antennae sweep."""

    distance: tuple[_Share, _Share] = number(
        (0.4, 0.9), "1", "assumed: within reach of the default sweep"
    )
    """Range of the distance of a wall from an antenna's base, over the length of the antenna."""
    tilt: float = number(0.15, "rad", "assumed: placed by hand, as in the tunnel", ge=0, le=0.5)
    """Half range of the angle of the robot to the walls."""
    centre: float = number(math.radians(47.0), "rad", "assumed: the mounting angle", ge=0, le=2.0)
    """Centre of the sweep from the heading, outwards."""
    amplitude: float = number(
        math.radians(30.0), "rad", "assumed: ahead to sideways", gt=0.2, le=1.2
    )
    """Amplitude of the sweep."""
    spread: float = number(
        math.radians(10.0), "rad", "assumed: a third of the amplitude", ge=0, le=0.19
    )
    """Half range of centre and amplitude, from episode to episode."""
    frequency: float = number(0.5, "Hz", "assumed: near that of the gait", ge=0.2, le=2)
    """Sweeps a second, before the factor of the episode."""


class PushParams(Params):
    """Episodes in which the head turns at its yaw joint and an antenna meets a post."""

    place: tuple[_Share, _Share] = number(
        (0.4, 1.0), "1", "assumed: nearer contacts hardly bend the flex sensor"
    )
    """Range of the place of the first contact, over the length of the antenna."""
    depth: tuple[_Turn, _Turn] = number(
        (0.1, 0.3), "rad", "assumed: less hardly bends it, more lets it slip off"
    )
    """Range of the turn of the head after the first contact."""
    speed: float = number(
        0.4, "rad/s", "assumed: a quarter of what the gait turns the head with", gt=0.05, le=2
    )
    """Speed of the turn, before the factor of the episode."""
    post_radius: float = number(0.003175, "m", "paper: spheres of 6.35 mm diameter", gt=0, le=0.1)
    """Radius of the post."""


class DatasetConfig(Params):
    """Everything that decides the content of a data set."""

    unread: ClassVar[tuple[str, ...]] = (
        *(path for path in HARDWARE_ALONE if path != "robot.antenna.sensor.rate"),
    )
    seed: int = number(0, "1", "assumed: any", ge=0)
    """Seed of all chance."""
    trials: int = number(300, "1", "assumed: two minutes on two cores", ge=10, le=10000)
    """Episodes of each kind."""
    kinds: tuple[Kind, ...] = number(KINDS, "1", "assumed: all of them", min_length=1)
    """Kinds of episodes: beside a wall, between two walls, against a post."""
    profile: Profile = number("descending", "1", "paper: the robot's profile")
    """Profile of the antennae."""
    held_out_profile: Profile = number("stiff", "1", "paper: the profile that it compares first")
    """Profile of the antennae of the split test_antenna alone."""
    speeds: tuple[_Factor, _Factor] = number(
        (0.8, 1.1), "1", "assumed: about the default gait and sweeps"
    )
    """Range of the factor on the speed of gait, sweep or turn."""
    held_out_speeds: tuple[_Factor, _Factor] = number(
        (1.3, 1.5), "1", "assumed: faster, and apart from `speeds`"
    )
    """Range of that factor in the split test_speed alone; its walks may be too fast for a robot."""
    averaging_time: float = number(0.1, "s", "assumed: T_avg, ten samples", gt=0, le=1)
    """Running mean of the readings before estimates look at them; the data are not averaged."""
    touch_flex: float = number(
        math.radians(5.0), "rad", "assumed: twice the 2.3 deg that inertia bends it", gt=0, le=1
    )
    """Flex from which estimates take an antenna on the bench to touch."""
    antennae: AntennaVariationParams = AntennaVariationParams()
    walk: WalkParams = WalkParams()
    gap: GapParams = GapParams()
    push: PushParams = PushParams()
    robot: WalkingRobot = RobotSpec()
    gait: GaitParams = GaitParams()
    physics: PhysicsParams = PhysicsParams()
    bench: BenchPhysicsParams = BenchPhysicsParams()

    @property
    def rate(self) -> float:
        """Samples a second, of readings and of joints [Hz]."""
        return self.robot.antenna.sensor.rate

    @property
    def history(self) -> float:
        """Length of a window [s]."""
        return HISTORY / self.rate

    def unread_here(self) -> Mapping[str, str]:
        """What this robot does not have, and the step of legs that do not lift."""
        return unused(self.robot) | unread_lift(self.robot, "gait")

    @model_validator(mode="after")
    def _ranges_rise(self) -> DatasetConfig:
        ranges = {
            "speeds": self.speeds,
            "held_out_speeds": self.held_out_speeds,
            "walk.distance": self.walk.distance,
            "walk.angle": self.walk.angle,
            "gap.distance": self.gap.distance,
            "push.place": self.push.place,
            "push.depth": self.push.depth,
        }
        for name, (low, high) in ranges.items():
            if not low < high:
                raise ValueError(f"{name}: expected a range that rises, found {low:g} and {high:g}")
        return self

    @model_validator(mode="after")
    def _agree(self) -> DatasetConfig:
        for name, physics in (("physics", self.physics), ("bench", self.bench)):
            try:
                require_whole_steps("robot.antenna.sensor.rate", self.rate, physics.timestep)
            except ValueError as error:
                raise ValueError(f"{name}: {error}") from None
        require_different("kinds", self.kinds)
        if not self.robot.antenna_count:
            raise ValueError("robot.antennae.kind: expected a pair of antennae, found none")
        if self.robot.antenna.roll:
            raise ValueError(
                "robot.antenna.roll: expected 0, as the bench bends an antenna in its plane, found "
                f"{self.robot.antenna.roll:g}"
            )
        if self.profile == self.held_out_profile:
            raise ValueError(
                f"held_out_profile: expected another one than profile, found {self.profile} twice"
            )
        (low, high), (least, most) = self.speeds, self.held_out_speeds
        if least <= high and low <= most:
            raise ValueError(
                f"held_out_speeds: expected a range apart from speeds, {low:g} to {high:g}, found "
                f"{least:g} to {most:g}"
            )
        self.robot.require_pace("gait.frequency with speeds", self.gait.frequency * high)
        fastest = self.gait.frequency * max(high, most)
        if fastest > 1.0:
            raise ValueError(
                "gait.frequency: expected at most 1 Hz with the largest factor of speeds and "
                f"held_out_speeds, found {fastest:.3g} Hz"
            )
        first = self.walk.time - (self.walk.windows - 1) * self.walk.stride
        if first < self.history:
            raise ValueError(
                f"walk.time: expected room for {self.walk.windows} windows, the first of "
                f"{self.history:g} s, found {self.walk.time:g} s with a stride of "
                f"{self.walk.stride:g} s"
            )
        return self
