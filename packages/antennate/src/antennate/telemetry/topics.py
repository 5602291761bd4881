"""The topics of a log and the definitions of their messages, in the words of ROS 2.

Every tick has one message in each of `TICK_TOPICS`, and in others where there is something to say,
all with the tick's number and time. docs/topics.py makes a page of the site from them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

from antennate.errors import LogError
from antennate.messages import shortened
from antennate.telemetry.cdr import MessageType

if TYPE_CHECKING:
    from mcap.records import Channel, Schema


class Topic(NamedTuple):
    """A topic: its name, the type of its messages, and what they say."""

    name: str
    type: MessageType
    meaning: str

    def decode(self, data: bytes) -> dict[str, Any]:
        """The values of a message by name."""
        try:
            return self.type.decode(data)
        except LogError as error:
            raise LogError(f"{self.name}: {error}") from None


_ANTENNA = """\
float64 t           # time of the frame, as the controller got it [s]
float64[2] counts   # readings that the controller got, left and right [counts]; NaN is UNKNOWN
float64[2] reading  # readings before the supervisor withheld them [counts]
float64[2] level    # bending levels, 0 to 1; NaN if the controller has none
int64[2] contact    # 0 FREE, 1 CONTACT, 2 UNKNOWN
float64 age         # age of the newest sample [s]; NaN in simulation
"""
_MANEUVER = """\
uint64 number   # ticks since the controller began, this one included
float64 now     # time of the loop [s]
int64 maneuver  # 0 FORWARD, 1 TURN_L, 2 TURN_R, 3 REVERSE, 4 HOLD
float64 phase   # gait phase [rad]; NaN if the controller has none
bool asked      # whether the controller was asked; if not, its last command was kept
"""
_COUNTERS = """\
uint64 missed   # ticks left out so far
uint64 frames   # good frames of the board so far
uint64 crc      # frames with a wrong CRC so far
uint64 lost     # samples that never came
uint64 misses   # answers that servos did not give so far
uint64 stale    # late answers thrown away so far
uint64 sent     # commands sent so far
uint64 refused  # commands refused so far
"""
_SUPERVISOR = """\
string state     # OK, DEGRADED, HOLD, FAULT or OFF; empty without a supervisor
string note      # what the operator should know or do
string[] causes  # in force, the most severe first
"""
_FORCES = """\
string[] part     # part of the robot that touches an obstacle
float64[] x       # where [m]
float64[] y       # [m]
float64[] z       # [m]
float64[] normal  # normal force [N]
"""
_COORDINATES = """\
uint32 robot        # number of the first coordinate of the robot: place, quaternion, joints
float64[] position  # coordinates of the simulated world, as MuJoCo has them [m, rad]
"""
_JOINT_STATE = """\
int32 sec
uint32 nanosec
string frame_id
string[] name
float64[] position
float64[] velocity
float64[] effort
"""
_IMU = """\
int32 sec
uint32 nanosec
string frame_id
float64[4] orientation
float64[9] orientation_covariance
float64[3] angular_velocity
float64[9] angular_velocity_covariance
float64[3] linear_acceleration
float64[9] linear_acceleration_covariance
"""
_LOG = """\
int32 sec
uint32 nanosec
uint8 level
string name
string msg
string file
string function
uint32 line
"""
_RULE = "=" * 80
_TIME = f"""\
{_RULE}
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""
HEADER_SCHEMA = f"""\
{_RULE}
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
{_TIME}"""
TURN_SCHEMA = f"""\
{_RULE}
MSG: geometry_msgs/Quaternion
float64 x
float64 y
float64 z
float64 w
{_RULE}
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
"""
_STATE_SCHEMA = f"""\
std_msgs/Header header
string[] name
float64[] position  # [rad]
float64[] velocity  # [rad/s]; empty where it is not measured
float64[] effort    # [N m]; empty where it is not measured
{HEADER_SCHEMA}"""
_IMU_SCHEMA = f"""\
std_msgs/Header header
geometry_msgs/Quaternion orientation
float64[9] orientation_covariance  # the first is -1: no orientation is measured
geometry_msgs/Vector3 angular_velocity  # as the controller got it [rad/s]; NaN is unknown
float64[9] angular_velocity_covariance
geometry_msgs/Vector3 linear_acceleration  # specific force, likewise [m/s^2]
float64[9] linear_acceleration_covariance
{HEADER_SCHEMA}{TURN_SCHEMA}"""
_LOG_SCHEMA = f"""\
builtin_interfaces/Time stamp
uint8 level
string name
string msg
string file
string function
uint32 line
{_TIME}"""


def _own(name: str, fields: str) -> MessageType:
    return MessageType(f"antennate_msgs/msg/{name}", fields)


_STATE = MessageType("sensor_msgs/msg/JointState", _JOINT_STATE, _STATE_SCHEMA)
_INERTIAL = MessageType("sensor_msgs/msg/Imu", _IMU, _IMU_SCHEMA)
_STRING = MessageType("std_msgs/msg/String", "string data\n")

