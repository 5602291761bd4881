"""Records antenna readings with known bends, as the rows of a file that can be calibrated.

Every line is whole when it is written. Time is the board's own, and goes on if the board restarts.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import TypeAlias

from antennate.errors import BadInputError
from antennate.hardware.esp32.board import Board
from antennate.hardware.esp32.clock import Timed
from antennate.messages import typed
from antennate.params.bench import RecordParams
from antennate.params.hardware import DoctorParams, NetworkParams

Ask: TypeAlias = Callable[[str], Callable[[], bool]]
"""Tells a person what to do; the function it returns says whether that has been confirmed."""

SILENCE = DoctorParams().greeting
"""Time without a reading after which a recording ends; a board greets within it [s]."""
_PATIENCE = 0.02
_MICROSECOND = 1e-6
"""What the board counts; sums of its times are no rounder [s]."""


class RecordConfig(RecordParams):
    """What is recorded, and how the board is reached."""

    network: NetworkParams = NetworkParams()


class Recorder:
    """Rows of one recording.

    Args:
        board: The board; `now` is monotonic time [s].
        params: What to record.
        ask: Asks for a mark or a push.
        write: Takes each line of the file, without its line break.
        on_reading: Called with every reading, recorded or not.

    Attributes:
        rows: Readings written.
    """

    def __init__(
        self,
        board: Board,
        params: RecordParams,
        now: Callable[[], float],
        ask: Ask,
        write: Callable[[str], None],
        on_reading: Callable[[Timed], None] = lambda reading: None,
    ) -> None:
        self.rows = 0
        self._board, self._params, self._now = board, params, now
        self._ask, self._write, self._on_reading = ask, write, on_reading
        self._last: tuple[Timed, float] | None = None

    def run(self) -> None:
        """Write the header, then all rows.

        Raises:
            BadInputError: The board is silent.
            PortError: Its port is gone.
        """
        for _ in self._readings():  # it has to be there before anybody is asked for anything
            break
        if self._params.marks:
            self._marks()
        elif self._params.speed is not None:
            self._pushes(self._params.speed)
        else:
            self._free()

    def _marks(self) -> None:
        self._write("trial,time,counts,bend")
        params = self._params
        for number in range(params.passes):
            for mark in params.marks if number % 2 == 0 else params.marks[::-1]:
                where = "" if params.unit == "1" else f" {params.unit}"
                self._wait(f"pass {number + 1} of {params.passes}: hold at {mark:g}{where}, Enter")
                for reading, t in self._for(params.hold):  # a trial is there and back
                    self._row(f"{number // 2},{t:.6f},{self._counts(reading)},{mark!r}")

    def _pushes(self, speed: float) -> None:
        self._write("trial,speed_m_s,time,counts,bend")
        params = self._params
        for trial in range(params.passes):
            self._wait(f"push {trial + 1} of {params.passes}: Enter as the stage starts")
            start = math.nan
            for reading, t in self._for(params.length / speed):
                start = t if math.isnan(start) else start
                way = speed * (t - start)
                self._row(f"{trial},{speed!r},{t:.6f},{self._counts(reading)},{way:.6f}")

    def _free(self) -> None:
        self._write("time,left,right")
        for reading, t in self._for(self._params.duration or math.inf):
            sample = reading.sample
            self._row(f"{t:.6f},{sample.left},{sample.right}")

    def _row(self, line: str) -> None:
        self._write(line)
        self.rows += 1

    def _counts(self, reading: Timed) -> int:
        sample = reading.sample
        return sample.left if self._params.side == "left" else sample.right

    def _wait(self, text: str) -> None:
        """Let readings pass until a person has confirmed."""
        confirmed = self._ask(text)
        for _ in self._readings():
            if confirmed():
                return

    def _for(self, seconds: float) -> Iterator[tuple[Timed, float]]:
        """Readings of the next so many seconds of the board."""
        begin = math.nan
        for reading, t in self._readings():
            begin = t if math.isnan(begin) else begin
            if t - begin > seconds - _MICROSECOND:
                return
            yield reading, t

    def _readings(self) -> Iterator[tuple[Timed, float]]:
        """All readings from now on, each with its time since the first of all [s]."""
        newest = self._now()
        while True:
            for reading in self._board.wait(_PATIENCE, self._now):
                newest = reading.arrived
                self._last = (reading, self._time(reading))
                self._on_reading(reading)
                yield self._last
            if self._now() - newest > SILENCE:
                raise BadInputError(self._silent())

    def _time(self, reading: Timed) -> float:
        if self._last is None:
            return 0.0
        last, t = self._last
        if reading.epoch != last.epoch:
            return t + max(reading.arrived - last.arrived, 1e-6)
        return t + 1e-6 * (reading.elapsed_us - last.elapsed_us)

    def _silent(self) -> str:
        came = self._board.decoder.counters
        why = f"{came.received} bytes and {came.good} frames in all"
        why = self._board.refusals[-1] if self._board.refusals else why
        return (
            f"--esp32: expected readings of an antenna board, found none for {SILENCE:g} s "
            f"({why}); run `{typed('doctor', '--esp32', 'PORT')}`"
        )
