"""Messages of the topics of a log, made of what comes by the channel of a live view."""

from __future__ import annotations

from collections.abc import Iterator

from antennate.telemetry.header import Header
from antennate.telemetry.ticks import Tick
from antennate.telemetry.topics import EVENTS, Topic
from antennate.telemetry.view.channel import HEADER, TEXT, TICK

_INFO = 20


class LiveTopics:
    """Messages of one drive, simulation or log after the other.

    Attributes:
        names: Names of the joints, empty while they are not known.
        header: The header of a drive or a log, None of a simulation.
        tick: The newest tick, None before the first.
        start: Time at which the loop's time was zero [ns].
        now: Time of the newest message [ns].
    """

    def __init__(self) -> None:
        self.names: tuple[str, ...] = ()
        self.header: Header | None = None
        self.tick: Tick | None = None
        self.start = self.now = 0

    def messages(self, kind: bytes, content: bytes) -> Iterator[tuple[Topic, bytes]]:
        """Topics and messages that a message of the channel brings; of most kinds none."""
        if kind == TICK:
            self.tick = tick = Tick.unpack(content)
            self.now = max(0, self.start + round(1e9 * tick.now))
            yield from tick.messages(self.names, self.now)
        elif kind == TEXT:
            time = divmod(self.now, 10**9)
            text = content.decode("utf-8", "replace")
            yield EVENTS, EVENTS.type.encode(*time, _INFO, "antennate", text, "", "", 0)
        elif kind == HEADER:
            self.header = header = Header.unpack(content)
            self.names, self.start = header.robot.joint_names, header.start
            self.now = header.start
            yield from header.messages().items()
