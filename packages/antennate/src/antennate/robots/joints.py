"""Groups of joints, which servo moves which and how its ticks become an angle; links and legs."""

from __future__ import annotations

import math
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field, model_validator

from antennate.params.base import Params, number
from antennate.robots.servos import ServoName
from dynamixel_bus.model import MOST_TICKS, TICKS_A_TURN

STRAIGHT = TICKS_A_TURN // 2
"""Zero of a joint whose zeros are not given: the middle of a turn [ticks]."""
QUARTER = TICKS_A_TURN // 4
_RIGHT_ANGLE = 0.5 * math.pi

_Id = Annotated[int, Field(ge=0, le=252)]
_Direction = Literal[-1, 1]
_Zero = Annotated[int, Field(ge=-MOST_TICKS, le=MOST_TICKS)]
_Backlash = Annotated[float, Field(ge=0, le=0.2)]
_Factor = Annotated[float, Field(gt=0, le=2)]
_Place = Annotated[float, Field(ge=-10, le=10)]
_LEAST_INERTIA = 1e-9
"""Least moment of inertia about an axis [kg·m²]."""


class JointParams(Params):
    """One group of joints, in the order of the robot's joints."""

    lists: ClassVar[tuple[str, ...]] = ("ids", "directions", "zeros")
    servo: ServoName = number("xc430_w240", "1", "paper: XC430-W240 in the body", metavar="MODEL")
    """Model of the group's servos, one of those in [servos]."""
    ids: tuple[_Id, ...] = number((), "1", "assumed: set by hand; joints from 1 if not given")
    """Ids on the bus."""
    directions: tuple[_Direction, ...] = number((), "1", "assumed: mounted alike; all 1 if empty")
    """Sign between ticks and angle."""
    zeros: tuple[_Zero, ...] = number((), "ticks", "assumed: 2048, half a turn, if not given")
    """Position at the angle 0."""
    fastest: float = number(
        4.5,
        "rad/s",
        "assumed: 2/3 of an unloaded XC430-W240 at 11.1 V, 6.8 rad/s (datasheet)",
        gt=0,
    )
    """Fastest that goals move."""
    gain_factor: float = number(1.0, "1", "assumed: as of other servos of the model", ge=0.1, le=10)
    """Gain of the position loop of the group's servos over that of their model."""

    @property
    def largest(self) -> float:
        """Largest angle either way [rad], inf for a joint that turns without end."""
        return math.inf

    def require_lists(self, name: str, count: int) -> None:
        """Refuse lists of a wrong length, and zeros without room for a quarter turn either way.

        Args:
            name: What the group is called.
            count: Number of its joints.
        """
        for what in self.lists:
            if (found := len(getattr(self, what))) not in (0, count):
                raise ValueError(
                    f"{name}.{what}: expected one for each of the {count} joints, found {found}"
                )
        for zero in self.zeros if math.isfinite(self.largest) else ():
            if not QUARTER <= zero <= STRAIGHT + QUARTER:
                raise ValueError(
                    f"{name}.zeros must leave a quarter turn to both sides, {QUARTER} to "
                    f"{STRAIGHT + QUARTER} ticks, found {zero}"
                )


class YawParams(JointParams):
    """The yaw joints between links, head first."""

    lists: ClassVar[tuple[str, ...]] = (*JointParams.lists, "backlash")
    limit: float | None = number(
        None, "rad", "assumed: as far as neighbouring legs stay apart", gt=0, le=_RIGHT_ANGLE
    )
    """Largest angle either way; from the robot's geometry if not given."""
    backlash: tuple[_Backlash, ...] = number(
        (), "rad", "assumed: none; not measured, a gear of this class has some 0.25 deg"
    )
    """Angle that each link turns freely between the ends of the play behind its servo's horn; none
    if empty. The servo measures the horn."""

    @property
    def largest(self) -> float:
        """Largest angle either way [rad]."""
        return _RIGHT_ANGLE if self.limit is None else self.limit


class PitchParams(JointParams):
    """The pitch joints between links, head first: held by a stiffness, or moved by servos."""

    limit: float = number(_RIGHT_ANGLE, "rad", "assumed: links nearly meet", gt=0, le=_RIGHT_ANGLE)
    """Largest angle either way."""
    kind: Literal["locked", "actuated"] = number("locked", "1", "paper: pitch is left unused")
    """Whether servos on the bus move them."""
    stiffness: float = number(
        30.0, "N·m/rad", "assumed: a servo that holds; the paper leaves pitch unused", gt=0
    )
    """Stiffness of a locked pitch joint."""

    @property
    def largest(self) -> float:
        """Largest angle either way [rad]."""
        return self.limit


