"""The topics of a log, live, as topics of ROS 2, and goals of joints that come back.

Whoever reaches the domain can read along. Goals are taken only where they are accepted, only for
all joints of the robot by their names, and go to the drive, whose supervisor decides.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from antennate.sim.frames import LinkFrames
from antennate.telemetry import transforms
from antennate.telemetry.header import Header
from antennate.telemetry.topics import HEADER_TOPICS, JOINT_COMMANDS, TOPICS
from antennate.telemetry.view.channel import HEADER, LINKS, PLACES, TICK, Channel, read
from antennate.telemetry.view.dds import Topics
from antennate.telemetry.view.goals import GoalTaker
from antennate.telemetry.view.live import LiveTopics
from antennate.telemetry.view.player import LogScene
from antennate.telemetry.view.process import Place
from antennate.types import Floats

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
        say: Told why the first goals were refused.
    """

    def __init__(self, place: Place, channel: Channel, say: Callable[[str], None]) -> None:
        self._node = node = Topics(place.domain, place.network)  # all ends with it
        self._live = LiveTopics()
        self._writers = {
            topic: node.writer(
                topic.name, topic.type.name, topic.type.schema, topic in HEADER_TOPICS
            )
            for topic in TOPICS
        }
        self._tf = node.writer(transforms.NAME, transforms.TYPE, transforms.SCHEMA)
        self._names, self._parents = list[str](), list[int]()
        self._scene: LogScene | None = None
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
        """What was sent stays with who reads."""

    def take(self, kind: bytes, content: bytes) -> None:
        """Send a message on."""
        live = self._live
        if kind == LINKS:
            links = read(content)
            self._names, self._parents = links["names"], links["parents"]
            live.names, live.start = tuple(links["joints"]), time.time_ns()
        for topic, data in live.messages(kind, content):
            self._writers[topic].write(data, live.now)
        if kind == HEADER and live.header is not None:
            self._scene = None
            if self._goals is not None:
                self._goals.robot = live.header.robot
        elif kind == PLACES:
            self._place(np.frombuffer(content).reshape(-1, 7))
        elif kind == TICK and live.header is not None and self._tf.heard:
            self._place(self._placed(live.header))

    def _placed(self, header: Header) -> Floats:
        """Places of the links of a drive or of a log, from the angles of the newest tick."""
        if self._scene is None:
            self._scene = LogScene(header, None)
            self._frames = LinkFrames(self._scene.world.model)
            self._names, self._parents = self._frames.names, self._frames.parents
        if self._live.tick is not None:
            self._scene.place_joints(self._live.tick)
        return self._frames.places(self._scene.world.data)

    def _place(self, places: Floats) -> None:
        if self._tf.heard:
            now, placed = self._live.now, self._live.header is None
            data = transforms.encoded(self._names, self._parents, places, now, placed)
            self._tf.write(data, now)
