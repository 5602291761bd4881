"""The topics of a log, live, as topics of ROS 2, and goals of joints that come back.

Whoever reaches the domain can read along. Goals are taken only where they are accepted, only for
all joints of the robot by their names, and go to the drive, whose supervisor decides.
"""

from __future__ import annotations

import time
from collections.abc import Callable

from antennate.sim.frames import LinkFrames, Links
from antennate.telemetry import transforms
from antennate.telemetry.header import Header
from antennate.telemetry.ticks import Tick
from antennate.telemetry.topics import HEADER_TOPICS, JOINT_COMMANDS, TOPICS
from antennate.telemetry.transforms import Transforms
from antennate.telemetry.view.channel import HEADER, LINKS, PLACES, TICK, Channel
from antennate.telemetry.view.dds import Topics
from antennate.telemetry.view.goals import GoalTaker
from antennate.telemetry.view.live import LiveTopics
from antennate.telemetry.view.player import LogScene
from antennate.telemetry.view.process import Place

GOAL_TOPIC = "/joint_goals"
"""Where goals are taken, of the type of `/joint_states`."""
_IDLE = 0.1
_LOOK = 0.005
"""Longest wait before goals are looked for [s]: half a tick."""


class RosSink:
    """Publishes the messages that a log would have, and the transforms of the robot's links.

    Args:
        place: Where.
        channel: Where accepted goals go.
        say: Told why the first goals were refused, and at the end how many messages were lost.
    """

    def __init__(self, place: Place, channel: Channel, say: Callable[[str], None]) -> None:
        self._topics, self._say = LiveTopics(), say
        self._node = node = Topics(place.domain, place.network)  # all ends with it
        self._writers = {
            topic: node.writer(
                topic.name, topic.type.name, topic.type.schema, kept=topic in HEADER_TOPICS
            )
            for topic in TOPICS
        }
        self._tf = node.writer(transforms.NAME, transforms.TYPE, transforms.SCHEMA)
        self._transforms: Transforms | None = None
        self._robot: _Robot | None = None
        self._goals: GoalTaker | None = None
        if place.accept:
            kind = JOINT_COMMANDS.type
            self._goals = GoalTaker(node.reader(GOAL_TOPIC, kind.name, kind.schema), channel, say)

    def draw(self, now: float) -> float:
        """Take goals; the time until the next look [s]."""
        if self._goals is None:
            return _IDLE
        self._goals.look()
        return _LOOK

    def end(self) -> None:
        """Say how many messages found no room."""
        if dropped := sum(each.dropped for each in (*self._writers.values(), self._tf)):
            self._say(f"ros: {dropped} messages found no room")

    def take(self, kind: bytes, content: bytes) -> None:
        """Send a message on."""
        live = self._topics
        if kind == LINKS:
            links = Links.unpack(content)
            live.names, live.start = links.joints, time.time_ns()
            self._transforms = Transforms(links, placed=True)
        for topic, data in live.messages(kind, content):
            self._writers[topic].write(data, live.now)
        if kind == HEADER and live.header is not None:
            self._begin(live.header)
        elif kind == PLACES:
            self._place(content)
        elif kind == TICK and self._robot is not None and self._tf.heard:
            self._place(self._robot.places(live.tick))

    def _begin(self, header: Header) -> None:
        """Know the robot of a drive or of a log."""
        self._robot = _Robot(header)
        self._transforms = Transforms(self._robot.links, placed=False)
        if self._goals is not None:
            self._goals.robot = header.robot

    def _place(self, places: bytes) -> None:
        if self._transforms is not None and self._tf.heard:
            now = self._topics.now
            self._tf.write(self._transforms.encode(places, now), now)


class _Robot:
    """The robot of a drive or of a log, put where its joints are."""

    def __init__(self, header: Header) -> None:
        self._scene = LogScene(header, None)
        self._frames = LinkFrames(self._scene.world.model)
        self.links = self._frames.links

    def places(self, tick: Tick | None) -> bytes:
        """Where its links are, wherever its head is."""
        if tick is not None:
            self._scene.place_joints(tick)
        return self._frames.places(self._scene.world.data)