class LegParams(JointParams):
    """The legs of all links, head first, left before right."""

    lists: ClassVar[tuple[str, ...]] = (*JointParams.lists, "friction_factors")
    kind: Literal["rolling", "lifting", "none"] = number("rolling", "1", "paper: O-legs")
    """Rolling legs turn about the pitch axis without end, lifting legs about the roll axis; a bench
    has none."""
    fastest: float = number(
        5.26, "rad/s", "assumed: it leaves a fifth of torque at 10.8 V (docs/science/pace.md)", gt=0
    )
    """Fastest that goals move; rolling legs walk by no faster gait, in a simulation neither."""
    limit: float = number(
        _RIGHT_ANGLE, "rad", "assumed: the leg points straight up or down", gt=0, le=_RIGHT_ANGLE
    )
    """Largest angle of a lifting leg either way."""
    reach: float | None = number(
        None, "m", "assumed: from the spine's surface to the width over the legs", ge=0, le=0.5
    )
    """Distance of a lifting leg's foot from its axis at 0 rad, to the side."""
    friction_factors: tuple[_Factor, ...] = number((), "1", "assumed: all 1, which empty means")
    """Friction of each leg on the floor over `leg_friction` of the robot."""

    @property
    def largest(self) -> float:
        """Largest angle either way [rad], inf for rolling legs."""
        return self.limit if self.kind == "lifting" else math.inf


class BaseParams(JointParams):
    """The bases of both antennae, left before right."""

    kind: Literal["pair", "left", "none"] = number("pair", "1", "paper: two antennae")
    """Which antennae the robot has; the left one alone only without legs."""
    servo: ServoName = number("xl330_m288", "1", "paper: XL330 at the antennae", metavar="MODEL")
    """Model of the group's servos, one of those in [servos]."""
    fastest: float = number(
        4.5,
        "rad/s",
        "assumed: as the others; an XL330-M288 makes 10.8 rad/s at 5 V (datasheet)",
        gt=0,
    )
    """Fastest that goals move."""
    limit: float = number(
        _RIGHT_ANGLE,
        "rad",
        "assumed: outwards it lies along the body, inwards it crosses the other",
        gt=0,
        le=_RIGHT_ANGLE,
    )
    """Largest angle either way from the mounting angle."""
    right_stiffness: float = number(1.0, "1", "assumed: springs of one lot", ge=0.1, le=10)
    """Stiffness of the springs of the right antenna over those of the left one."""
    right_gain: float = number(1.0, "1", "assumed: flex sensors of one lot", ge=0.1, le=10)
    """Bend that the right flex sensor feels over what the left one does."""

    @property
    def largest(self) -> float:
        """Largest angle either way [rad]."""
        return self.limit


class ElevationParams(JointParams):
    """The joints that raise and lower the antennae, left before right; they carry the bases."""

    kind: Literal["none", "pair"] = number("none", "1", "paper: antennae stay in the plane")
    """Whether the antennae have them."""
    servo: ServoName = number(
        "xl330_m288", "1", "assumed: as the bases, which they carry", metavar="MODEL"
    )
    """Model of the group's servos, one of those in [servos]."""
    fastest: float = number(4.5, "rad/s", "assumed: as the bases", gt=0)
    """Fastest that goals move."""
    limit: float = number(
        _RIGHT_ANGLE, "rad", "assumed: straight up or straight down", gt=0, le=_RIGHT_ANGLE
    )
    """Largest angle either way from the plane of the head."""
    mass: float = number(0.018, "kg", "datasheet: an XL330-M288, the base that it carries", gt=0)
    """Mass that one of them raises beside its antenna."""

    @property
    def largest(self) -> float:
        """Largest angle either way [rad]."""
        return self.limit


class BodyParams(Params):
    """Mass and inertia of a link or a leg. Its frame has x forward, y left and z up.

    That of a link lies in its middle at the height of the axles, that of a leg on its axle. Legs
    point as they do at 0.
    """

    name: str = number("", "1", "assumed: has to be named")
    """Name of the link or leg, such as link0 or leg_l0."""
    mass: float = number(0.1, "kg", "assumed: has to be given", gt=0)
    """Its mass."""
    centre: tuple[_Place, _Place, _Place] = number((0.0, 0.0, 0.0), "m", "assumed: has to be given")
    """Its centre of mass."""
    inertia: tuple[float, float, float, float, float, float] = number(
        (1e-4, 1e-4, 1e-4, 0.0, 0.0, 0.0), "kg·m²", "assumed: has to be given"
    )
    """Its inertia about that centre: xx, yy, zz, xy, xz, yz."""
    source: str = number("", "1", "assumed: not known")
    """What it is made of."""

    @model_validator(mode="after")
    def _is_a_body(self) -> BodyParams:
        xx, yy, zz, xy, xz, yz = self.inertia
        low, middle, high = np.linalg.eigvalsh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        if low < _LEAST_INERTIA or low + middle < high * (1.0 - 1e-6):
            raise ValueError(
                f"inertia: expected moments of a body, each at most the sum of the others, found "
                f"{low:.3g}, {middle:.3g} and {high:.3g} kg·m² about its axes"
            )
        return self
