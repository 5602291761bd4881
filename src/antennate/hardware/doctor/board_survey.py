"""The antenna board at rest: its greeting, and its readings over a few seconds."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from antennate.hardware.doctor.bus_survey import master
from antennate.hardware.doctor.check import Opener
from antennate.hardware.esp32.board import BOARD_BAUD, Board
from antennate.hardware.esp32.clock import Timed
from antennate.hardware.esp32.decoder import Counters
from antennate.hardware.esp32.wire import Hello
from antennate.params.hardware import DoctorParams
from antennate.robots.spec import RobotSpec
from antennate.types import Floats

_PATIENCE = 0.02
"""Longest wait for bytes before the time is looked at again [s]."""


@dataclass(slots=True)
class BoardSurvey:
    """What came from the board's port.

    Attributes:
        refusals: Why frames were refused.
        text: Printable text that came instead of frames.
        received: Bytes received.
        readings: Usable samples after the greeting.
        lost: Samples between them that never came.
        dropped: Samples that the board itself could not send meanwhile.
        broken: Pieces with a wrong CRC or code after the greeting.
        boots: Times it started anew meanwhile.
        servos: Whether servos answer on the port.
        radio: Whether the board sends by radio.
    """

    hello: Hello | None = None
    refusals: list[str] = field(default_factory=list[str])
    text: str = ""
    received: int = 0
    readings: list[Timed] = field(default_factory=list[Timed])
    lost: int = 0
    dropped: int = 0
    broken: int = 0
    boots: int = 0
    servos: bool = False
    radio: bool = False

    @property
    def counts(self) -> Floats:
        """Readings of both antennae [counts], shape (n, 2)."""
        pairs = [(r.sample.left, r.sample.right) for r in self.readings]
        return np.array(pairs, float).reshape(-1, 2)

    @property
    def rate(self) -> float | None:
        """Samples per second as they arrived [Hz], None of fewer than two."""
        span = self.readings[-1].arrived - self.readings[0].arrived if self.readings else 0.0
        return (len(self.readings) - 1) / span if span > 0 else None

    def result(self) -> dict[str, Any]:
        """Its part of result.json."""
        counts, hello = self.counts, self.hello
        known = len(counts) > 0
        return {
            "device_id": None if hello is None else hello.device_id,
            "firmware": None if hello is None else list(hello.firmware),
            "reset": None if hello is None else hello.reset.name,
            "rate_hz": self.rate,
            "readings": len(counts),
            "lost": self.lost,
            "broken": self.broken,
            "median_counts": np.median(counts, axis=0).tolist() if known else None,
            "noise_counts": counts.std(axis=0).tolist() if known else None,
        }


def survey_board(
    opener: Opener, robot: RobotSpec, params: DoctorParams, now: Callable[[], float]
) -> BoardSurvey:
    """Wait for a greeting and read for a while; without one, see whether servos are there.

    Raises:
        PortError: The port is gone or cannot be opened.
    """
    survey = BoardSurvey()
    with opener(BOARD_BAUD) as port:
        port.drain()
        board = Board(port)
        end = now() + params.greeting
        while (board.hello is None or board.clock.newest is None) and now() < end:
            board.wait(_PATIENCE, now)
        if board.hello is not None:
            _read(board, survey, params.listen, now)
        survey.hello, survey.refusals = board.hello, board.refusals
        survey.text, survey.received = board.decoder.take_text(), board.decoder.counters.received
    if survey.hello is None and not survey.refusals:
        with master(opener, robot.baud, now) as bus:
            survey.servos = bool(bus.scan())
    return survey


def _read(board: Board, survey: BoardSurvey, seconds: float, now: Callable[[], float]) -> None:
    counters, clock = board.decoder.counters, board.clock
    broken, boots, lost = _broken(counters), clock.resets, clock.sequence.lost
    end = now() + seconds
    while now() < end:
        survey.readings += board.wait(_PATIENCE, now)
    survey.boots = clock.resets - boots
    survey.lost = clock.sequence.lost - (0 if survey.boots else lost)
    survey.broken = _broken(counters) - broken
    if survey.readings and not survey.boots:
        first, last = survey.readings[0].sample, survey.readings[-1].sample
        survey.dropped = (last.drops - first.drops) % (1 << 16)


def _broken(counters: Counters) -> int:
    return counters.crc_errors + counters.cobs_errors + counters.oversize + counters.noise
