"""Which parameters a robot, its simulation and our controllers read, and which they do not."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from antennate.params.base import paths_of
from antennate.params.climb import ClimbParams, HeadingParams
from antennate.params.control import (
    CentreParams,
    ControlParams,
    EscapeParams,
    FollowParams,
    GeometricParams,
    RandomParams,
    RepetitionParams,
    ScheduleParams,
    SearchParams,
    TimedParams,
    ZigzagParams,
)
from antennate.params.gaits import LiftParams
from antennate.robots.antenna import AntennaSpec
from antennate.robots.imu import ImuParams
from antennate.robots.joints import BaseParams, ElevationParams
from antennate.robots.servos import ServosParams
from antennate.robots.spec import RobotSpec

HARDWARE_ALONE = (
    *(
        f"robot.{group}.{name}"
        for group in ("yaw", "legs", "antennae", "pitch", "elevation")
        for name in ("ids", "directions", "zeros", "limit", "fastest")
        if (group, name) != ("yaw", "limit")
    ),
    "robot.antenna.sensor.rate",
    "robot.baud",
    "robot.release",
)
"""Parameters that only the robot's hardware, or its twin, reads; the simulation alone does not."""
KEPT_BY_CLIMBERS = ("robot.pitch.limit", "robot.elevation.limit")
"""Those of them that controllers that climb keep, in a simulation too."""
SIMULATION_ALONE = (
    *(
        f"robot.{name}"
        for name in (
            "mass",
            "leg_width",
            "leg_mass",
            "leg_friction",
            "body_friction",
            "body_radius",
            "pitch.stiffness",
            "elevation.mass",
            "legs.reach",
            "imu.gyro_noise",
            "imu.gyro_bias",
            "imu.accel_noise",
            "imu.accel_bias",
        )
    ),
    *paths_of(ServosParams, "robot.servos"),
    *paths_of(AntennaSpec, "robot.antenna"),
)
"""Parameters that only the simulation, or the twin, reads; the robot's hardware does not."""
_OF_FOLLOWING = {
    f"robot.servos.{servo}.{name}"
    for servo in ServosParams.model_fields
    for name in ("p_gain", "gain_divisor", "no_load_speed")
}
UNDRIVEN = tuple(path for path in SIMULATION_ALONE if path not in _OF_FOLLOWING)
"""The same of a drive, which judges by the models of its servos whether joints follow."""


def unused(robot: RobotSpec) -> dict[str, str]:
    """Parameters of what a robot does not have, as `robot.servos...`, and why."""
    used = {f"robot.servos.{name}" for name in robot.servo_names}
    paths = paths_of(ServosParams, "robot.servos")
    servos = (path for path in paths if path.rpartition(".")[0] not in used)
    reasons = dict.fromkeys(servos, "no joint of the robot has this servo")
    if robot.legs.kind == "rolling":
        lifting = ("robot.legs.limit", "robot.legs.reach")
        reasons |= dict.fromkeys(lifting, "only legs of the kind lifting have it")
    if robot.pitch.kind == "actuated":
        reasons["robot.pitch.stiffness"] = "only pitch joints of the kind locked have it"
    if not robot.elevation_count:
        names = (name for name in ElevationParams.model_fields if name != "kind")
        paths = (f"robot.elevation.{name}" for name in names)
        reasons |= dict.fromkeys(paths, "the antennae of the robot have no vertical joints")
    if not robot.has_imu:
        paths = (f"robot.imu.{name}" for name in ImuParams.model_fields if name != "kind")
        reasons |= dict.fromkeys(paths, "the robot has no inertial sensor")
    if not robot.antenna_count:
        bases = (f"robot.antennae.{name}" for name in BaseParams.model_fields if name != "kind")
        paths = (*bases, *paths_of(AntennaSpec, "robot.antenna"))
        reasons |= dict.fromkeys(paths, "the robot has no antennae")
    return reasons


