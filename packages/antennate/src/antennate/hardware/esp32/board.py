"""The antenna board behind its port: bytes in, its usable samples out, never another board's."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from antennate.errors import reason
from antennate.hardware.esp32.clock import DeviceClock, SampleState, Timed
from antennate.hardware.esp32.frame import (
    FLAG_LATE,
    IMU_NONE,
    SAMPLE_FRAME_SIZE,
    encode_request,
)
from antennate.hardware.esp32.wire import FrameDecoder, Hello, Sample, objections
from antennate.types import Clock, Floats
from dynamixel_bus.port import Port, PortError

BOARD_BAUD = 115_200
"""Bits per second of the board's port: MicroPython on an ESP32, UART 0."""
KEPT = 64 * SAMPLE_FRAME_SIZE
"""Most bytes of a backlog that are looked at: 0.64 s; what is older is not acted upon (assumed)."""
CHUNK = 4096
"""Most bytes that are read from a port at once."""
_REFUSALS = 8
_CHUNKS = 64
"""Most chunks read at once: more than Linux keeps for a line."""


class Board:
    """Reads what has come from a board, always the one that greeted first.

    A loop that never waits calls `poll`, and a port that is gone is merely silent there; `wait` is
    for measuring, which needs every sample.

    Args:
        port: Its wire.
        age_limit: Readings older than this are not to be acted upon [s]; not used by `wait`.

    Attributes:
        decoder: With the counters of its bytes.
        clock: With the states on its samples.
        hello: The newest greeting, None before the first; of a board that is refused no sample is
            ever used.
        refusals: Why boards or frames were refused: each reason once, newest last, at most 8.
        skipped: Bytes of backlogs that were not looked at.
        overdue: Usable samples that the board took too late, by its own word (FLAG_LATE).
        trouble: What is wrong with its port, empty if nothing is.
    """

    def __init__(self, port: Port, age_limit: float = math.inf) -> None:
        self.decoder = FrameDecoder()
        self.clock = DeviceClock()
        self.hello: Hello | None = None
        self.refusals: list[str] = []
        self._first: Hello | None = None
        self.skipped = self.overdue = 0
        self.trouble = ""
        self._port = port
        self._limit = age_limit
        self._lost_before = 0

    @property
    def lost(self) -> int:
        """Samples that never came since `count_anew`; 0 at least, though some may come late."""
        return max(0, self.clock.lost - self._lost_before)

    def count_anew(self, clock: Callable[[], float]) -> None:
        """Forget what was lost so far, as while servos were looked for and nobody read."""
        self.poll(clock)
        self._lost_before = self.clock.lost

    def poll(self, clock: Callable[[], float]) -> int:
        """Take the newest of what has come; how many usable samples that were.

        The clock [s] is read after the port. Were it read before, and the program held up between
        the two, samples would seem to come before they did, and all later ones to be old.
        """
        came = self._read()
        return len(self._take(came, clock()))

    def wait(self, timeout: float, clock: Callable[[], float]) -> list[Timed]:
        """Usable samples that have come, or come within `timeout` [s] of `clock`."""
        data = self._port.read(CHUNK, timeout)
        return self._take(data, clock())

    def _read(self) -> bytes:
        """What has come, of a backlog the end; a board that is back is asked to greet."""
        came = b""
        try:
            for _ in range(_CHUNKS):
                part = self._port.read(CHUNK, 0.0)
                if self.trouble:
                    self._port.write(encode_request())
                    self.trouble = ""
                if not part:
                    break
                came += part
                self.skipped += max(len(came) - KEPT, 0)
                came = came[-KEPT:]
        except PortError as error:
            self.trouble = reason(error)
        return came

    def newest(self, now: float) -> Timed | None:
        """The newest usable sample, or None if it is too old or its age is not known."""
        return self.clock.newest if self.clock.age(now) <= self._limit else None

    def _take(self, data: bytes, now: float) -> list[Timed]:
        """Usable samples in bytes that have come by now [s]."""
        used: list[Timed] = []
        for frame in self.decoder.feed(data):
            if isinstance(frame, Hello):
                self._greet(frame)
            elif not isinstance(frame, Sample):
                self._refuse(frame.reason)
            elif self.clock.take(frame, now) is SampleState.USED and self.clock.newest is not None:
                used.append(self.clock.newest)
                self.overdue += bool(frame.flags & FLAG_LATE)
        return used

    def _greet(self, hello: Hello) -> None:
        self.hello = hello
        if reasons := self._objections(hello):
            self._refuse(*reasons)
            return
        self._first = self._first or hello
        self.clock.greet(hello)

    def _refuse(self, *reasons: str) -> None:
        others = [reason for reason in self.refusals if reason not in reasons]
        self.refusals = [*others, *reasons][-_REFUSALS:]

    def _objections(self, hello: Hello) -> tuple[str, ...]:
        """What speaks against a board, also that it is not the one that greeted first."""
        first = self._first
        if first is None:
            return objections(hello)
        if hello.device_id != first.device_id:
            return (
                f"expected the board {first.device_id} that greeted first, found another one, "
                f"{hello.device_id}; begin anew with it",
            )
        return objections(hello, first.config_hash)


def imu_counts(readings: Sequence[int]) -> Floats:
    """Readings of an inertial sensor as a sample has them [counts], NaN for none, shape (6,)."""
    counts = np.array(readings or (IMU_NONE,) * 6, float)
    counts[counts == IMU_NONE] = math.nan
    return counts


class BoardReader:
    """Readings of a board for a loop, on the board's own time.

    So a delay on the way to the host, or a busy host, does not change it. It never goes back.

    Args:
        board: The board.
        clock: The host's time, which never steps.

    Attributes:
        used: Usable samples that the last reading found.
        refused: Samples it found that may not be used.
        imu: Readings of the inertial sensor [counts] in the same sample, gyroscopes first,
            shape (6,), NaN where it did not answer; None where the sample is missing or too old.
        misses: Readings that the sensor has not given since the board began, modulo 65536, as the
            newest sample says.
    """

    def __init__(self, board: Board, clock: Clock) -> None:
        self._board, self._clock = board, clock
        self.used = self.refused = 0
        self.imu: Floats | None = None
        self.misses = 0
        self._stamp: Timed | None = None
        self._stamp_now: float | None = None
        self._stamp_t = self._t = 0.0

    def read(self) -> tuple[float, Floats]:
        """The newest reading: its time [s], and both antennae as they came [counts], shape (1, 2).

        A reading that is missing or too old is NaN.
        """
        states = self._board.clock.states
        before = sum(states.values())
        self.used = self._board.poll(self._clock.now)
        now = self._clock.now()
        self.refused = sum(states.values()) - before - self.used
        timed = self._board.newest(now)
        self._t = max(self._t, self._time(timed, now))
        self.imu = None if timed is None else imu_counts(timed.sample.imu)
        if timed is None:
            return self._t, np.full((1, 2), math.nan)
        self.misses = timed.sample.misses
        return self._t, np.array([[timed.sample.left, timed.sample.right]], float)

    def _time(self, timed: Timed | None, now: float) -> float:
        """The board's time [s]; the host's clock where the board has none or restarts."""
        last = self._stamp
        if self._stamp_now is None:
            self._stamp_now = now
        since = now - self._stamp_now
        if timed is None:
            return self._stamp_t + since
        if last is None or timed.epoch != last.epoch:
            self._stamp_t += since
            self._stamp, self._stamp_now = timed, now
            return self._stamp_t
        return self._stamp_t + 1e-6 * (timed.elapsed_us - last.elapsed_us)
