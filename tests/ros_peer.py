"""A program of somebody else on the topics of ROS 2: a plain client of DDS with its own types.

As a process of its own it listens or sends, and prints what came as lines of JSON:
`ros_peer.py DOMAIN listen SECONDS`, `... goals SECONDS VALUE NAME...`, which sends the same angle
for all joints a hundred times a second, `... rubbish SECONDS`.
"""

import json
import math
import sys
import time
from dataclasses import dataclass
from typing import Any

from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import float64, int32, sequence, uint32
from cyclonedds.pub import DataWriter
from cyclonedds.qos import Policy, Qos
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic

LOOPBACK = """<CycloneDDS><Domain Id="any"><General><Interfaces>
<NetworkInterface address="127.0.0.1" multicast="false"/></Interfaces></General>
<Discovery><ParticipantIndex>auto</ParticipantIndex>
<Peers><Peer Address="127.0.0.1"/></Peers></Discovery></Domain></CycloneDDS>"""


@dataclass
class Time(IdlStruct, typename="builtin_interfaces::msg::dds_::Time_"):
    sec: int32  # type: ignore[valid-type]
    nanosec: uint32  # type: ignore[valid-type]


@dataclass
class Header(IdlStruct, typename="std_msgs::msg::dds_::Header_"):
    stamp: Time
    frame_id: str


@dataclass
class JointState(IdlStruct, typename="sensor_msgs::msg::dds_::JointState_"):
    header: Header
    name: sequence[str]  # type: ignore[type-arg]
    position: sequence[float64]  # type: ignore[type-arg]
    velocity: sequence[float64]  # type: ignore[type-arg]
    effort: sequence[float64]  # type: ignore[type-arg]


@dataclass
class Vector3(IdlStruct, typename="geometry_msgs::msg::dds_::Vector3_"):
    x: float64  # type: ignore[valid-type]
    y: float64  # type: ignore[valid-type]
    z: float64  # type: ignore[valid-type]


@dataclass
class Quaternion(IdlStruct, typename="geometry_msgs::msg::dds_::Quaternion_"):
    x: float64  # type: ignore[valid-type]
    y: float64  # type: ignore[valid-type]
    z: float64  # type: ignore[valid-type]
    w: float64  # type: ignore[valid-type]


@dataclass
class Transform(IdlStruct, typename="geometry_msgs::msg::dds_::Transform_"):
    translation: Vector3
    rotation: Quaternion


@dataclass
class TransformStamped(IdlStruct, typename="geometry_msgs::msg::dds_::TransformStamped_"):
    header: Header
    child_frame_id: str
    transform: Transform


@dataclass
class TFMessage(IdlStruct, typename="tf2_msgs::msg::dds_::TFMessage_"):
    transforms: sequence[TransformStamped]  # type: ignore[type-arg]


@dataclass
class String(IdlStruct, typename="std_msgs::msg::dds_::String_"):
    data: str


RELIABLE = Policy.Reliability.Reliable(0)


def reader(participant: Any, topic: str, kind: Any, *more: Any) -> Any:
    """A reader as a node of ROS 2 has it."""
    qos = Qos(RELIABLE, Policy.History.KeepLast(200), *more)
    return DataReader(participant, Topic(participant, topic, kind), qos)


def state(names: Any, positions: Any) -> JointState:
    """Goals for joints."""
    return JointState(Header(Time(0, 0), ""), list(names), list(positions), [], [])


def taken(source: Any) -> list[Any]:
    """Messages that have come."""
    return [each for each in source.take(200) if not hasattr(each, "key")]


def listen(participant: Any, seconds: float) -> None:
    """Print each message of the joints: its stamp [s], its delay [s], names and angles."""
    source, end = reader(participant, "rt/joint_states", JointState), time.time() + seconds
    while time.time() < end:
        for message in taken(source):
            stamp = message.header.stamp
            t = stamp.sec + 1e-9 * stamp.nanosec
            line = [t, time.time() - t, list(message.name), list(message.position)]
            sys.stdout.write(json.dumps(line) + "\n")
        sys.stdout.flush()
        time.sleep(0.002)


def send(participant: Any, seconds: float, *messages: JointState) -> None:
    """Send messages in turn, a hundred a second."""
    topic = Topic(participant, "rt/joint_goals", JointState)
    writer = DataWriter(participant, topic, Qos(RELIABLE, Policy.History.KeepLast(10)))
    end, number = time.time() + seconds, 0
    while time.time() < end:
        writer.write(messages[number % len(messages)])
        number += 1
        time.sleep(0.01)


def rubbish() -> tuple[JointState, ...]:
    """Goals of another robot, and what no robot can do."""
    names = ["yaw1", "yaw2"]
    return (
        state(names, [0.1, 0.1]),
        state(names, [0.1]),
        state([], []),
        state(["a"] * 19, [0.0] * 19),
        state(names, [math.nan, math.inf]),
    )


def main() -> None:
    """Do what the words say."""
    number, what, seconds, *more = sys.argv[1:]
    domain = Domain(int(number), LOOPBACK)
    participant = DomainParticipant(int(number))
    if what == "listen":
        listen(participant, float(seconds))
    elif what == "rubbish":
        send(participant, float(seconds), *rubbish())
    else:
        value, *names = more
        send(participant, float(seconds), state(names, [float(value)] * len(names)))
    del domain


if __name__ == "__main__":
    main()
