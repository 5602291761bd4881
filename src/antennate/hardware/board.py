"""The antenna board behind its port: bytes in, the newest trustworthy reading out."""

from __future__ import annotations

import math

import numpy as np

from antennate.hardware.esp32.clock import DeviceClock, Timed, Verdict
from antennate.hardware.esp32.decoder import FrameDecoder
from antennate.hardware.esp32.frame import FLAG_LEFT_RAIL, FLAG_RIGHT_RAIL
from antennate.hardware.esp32.wire import Hello, Refused, Sample, objections
from antennate.hardware.port import Port
from antennate.records import Floats

BOARD_BAUD = 115_200
"""Bits per second of the board's port."""
_CHUNK = 4096
_RAILS = (FLAG_LEFT_RAIL, FLAG_RIGHT_RAIL)


class Board:
    """Reads one antenna board.

    Args:
        port: Its wire.
        age_limit: Readings older than this are not to be acted upon [s].

    Attributes:
        decoder: With the counters of its bytes.
        clock: With the verdicts on its samples.
        hello: The newest greeting, None before the first.
        refusals: Why a board or its frames were refused, newest last, at most 8.
    """

    def __init__(self, port: Port, age_limit: float) -> None:
        self.decoder = FrameDecoder()
        self.clock = DeviceClock()
        self.hello: Hello | None = None
        self.refusals: list[str] = []
        self._port = port
        self._limit = age_limit

    def poll(self, now: float) -> int:
        """Take what has come by now [s]; how many usable samples that were."""
        used = 0
        while data := self._port.read(_CHUNK, 0.0):
            for frame in self.decoder.feed(data):
                used += self._take(frame, now)
        return used

    def newest(self, now: float) -> Timed | None:
        """The newest usable sample, or None if it is too old or its age is not known."""
        return self.clock.newest if self.clock.age(now) <= self._limit else None

    def _take(self, frame: Hello | Sample | Refused, now: float) -> bool:
        if isinstance(frame, Sample):
            return self.clock.take(frame, now) is Verdict.USED
        reasons = (frame.reason,) if isinstance(frame, Refused) else objections(frame)
        if isinstance(frame, Hello) and not reasons:
            self.clock.greet(frame)
            self.hello = frame
        self.refusals = [*self.refusals, *reasons][-8:]
        return False


def counts_of(timed: Timed | None) -> Floats:
    """Readings of a sample [counts], shape (1, 2); NaN where there is none or it is at a rail."""
    if timed is None:
        return np.full((1, 2), math.nan)
    sample = timed.sample
    read = (sample.left, sample.right)
    return np.array(
        [[math.nan if sample.flags & f else float(c) for c, f in zip(read, _RAILS, strict=True)]]
    )
