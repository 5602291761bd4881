"""What an antenna board says in a few seconds at rest."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from antennate.hardware.doctor.rows import Opener
from antennate.hardware.doctor.survey import master
from antennate.hardware.esp32.board import BOARD_BAUD
from antennate.hardware.esp32.decoder import Counters
from antennate.hardware.esp32.stream import Reading, Stream
from antennate.hardware.esp32.wire import Hello
from antennate.params import DoctorParams
from antennate.robots.spec import RobotSpec
from antennate.types import Floats

_PATIENCE = 0.02


@dataclass(slots=True)
class Heard:
    """What came from the board's port.

    Attributes:
        hello: Its greeting, None if none came.
        refusals: Why frames were refused.
        text: Printable text that came instead of frames.
        received: Bytes received.
        readings: Usable samples after the greeting.
        lost: Samples between them that never came.
        dropped: Samples that the board itself could not send meanwhile.
        broken: Pieces with a wrong CRC or code after the greeting.
        boots: Times it started anew meanwhile.
        servos: The port speaks as a bus of servos.
    """

    hello: Hello | None = None
    refusals: list[str] = field(default_factory=list[str])
    text: str = ""
    received: int = 0
    readings: list[Reading] = field(default_factory=list[Reading])
    lost: int = 0
    dropped: int = 0
    broken: int = 0
    boots: int = 0
    servos: bool = False

    @property
    def counts(self) -> Floats:
        """Readings of both antennae [counts], shape (n, 2)."""
        pairs = [(r.timed.sample.left, r.timed.sample.right) for r in self.readings]
        return np.array(pairs, float).reshape(-1, 2)

    @property
    def rate(self) -> float | None:
        """Samples per second as they arrived [Hz], None of fewer than two."""
        span = self.readings[-1].now - self.readings[0].now if self.readings else 0.0
        return (len(self.readings) - 1) / span if span > 0 else None


def listen(
    opener: Opener, robot: RobotSpec, params: DoctorParams, now: Callable[[], float]
) -> Heard:
    """Wait for a greeting and listen for a while; if none comes, see whether servos are there.

    Raises:
        PortError: The port is gone or cannot be opened.
    """
    heard = Heard()
    with opener(BOARD_BAUD) as port:
        port.drain()
        stream = Stream(port, now)
        end = now() + params.greeting
        while (stream.hello is None or stream.clock.newest is None) and now() < end:
            stream.take(_PATIENCE)
        if stream.hello is not None:
            _record(stream, heard, params.listen, now)
        heard.hello, heard.refusals = stream.hello, stream.refusals
        heard.text, heard.received = stream.decoder.take_text(), stream.decoder.counters.received
    if heard.hello is None and not heard.refusals:
        with opener(robot.baud) as port:
            heard.servos = bool(master(port, robot.baud, now).scan())
    return heard


def _record(stream: Stream, heard: Heard, seconds: float, now: Callable[[], float]) -> None:
    broken, boots, lost = _broken(stream.decoder.counters), stream.clock.resets, _lost(stream)
    end = now() + seconds
    while now() < end:
        heard.readings += stream.take(_PATIENCE)
    heard.boots = stream.clock.resets - boots
    heard.lost = _lost(stream) - (0 if heard.boots else lost)
    heard.broken = _broken(stream.decoder.counters) - broken
    if heard.readings and not heard.boots:
        first, last = heard.readings[0].timed.sample, heard.readings[-1].timed.sample
        heard.dropped = (last.drops - first.drops) % (1 << 16)


def _lost(stream: Stream) -> int:
    return stream.clock.sequence.lost


def _broken(counters: Counters) -> int:
    return counters.crc_errors + counters.cobs_errors + counters.oversize + counters.noise
