"""A robot as data: geometry, joints and servos, antennae. Every array shape follows from it.

Links run head first, left before right. The joints of a robot stand in the order yaw, legs,
antennae, then the pitch joints where servos move them, and the elevation of the antennae: ids,
angles and goals keep that order.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import (
    AfterValidator,
    SerializerFunctionWrapHandler,
    model_serializer,
    model_validator,
)
from pydantic.fields import FieldInfo

from antennate import checks
from antennate.errors import ConfigError
from antennate.messages import shown
from antennate.params.base import Params, number, own_file, read_file
from antennate.params.scene import GRAVITY
from antennate.robots.antenna import BASE, AntennaSpec
from antennate.robots.imu import ImuParams
from antennate.robots.joints import (
    STRAIGHT,
    BaseParams,
    BodyParams,
    ElevationParams,
    JointParams,
    LegParams,
    PitchParams,
    YawParams,
)
from antennate.robots.servos import ServoName, ServoParams, ServosParams
from antennate.types import SIDES
from dynamixel_bus.model import EXTENDED_MODE, POSITION_MODE

GroupName = Literal["yaw", "legs", "antennae", "pitch", "elevation"]
ROBOTS = ("scuttle", "scuttle3d", "hexapod", "bench")
"""Robots that are known by name; each is a file beside this one."""
CLEARANCE = 0.002
"""Gap that neighbouring legs keep at the largest bend [m] (assumed: play of printed parts)."""
ANTENNA_PREFIXES = tuple(f"antenna_{side}_" for side in SIDES)


class Fitted(Params):
    """One number of a robot that was fitted to recordings."""

    name: str = number("", "1", "assumed: has to be named")
    """Path of the number, as `servos.xc430_w240.gain_divisor`, and its place in a list."""
    low: float = number(0.0, "1", "assumed: has to be given", ge=-1e6)
    """Lower end of the 90 % interval, in the unit of the number."""
    high: float = number(0.0, "1", "assumed: has to be given", ge=-1e6)
    """Upper end."""
    source: str = number("", "1", "assumed: not known")
    """Logs that tell it."""


class RobotSpec(Params):
    """A robot: links with a pair of legs each, yaw joints between them, two antennae.

    A bench is one link on a clamp, without legs, with one antenna or two. Of one antenna there is
    the left one; what a frame holds of the right one is NaN.
    """

    known: ClassVar[tuple[str, ...]] = ROBOTS
    choice: ClassVar[str] = f"{', '.join(ROBOTS)} or a TOML file of your own (default: {ROBOTS[0]})"
    links: int = number(6, "1", "paper: six links", ge=1, le=50)
    """Number of links."""
    link_pitch: float = number(
        0.12, "m", "assumed: servos of 46.5 mm for yaw and pitch; legs stay apart", gt=0.03, le=1
    )
    """Joint spacing."""
    mass: float = number(
        2.0,
        "kg",
        "assumed: 17 servos of 65 g (datasheet), as much again in frames and legs",
        gt=0.3,
    )
    """Total mass."""
    width: float = number(0.20, "m", "paper: a section of 0.40 m is twice as wide", gt=0.08)
    """Width over the legs."""
    leg_radius: float = number(
        0.025, "m", "assumed: 25 to 35 mm; neighbours stay apart up to 29 deg of yaw", gt=0
    )
    """Outer radius of an O-leg."""
    leg_eccentricity: float = number(0.008, "m", "assumed: as leg_radius; 8 to 15 mm", ge=0)
    """Distance of the ring's centre from its axle."""
    leg_width: float = number(0.016, "m", "assumed: printed ring with a rubber tread", gt=0)
    """Thickness of an O-leg."""
    leg_mass: float = number(0.020, "kg", "assumed: printed ring", gt=0)
    """Mass of one O-leg."""
    leg_friction: float = number(0.6, "1", "assumed: rubber on a floor, 0.5 to 0.8", gt=0, le=2)
    """Friction of a leg on the floor."""
    body_friction: float = number(0.3, "1", "assumed: printed plastic on paper", ge=0, le=2)
    """Friction of the body against obstacles."""
    body_radius: float = number(0.020, "m", "assumed: half the height of the servo", gt=0)
    """Radius of spine and cross-beams."""
    baud: Literal[57600, 115200, 1000000, 2000000, 3000000, 4000000] = number(
        1_000_000,
        "bit/s",
        "assumed: a tick of 10 ms is at most 5.2 ms on the wire, 6.6 with 26 servos",
    )
    """Bus speed."""
    release: tuple[GroupName, ...] = number(
        ("antennae", "yaw", "legs"), "1", "assumed: what carries the robot goes last"
    )
    """Order in which the groups lose their torque."""
    yaw: YawParams = YawParams()
    pitch: PitchParams = PitchParams()
    legs: LegParams = LegParams()
    antennae: BaseParams = BaseParams()
    elevation: ElevationParams = ElevationParams()
    servos: ServosParams = ServosParams()
    antenna: AntennaSpec = AntennaSpec()
    imu: ImuParams = ImuParams()
    fitted: tuple[Fitted, ...] = number((), "1", "assumed: none; `antennate fit` writes them")
    """Numbers that were fitted to recordings; nothing is computed from them."""
    bodies: tuple[BodyParams, ...] = number(
        (), "1", "assumed: none, spine and beam of equal mass; `antennate build` writes them"
    )
    """Mass and inertia of each link and leg, all of them or none."""
    meshes: str = number("", "1", "assumed: none; `antennate build` writes them")
    """Folder with a file NAME.stl [mm] for each body that is drawn by it, seen from the robot's
    file; it changes no motion."""

    @classmethod
    def named(cls, text: str | Path, folder: Path = Path()) -> Self:
        """The robot of a name, or of a TOML file with the keys of this model.

        Args:
            text: The name, or the path of the file.
            folder: Where a path that is not absolute starts.

        Raises:
            ConfigError: There is no such robot, or its file cannot be used.
        """
        if str(text) in ROBOTS:
            return read_file(Path(__file__).with_name(f"{text}.toml"), cls)
        own = str(text and checks.path("robot", text))
        path = own_file("--robot", own, ROBOTS, folder)
        robot = read_file(path, cls)
        robot.require_held(path)
        if not robot.meshes:
            return robot
        return robot.model_copy(update={"meshes": str((path.parent / robot.meshes).absolute())})

    def require_held(self, file: Path) -> None:
        """Refuse a fitted number that its interval does not hold, as a file has it.

        Raises:
            ConfigError: There is one.
        """
        for each in self.fitted:
            if not each.low <= (value := _number(self, each.name)[0]) <= each.high:
                raise ConfigError(
                    f"{file}: fitted: {each.name}: expected its value within {each.low:g} to "
                    f"{each.high:g}, found {value:g}; set it back, or take this table away"
                )

    @property
    def yaw_count(self) -> int:
        """Number of yaw joints, one between two links."""
        return self.links - 1

    @property
    def leg_count(self) -> int:
        """Number of legs, two a link; 0 of a bench."""
        return 0 if self.legs.kind == "none" else len(SIDES) * self.links

    @property
    def pitch_count(self) -> int:
        """Number of pitch joints that servos move."""
        return self.links - 1 if self.pitch.kind == "actuated" else 0

    @property
    def antenna_count(self) -> int:
        """Number of antennae, 0, 1 or 2."""
        return {"none": 0, "left": 1, "pair": len(SIDES)}[self.antennae.kind]

    @property
    def elevation_count(self) -> int:
        """Number of joints that raise and lower the antennae, one each or 0."""
        return self.antenna_count if self.elevation.kind == "pair" else 0

    @model_serializer(mode="wrap")
    def _without_what_is_absent(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """A robot without what few robots have is written as before there was any of it."""
        table = handler(self)
        if isinstance(servos := table.get("servos"), dict):
            table["servos"] = servos | {
                name: self.servos.of(name).model_dump() for name in dict.fromkeys(self.servo_names)
            }
        if self.imu == ImuParams():
            table.pop("imu", None)
        if not self.fitted:
            table.pop("fitted", None)
        for name in ("bodies", "meshes"):
            if not table.get(name, True):
                del table[name]
        return table

    @property
    def right_antenna(self) -> AntennaSpec:
        """The right antenna, whose springs may differ from those of the left, `antenna`."""
        name = "three_coil_stiffness_n_mm_per_deg"
        stiffness = self.antennae.right_stiffness * getattr(self.antenna, name)
        return self.antenna.model_copy(update={name: stiffness})

    @property
    def has_imu(self) -> bool:
        """Whether the antenna board carries an inertial sensor."""
        return self.imu.kind == "head"

    @property
    def leg_frictions(self) -> tuple[float, ...]:
        """Friction of each leg on the floor, as many as `leg_names`."""
        return tuple(self.leg_friction * factor for factor in self.factors)

    @property
    def factors(self) -> tuple[float, ...]:
        """Friction of each leg over `leg_friction`, as many as `leg_names`."""
        return self.legs.friction_factors or (1.0,) * self.leg_count

    @property
    def backlash(self) -> tuple[float, ...]:
        """Backlash of each yaw joint [rad], as many as `yaw_names`."""
        return self.yaw.backlash or (0.0,) * self.yaw_count

    @property
    def hip(self) -> float:
        """Distance of a lifting leg's axis from the middle of the robot [m]."""
        reach = self.legs.reach
        foot = (self.width - self.leg_width) / 2
        return self.body_radius if reach is None else foot - reach

    @property
    def length(self) -> float:
        """Robot length without antennae [m]."""
        return self.links * self.link_pitch

    @property
    def link_mass(self) -> float:
        """Mass of one link without its legs [kg]."""
        antennae = self.antenna_count * self.antenna.mass
        antennae += self.elevation_count * self.elevation.mass
        return (self.mass - self.leg_count * self.leg_mass - antennae) / self.links

    @property
    def link_masses(self) -> tuple[float, ...]:
        """Mass of each link without its legs [kg], head first."""
        own = {body.name: body.mass for body in self.bodies}
        return tuple(own.get(name, self.link_mass) for name in self.link_names)

    @property
    def most_mass(self) -> float:
        """Mass that all legs together raise at stall torque, each at the end of its leg [kg]."""
        lever = self.leg_radius + self.leg_eccentricity
        torque = self.leg_count * self.servos.of(self.legs.servo).stall_torque
        return torque / (GRAVITY * lever)

    @property
    def link_names(self) -> tuple[str, ...]:
        """Names of the links, head first."""
        return tuple(f"link{i}" for i in range(self.links))

    @property
    def yaw_names(self) -> tuple[str, ...]:
        """Names of the yaw joints, head first."""
        return tuple(f"yaw{j}" for j in range(1, self.links))

    @property
    def pitch_names(self) -> tuple[str, ...]:
        """Names of all pitch joints, locked or not, head first."""
        return tuple(f"pitch{j}" for j in range(1, self.links))

    @property
    def leg_names(self) -> tuple[str, ...]:
        """Names of the legs in the order of an array over (link, side)."""
        names = (f"leg_{side}{i}" for i in range(self.links) for side in SIDES)
        return tuple(names) if self.leg_count else ()

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of all joints that servos move."""
        bases = tuple(prefix + BASE for prefix in ANTENNA_PREFIXES[: self.antenna_count])
        pitch = self.pitch_names[: self.pitch_count]
        return self.yaw_names + self.leg_names + bases + pitch + self.elevation_names

    @property
    def elevation_names(self) -> tuple[str, ...]:
        """Names of the joints that raise and lower the antennae, left before right."""
        return tuple(prefix + "elevation" for prefix in ANTENNA_PREFIXES[: self.elevation_count])

    @property
    def groups(self) -> tuple[tuple[GroupName, JointParams, int], ...]:
        """Name, description and number of joints of each group, in the order of the joints."""
        return (
            ("yaw", self.yaw, self.yaw_count),
            ("legs", self.legs, self.leg_count),
            ("antennae", self.antennae, self.antenna_count),
            ("pitch", self.pitch, self.pitch_count),
            ("elevation", self.elevation, self.elevation_count),
        )

    def places(self, name: GroupName) -> slice:
        """Where the joints of a group stand among all."""
        first = 0
        for known, _, count in self.groups:
            if known == name:
                return slice(first, first + count)
            first += count
        *others, last = (known for known, _, _ in self.groups)
        names = f"{', '.join(others)} or {last}"
        raise ConfigError(f"name: expected {names}, found {shown(name)}")

    def command_shapes(self, batch: int = 1) -> dict[str, tuple[int, ...]]:
        """Shapes of the arrays of a `JointCommand` for some robots, in the order of the joints."""
        shapes = {
            "yaw": (batch, self.yaw_count),
            "leg": (batch, self.leg_count // len(SIDES), len(SIDES)),
            "antenna": (batch, self.antenna_count),
        }
        shapes |= {"pitch": (batch, self.pitch_count)} if self.pitch_count else {}
        elevation = {"elevation": (batch, self.elevation_count)} if self.elevation_count else {}
        return shapes | elevation

    @property
    def ids(self) -> tuple[int, ...]:
        """Servo ids of all joints."""
        ids: list[int] = []
        for _, group, count in self.groups:
            first = len(ids) + 1
            ids += group.ids or range(first, first + count)
        return tuple(ids)

    @property
    def directions(self) -> tuple[int, ...]:
        """Sign of each joint between ticks and angle."""
        return tuple(s for _, group, n in self.groups for s in group.directions or (1,) * n)

    @property
    def zeros(self) -> tuple[int, ...]:
        """Position of each joint at the angle 0 [ticks]."""
        return tuple(z for _, group, n in self.groups for z in group.zeros or (STRAIGHT,) * n)

    def unstated(self, *lists: str) -> tuple[str, ...]:
        """Names of the joints of groups that lack one of these lists: ids, directions, zeros."""
        return tuple(
            name
            for group, params, _ in self.groups
            if not all(getattr(params, what) for what in lists)
            for name in self.joint_names[self.places(group)]
        )

    @property
    def clear_bend(self) -> float:
        """Largest angle of a yaw joint at which neighbouring legs stay apart [rad].

        A rolling leg reaches leg_radius + leg_eccentricity fore and aft of its axle, whatever its
        angle. On the inner side of a bend the outer corners of two neighbours meet in the plane
        that halves the angle; they keep CLEARANCE there. At most a right angle.
        """
        if self.legs.kind != "rolling":
            return math.pi / 2
        gap = self.link_pitch / 2 - self.leg_radius - self.leg_eccentricity - CLEARANCE / 2
        return min(2.0 * math.atan(2.0 * gap / self.width), math.pi / 2)

    @property
    def yaw_limit(self) -> float:
        """Largest angle of a yaw joint either way [rad]."""
        return min(self.yaw.largest, self.clear_bend)

    @property
    def limits(self) -> tuple[float, ...]:
        """Largest angle of each joint either way [rad], inf for rolling legs."""
        yaw = (self.yaw_limit,) * self.yaw_count
        return yaw + tuple(group.largest for _, group, n in self.groups[1:] for _ in range(n))

    @property
    def fastest(self) -> tuple[float, ...]:
        """Fastest that the goal of each joint moves [rad/s]."""
        return tuple(group.fastest for _, group, count in self.groups for _ in range(count))

    @property
    def fastest_gait(self) -> float:
        """Fastest gait at which goals of rolling legs keep up [Hz], inf for lifting legs."""
        return self.legs.fastest / (2.0 * math.pi) if self.legs.kind == "rolling" else math.inf

    def require_pace(self, name: str, frequency: float, amplitude: float = 0.0) -> None:
        """Refuse a gait that goals of the legs or of the yaw joints cannot keep up with.

        Args:
            name: What has that frequency, for the message.
            frequency: Cycles a second [Hz].
            amplitude: Amplitude of its body wave [rad]; 0 where goals of yaw joints have no limit.

        Raises:
            ConfigError: It is faster than `fastest_gait`, or the wave than `yaw.fastest`.
        """
        swing = 2.0 * math.pi * amplitude
        waves = self.yaw.fastest / swing if swing else math.inf
        most, group = min((self.fastest_gait, "legs"), (waves, "yaw"))
        if frequency > most:
            raise ConfigError(
                f"{name}: expected at most {math.floor(1e3 * most) / 1e3:g} Hz, which robot.{group}"
                f".fastest of {getattr(self, group).fastest:g} rad/s allows, found {frequency:g}"
            )

    @property
    def servo_names(self) -> tuple[ServoName, ...]:
        """Servo model of each joint."""
        return tuple(group.servo for _, group, count in self.groups for _ in range(count))

    def servo_of(self, group: JointParams) -> ServoParams:
        """Servo of the joints of a group: its model, with the gain that it has there."""
        model = self.servos.of(group.servo)
        if group.gain_factor == 1.0:
            return model
        return model.model_copy(update={"gain_divisor": model.gain_divisor / group.gain_factor})

    @property
    def joint_servos(self) -> tuple[ServoParams, ...]:
        """Servo of each joint."""
        return tuple(self.servo_of(group) for _, group, count in self.groups for _ in range(count))

    @property
    def models(self) -> dict[int, int]:
        """Model number of each servo by id."""
        numbers = [self.servos.of(name).model_number for name in self.servo_names]
        return dict(zip(self.ids, numbers, strict=True))

    @property
    def modes(self) -> dict[int, int]:
        """Operating mode of each servo by id."""
        modes = (POSITION_MODE if math.isfinite(limit) else EXTENDED_MODE for limit in self.limits)
        return dict(zip(self.ids, modes, strict=True))

    @property
    def in_order_of_release(self) -> tuple[tuple[int, ...], ...]:
        """Ids of the groups in the order in which they lose their torque."""
        names: list[GroupName] = [name for name, _, _ in self.groups]
        order = dict.fromkeys((*self.release, *names))
        ids = (self.ids[self.places(name)] for name in order)
        return tuple(group for group in ids if group)

    @model_validator(mode="after")
    def _agree(self) -> RobotSpec:
        _check_kind(self)
        for name, group, count in self.groups:
            group.require_lists(name, count)
            speed = self.servos.of(group.servo).no_load_speed
            if group.fastest > speed:
                raise ValueError(
                    f"{name}.fastest must be at most {speed:.4g} rad/s, the unloaded speed of "
                    f"{group.servo}, found {group.fastest:g}"
                )
        if self.clear_bend <= 0:
            raise ValueError(
                f"link_pitch: expected links so far apart that their legs do not touch, found "
                f"{self.link_pitch:g} m with legs that reach "
                f"{self.leg_radius + self.leg_eccentricity:g} m"
            )
        if self.yaw.limit is not None and self.yaw.limit > self.clear_bend:
            raise ValueError(
                f"yaw.limit: expected at most {self.clear_bend:.3g} rad, where the legs of "
                f"neighbouring links meet, found {self.yaw.limit:g}"
            )
        if len(set(self.release)) < len(self.release):
            raise ValueError(f"release must name each group once, found {', '.join(self.release)}")
        ids = self.ids
        if doubled := sorted({i for i in ids if ids.count(i) > 1}):
            raise ValueError(
                f"ids: expected each once, found {', '.join(map(str, doubled))} more than once"
            )
        if self.has_imu and not self.antenna_count:
            raise ValueError(
                "imu.kind: expected none for a robot without antennae, on whose board it is, "
                f"found {self.imu.kind}"
            )
        _check_mass(self)
        _check_fitted(self)
        if self.legs.reach is not None and self.hip < 0:
            raise ValueError(
                f"legs.reach: expected at most {self.legs.reach + self.hip:g} m, half the width "
                f"without the leg, found {self.legs.reach:g}"
            )
        return self


def require_walking(robot: RobotSpec, what: str) -> None:
    """Check that a robot has legs."""
    if not robot.leg_count:
        raise ConfigError(
            f"expected a robot that walks for {what}, found one without legs (legs.kind)"
        )


def _walking(robot: RobotSpec) -> RobotSpec:
    if not robot.leg_count:
        raise ValueError("expected a robot that walks, found one without legs (legs.kind)")
    return robot


WalkingRobot = Annotated[RobotSpec, AfterValidator(_walking)]
"""The robot of a configuration whose command walks it."""


def require_antennae(robot: RobotSpec, what: str) -> None:
    """Check that a robot has antennae, and legs that answer to them."""
    require_walking(robot, what)
    if not robot.antenna_count:
        raise ConfigError(
            f"expected a robot with antennae for {what}, found one without (antennae.kind)"
        )


def _check_fitted(robot: RobotSpec) -> None:
    """Refuse intervals of no number of the robot, doubled ones and those that can be none."""
    names = [each.name for each in robot.fitted]
    if doubled := sorted({name for name in names if names.count(name) > 1}):
        raise ValueError(f"fitted: expected each name once, found {doubled[0]} more than once")
    for each in robot.fitted:
        least, open_end = _number(robot, each.name)[1:]
        if each.low > each.high:
            raise ValueError(
                f"fitted: {each.name}: expected low of at most high, found {each.low:g} and "
                f"{each.high:g}"
            )
        if each.low < least or (open_end and each.low == least):
            words = "above" if open_end else "of at least"
            raise ValueError(
                f"fitted: {each.name}: expected low {words} {least:g}, found {each.low:g}"
            )


def _number(robot: RobotSpec, name: str) -> tuple[float, float, bool]:
    """A number of a robot by its name in `fitted`, its least value, and if it must be above."""
    path, _, place = name.removesuffix("]").partition("[")
    lists = {"yaw.backlash": robot.backlash, "legs.friction_factors": robot.factors}
    if path in lists and name == f"{path}[{place}]" and place.isdecimal():
        if int(place) < len(lists[path]):
            return lists[path][int(place)], 0.0, False
    elif name == path:
        *groups, last = path.split(".")
        group: Any = robot
        for each in groups:
            group = getattr(group, each) if each in _fields(group) else None
        field = _fields(group).get(last)
        if field is not None and isinstance(value := getattr(group, last), float):
            for bound in field.metadata:
                if (least := getattr(bound, "gt", getattr(bound, "ge", None))) is not None:
                    return value, least, hasattr(bound, "gt")
            return value, -math.inf, False
    raise ValueError(f"fitted: expected names of numbers of this robot, found {shown(name)}")


def _fields(group: Any) -> Mapping[str, FieldInfo]:
    return type(group).model_fields if isinstance(group, Params) else {}


def _check_kind(robot: RobotSpec) -> None:
    """Refuse what is neither a robot with legs nor a bench."""
    kind = robot.antennae.kind
    if robot.links < 2 and robot.leg_count:
        raise ValueError(
            f"links: expected at least 2, or 1 of a bench (legs.kind none), found {robot.links}"
        )
    if robot.links > 1 and not robot.leg_count:
        raise ValueError(
            f"links: expected 1 of a bench, which has no legs (legs.kind), found {robot.links}"
        )
    if kind == "left" and robot.leg_count:
        raise ValueError(
            "antennae.kind: expected pair or none with legs, as one that walks reads both sides, "
            "found left"
        )
    if kind == "none" and not robot.leg_count:
        raise ValueError("antennae.kind: expected left or pair of a bench, found none")


def _check_mass(robot: RobotSpec) -> None:
    """Refuse links without a mass, and a robot that its legs cannot raise."""
    if robot.link_mass <= 0.01:
        raise ValueError(
            f"mass must leave more than 10 g a link beside legs and antennae, found {robot.mass} kg"
        )
    if robot.leg_count and robot.mass > robot.most_mass:
        raise ValueError(
            f"mass: expected at most {robot.most_mass:.3g} kg, which the servos of all legs raise "
            f"at their stall torque, found {robot.mass:g}"
        )
    if robot.bodies:
        _check_bodies(robot)


def _check_bodies(robot: RobotSpec) -> None:
    """Refuse bodies that are not those of the robot, or whose masses are not its own."""
    names, wanted = [body.name for body in robot.bodies], robot.link_names + robot.leg_names
    if sorted(names) != sorted(wanted):
        raise ValueError(
            f"bodies: expected each of {', '.join(wanted)} once, found {', '.join(names)}"
        )
    legs = [body.mass for body in robot.bodies if body.name in robot.leg_names]
    if any(not math.isclose(mass, robot.leg_mass, rel_tol=1e-9) for mass in legs):
        raise ValueError(f"bodies: expected legs of leg_mass, {robot.leg_mass:g} kg, found {legs}")
    links = sum(robot.link_masses)
    if not math.isclose(links, robot.links * robot.link_mass, rel_tol=1e-9):
        found = robot.mass - robot.links * robot.link_mass + links
        raise ValueError(
            f"mass: expected {found:.9g} kg, that of all bodies, found {robot.mass:.9g}"
        )