TELEOP = "keys of teleop"
"""Stands for the controller of `drive teleop`, which has no name."""
BY_CONTACT = "closed-1 by contact"
"""Stands for `closed-1` with `escape.trigger` `contact`."""
_BLOCKED = ("rule.strong", "rule.similar")
"""When the published table backs off."""
_REPEATED = ("repetition.window_cycles", "repetition.change")
"""When readings repeat."""
_ESCAPE = (*paths_of(RepetitionParams, "repetition"), *paths_of(EscapeParams, "escape"))
_TIMED = paths_of(TimedParams, "timed")
_SCHEDULE = paths_of(ScheduleParams, "schedule")
_ZIGZAG = paths_of(ZigzagParams, "zigzag")
_RANDOM = paths_of(RandomParams, "random")
_FOLLOW = paths_of(FollowParams, "follow")
_CENTRE = paths_of(CentreParams, "centre")
_BLIND = (*_TIMED, *_SCHEDULE, *_ZIGZAG, *_RANDOM)
_CLIMB = paths_of(ClimbParams, "climb")
_HEADING = paths_of(HeadingParams, "climb.heading")
_BODY = tuple(
    f"climb.{name}"
    for name in (
        *("rise", "ramp", "before", "over", "settle", "amplitude", "amplitude_rate", "rate"),
        *("carry_gain", "carry_rate", "frequency", "ahead"),
    )
)
"""What raises a body."""
_CARRY = ("climb.carry_gain", "climb.carry_rate")
"""What holds a raised head in spite of its load."""
_RAISED = (*(path for path in _BODY if path not in _CARRY), *_HEADING, "climb.feel.highest")
"""The same with antennae held up, without that, and what keeps its heading."""
_SWEEP = ("gait.antenna_mean", "gait.antenna_amplitude", "gait.antenna_frequency")
"""How the gait moves the bases; those that climb move them themselves."""
_RHYTHM = tuple(
    f"climb.{name}" for name in ("walk_time", "retreat_time", "lift_time", "come_time", "pace")
)
"""A round of `rhythm`."""
_OTHERS = (*_BLIND, *_FOLLOW, *_CENTRE, *_CLIMB)
"""Groups of single controllers, and of those that climb."""
_GEOMETRIC = paths_of(GeometricParams, "geometric")
_SEARCH = (*paths_of(SearchParams, "search"), *_GEOMETRIC)
_SIZES = (
    *(f"search.{name}" for name in ("reverse_time", "reverse_most", "turn_time")),
    *("search.lost_turn", "search.return_time"),
)
"""What `geometric` has in metres and degrees."""
_HOLD = ("rule.hold_time", "rule.hold_forward")
"""How long the published table keeps a maneuver."""
_TABLE = ("gait.turn_offset", *_BLOCKED, *_HOLD)
"""What the published table reads and a walk or an escape does not."""
_TURNING = tuple(path for path in _ESCAPE if path != "escape.turn_offset")
"""All of an escape but how it turns."""
_OTHER_ESCAPE = tuple(path for path in _TURNING if path.startswith("escape."))
"""What the search has in place of an escape: all but how fast it turns."""
_FELT = (
    *paths_of(RepetitionParams, "repetition"),
    *(f"escape.{name}" for name in ("trigger", "first_turn", "memory_time", "memory_delay")),
    *("escape.lost_time", "escape.return_time", "escape.retry_time"),
)
"""What an escape does not read where nothing is felt."""


def _without(read: tuple[str, ...], *others: str) -> tuple[str, ...]:
    """Parameters of single controllers but those that one of them reads, and others."""
    return (*_TABLE, *_SEARCH, *(path for path in _OTHERS if path not in read), *others)