ANTENNA = Topic("/antenna", _own("Antenna", _ANTENNA), "readings, and what was made of them")
MANEUVER = Topic(
    "/maneuver", _own("Maneuver", _MANEUVER), "what the controller decided; -1 for a twin"
)
COUNTERS = Topic("/counters", _own("Counters", _COUNTERS), "what went wrong so far, on a robot")
SUPERVISOR = Topic(
    "/supervisor", _own("Supervisor", _SUPERVISOR), "state of a robot's supervisor, and why"
)
JOINT_COMMANDS = Topic("/joint_commands", _STATE, "angles commanded, by names of joints")
JOINT_STATES = Topic(
    "/joint_states", _STATE, "angles measured; speed and torque as well in simulation"
)
CONTACT_FORCES = Topic(
    "/contact_forces",
    _own("ContactForces", _FORCES),
    "forces of obstacles on the robot, ten times a second, in simulation",
)
COORDINATES = Topic(
    "/coordinates",
    _own("Coordinates", _COORDINATES),
    "state of the engine, ten times a second, in simulation, so that the log can be watched",
)
IMU = Topic(
    "/imu",
    _INERTIAL,
    "what the inertial sensor felt, along the axes of the head: x forward, y left, z up",
)
EVENTS = Topic(
    "/events",
    MessageType("rcl_interfaces/msg/Log", _LOG, _LOG_SCHEMA),
    "each change of the supervisor's state, begin and end of each step of a protocol, a recovery",
)
CONFIG = Topic(
    "/config", _STRING, "JSON: the controller with its numbers, robot, seed and trial, protocol"
)
CALIBRATION = Topic("/calibration", _STRING, "JSON: the calibration file of each antenna, if any")
VERSIONS = Topic("/versions", _STRING, "JSON: versions of antennate, Python, NumPy and MuJoCo")

PROTOCOL = "protocol"
"""Source of the events of a protocol; their texts are `begin NAME`, `end NAME`, `break NAME`."""
TICK_TOPICS = (ANTENNA, MANEUVER, JOINT_COMMANDS)
HEADER_TOPICS = (CONFIG, CALIBRATION, VERSIONS)
TOPICS = (
    *HEADER_TOPICS,
    *TICK_TOPICS,
    COUNTERS,
    SUPERVISOR,
    JOINT_STATES,
    CONTACT_FORCES,
    EVENTS,
    COORDINATES,
    IMU,
)
"""All, in the order of their channels: the first has id 1. A new one comes last."""

JOINTS = ("angles", "positions", "velocities", "efforts")
"""Numbers of a tick for each joint: the commanded, then the measured ones, empty if unknown."""
MOTION = ("angular_velocity", "linear_acceleration")
"""Numbers of a tick along the three axes of the head, empty without an inertial sensor."""


def topics_of(has_imu: bool) -> tuple[Topic, ...]:
    """The topics of the log of a robot with an inertial sensor, or of one without."""
    return TOPICS if has_imu else tuple(topic for topic in TOPICS if topic is not IMU)


def imu_values(
    stamp: int, angular_velocity: Sequence[float], linear_acceleration: Sequence[float]
) -> tuple[Any, ...]:
    """The values of a message of `IMU` at a time [ns]; no covariance is known."""
    unknown = (0.0,) * 9
    none = (-1.0, *unknown[1:])
    seconds = divmod(stamp, 10**9)
    measured = (angular_velocity, unknown, linear_acceleration, unknown)
    return (*seconds, "link0", (0.0, 0.0, 0.0, 1.0), none, *measured)


TICK = _own(
    "Tick",
    _ANTENNA
    + _MANEUVER
    + _COUNTERS
    + "".join(f"float64[] {name}\n" for name in (*JOINTS, *MOTION))
    + _SUPERVISOR
    + "string[] events\n",
)
"""A whole tick, on its way from the loop to the process that writes the log."""


def by_channel(channels: Mapping[int, Channel], schemas: Mapping[int, Schema]) -> dict[int, Topic]:
    """The topics of a log by the number of their channel.

    Args:
        channels: The channels by their number.
        schemas: The definitions of messages by their number.
    """
    known = {topic.name: topic for topic in TOPICS}
    named: dict[int, Topic] = {}
    for number, channel in channels.items():
        topic = known.get(channel.topic)
        if topic is None:
            continue
        schema = schemas.get(channel.schema_id)
        kind = "nothing" if schema is None else schema.name
        definition = "" if schema is None else schema.data.decode(errors="replace")
        if (kind, _bare(definition)) != (topic.type.name, _bare(topic.type.schema)):
            raise LogError(
                f"expected {topic.type.name} as now defined in {topic.name}, found "
                f"{shortened(kind)} of another definition; read it with the version that wrote it"
            )
        if channel.message_encoding != "cdr":
            encoding = shortened(channel.message_encoding)
            raise LogError(f"expected messages in {topic.name} encoded as cdr, found {encoding}")
        named[number] = topic
    return named


def _bare(definition: str) -> list[list[str]]:
    """The words of each line of a definition without its comments, which other programs drop."""
    lines = (line.partition("#")[0].split() for line in definition.splitlines())
    return [words for words in lines if words]