_MAP = ("escape.reverse_time", "escape.return_time", "escape.turn_offset")
"""Of an escape what `map` reads."""
UNREAD: Mapping[str, tuple[str, ...]] = {
    "open": (*_TABLE, *_ESCAPE, *_OTHERS, *_SEARCH),
    "timed": _without(_TIMED, *_FELT),
    "paper": (*_ESCAPE, *_OTHERS, *_SEARCH),
    "closed": (*_TABLE, *_OTHERS, *_OTHER_ESCAPE, *_GEOMETRIC),
    "geometric": (*_TABLE, *_OTHERS, *_OTHER_ESCAPE, *_SIZES),
    "closed-1": (*_TABLE, *_OTHERS, *_SEARCH),
    BY_CONTACT: ("gait.turn_offset", *_HOLD, *_REPEATED, *_OTHERS, *_SEARCH),
    "schedule": _without(_SCHEDULE, *_TURNING),
    "follow": _without(_FOLLOW, *_TURNING),
    "centre": _without(_CENTRE, *_TURNING),
    "zigzag": _without(_ZIGZAG, *_TURNING),
    "random": _without(_RANDOM, *_TURNING),
    "climb": (
        *(*_TABLE, *_BLIND, *_FOLLOW, *_CENTRE, *_OTHER_ESCAPE, *_GEOMETRIC),
        *("climb.lift", "climb.walk_time", "climb.come_time", *_SWEEP),
    ),
    "lifted": _without(("climb.rate", "climb.lift"), *_ESCAPE, *_SWEEP),
    "rhythm": _without((*_RAISED, *_CARRY, *_RHYTHM), *_ESCAPE, *_SWEEP),
    "edges": _without((*_RAISED, "climb.pace"), *_ESCAPE, *_SWEEP),
    "map": (*_TABLE, *_OTHERS, *_SEARCH, *(path for path in _ESCAPE if path not in _MAP)),
    TELEOP: (*_BLOCKED, *_HOLD, *_ESCAPE, *_OTHERS, *_SEARCH),
}
"""Parameters of `ControlParams`, dotted, that a controller of ours does not read."""
_POLICY = ("rate", "gait.", "conditioning", "rule.threshold", "rule.hysteresis")
UNREAD_BY_POLICIES = tuple(p for p in paths_of(ControlParams) if not p.startswith(_POLICY))
"""The same of a policy file. Another rate or gait than that of its contract is refused with it."""


def unread(name: str, control: ControlParams, knows: Sequence[str] = ()) -> set[str]:
    """Parameters of the control, dotted, that a controller does not read on any robot.

    A controller of one's own may read all.

    Args:
        name: The controller.
        control: All numbers of the control.
        knows: What a simulation tells it; a robot tells nothing.
    """
    by_contact = name == "closed-1" and control.escape.trigger == "contact"
    own = UNREAD_BY_POLICIES if name.endswith(".onnx") else ()
    paths = set(UNREAD.get(BY_CONTACT if by_contact else name, own))
    if name == "closed-1" and "jam" in knows:
        paths |= {"escape.trigger", *_REPEATED, *_BLOCKED}
    if name in ("closed", "geometric") and "jam" in knows:
        paths |= {"search.patience", *_REPEATED}
    if name == "timed" and "jam" in knows:
        paths |= set(_TIMED)
    if name == "timed" and {"facing", "map"} & set(knows):
        paths -= {"escape.return_time", *(["escape.lost_time"] if "facing" in knows else [])}
    return paths


def unread_by_all(
    names: Sequence[str], control: ControlParams, robot: RobotSpec, knows: Sequence[str] = ()
) -> dict[str, str]:
    """Parameters that none of these controllers reads, as `control.rule.strong`, and why."""
    who = f"{' and '.join(names)} {'does' if len(names) == 1 else 'do'} not read it"
    paths = set.intersection(*(unread(name, control, knows) for name in names))
    reasons = {f"control.{path}": who for path in sorted(paths)}
    if not set(names) <= set(UNREAD):
        return reasons
    if not robot.has_imu:
        for path in _HEADING:
            reasons.setdefault(f"control.{path}", "the robot has no inertial sensor")
    return reasons | unread_lift(robot, "control.gait")


def unread_limits(names: Sequence[str]) -> dict[str, str]:
    """Limits of joints that none of these controllers keeps, and why."""
    climbers = {"climb", "lifted", "rhythm", "edges"}
    if not set(names) <= set(UNREAD) - climbers:
        return {}
    return dict.fromkeys(KEPT_BY_CLIMBERS, "only controllers that climb read it in a simulation")


def unread_lift(robot: RobotSpec, gait: str) -> dict[str, str]:
    """Parameters of the step of lifting legs that our gait does not read, and why.

    Args:
        robot: The robot that walks.
        gait: Where the gait stands in a configuration, dotted.
    """
    paths = () if robot.legs.kind == "lifting" else paths_of(LiftParams, f"{gait}.lift")
    return dict.fromkeys(paths, "legs that roll do not read it")
