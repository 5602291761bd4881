"""Recordings of the antenna board: readings with known bends, and recorded streams of bytes.

`Recorder` writes rows that can be calibrated: every line is whole when it is written; time is the
board's own, and goes on if the board restarts.

`read_esp32` reads a stream as arrays. Nobody has to say when its bytes arrived. The board counts
microseconds modulo 2**tick_bits; how often this counter wrapped between two samples follows from
their sequence numbers and the rate that the board declared in its HELLO.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from antennate import checks
from antennate.errors import BadInputError
from antennate.files import read_limited
from antennate.hardware.esp32.board import Board, imu_counts
from antennate.hardware.esp32.clock import Timed
from antennate.hardware.esp32.frame import FLAG_LEFT_RAIL, FLAG_RIGHT_RAIL, IMU_NONE
from antennate.hardware.esp32.wire import Counters, FrameDecoder, Hello, Sample
from antennate.messages import typed
from antennate.params.hardware import DoctorParams, RecordParams
from antennate.types import Bools, Floats, Ints

Ask: TypeAlias = Callable[[str], Callable[[], bool]]
"""Tells a person what to do; the function it returns says whether that has been confirmed."""

IMU_COLUMNS = ("gyro_x", "gyro_y", "gyro_z", "accel_x", "accel_y", "accel_z")
"""Readings of an inertial sensor along the axes of the head [counts]; empty where it was silent."""
SILENCE = DoctorParams().greeting
"""Time without a reading after which a recording ends; a board greets within it [s]."""
_PATIENCE = 0.02
_MICROSECOND = 1e-6
"""What the board counts; sums of its times are no rounder [s]."""


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
        """Write the header, then all rows."""
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
        moves = self._last is not None and bool(self._last[0].sample.imu)
        self._write(",".join(["time,left,right", *(IMU_COLUMNS if moves else ())]))
        for reading, t in self._for(self._params.duration or math.inf):
            sample = reading.sample
            felt = sample.imu or (IMU_NONE,) * len(IMU_COLUMNS)
            more = ["" if n == IMU_NONE else str(n) for n in felt] if moves else []
            self._row(",".join([f"{t:.6f},{sample.left},{sample.right}", *more]))

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


_LARGEST = 1 << 30
"""Bytes of a recording that is read: four days at 100 Hz."""


@dataclass(frozen=True, slots=True, repr=False)
class Esp32Recording:
    """Samples of both antennae in the order in which each boot of the board took them.

    Attributes:
        t: Time since the first sample of the same boot [s], by the board's clock, shape (n,).
        boot: Which boot of the board: 0, 1, … in order of arrival, shape (n,). Times of two boots
            have no common origin.
        seq: Number of the sample since that boot, unwrapped, shape (n,); gaps are lost samples.
        counts: Readings, left before right [counts], 0 to 4095, shape (n, 2).
        rail: Whether the reading is at 0 or full scale, as of a broken or shorted wire,
            shape (n, 2).
        hellos: The first HELLO of each boot: firmware, rate [Hz], serial number, cause of reset.
        counters: What became of every byte: good frames, CRC errors, noise, text.
        unknown_boot: Samples left out because no HELLO of their boot was recorded.
        unordered: Samples left out because the board's time did not rise from the one before.
        imu: Readings of the inertial sensor [counts], gyroscopes first, NaN where it was silent,
            shape (n, 6), or (n, 0) of a board without one.
    """

    t: Floats
    boot: Ints
    seq: Ints
    counts: Floats
    rail: Bools
    hellos: tuple[Hello, ...]
    counters: Counters
    unknown_boot: int
    unordered: int
    imu: Floats = field(default_factory=lambda: np.zeros((0, 0)))

    def __repr__(self) -> str:
        """The recording in one line."""
        boots, seconds = len(self.hellos), float(self.t.max())
        return (
            f"<Esp32Recording of {len(self.t)} samples, {seconds:.2f} s, boots: {boots}, "
            f"lost: {self.lost}>"
        )

    @property
    def lost(self) -> int:
        """Samples that are missing between the first and the last one of their boots."""
        spans = [np.ptp(self.seq[self.boot == b]) + 1 for b in np.unique(self.boot)]
        return int(sum(spans)) - len(self.seq)

    def to_dataframe(self) -> Any:
        """A pandas DataFrame: boot, seq, t [s], left, right [counts], left_rail, right_rail.

        With an inertial sensor also the columns of `IMU_COLUMNS` [counts].
        """
        from pandas import DataFrame  # slow to import

        return DataFrame(
            {
                "boot": self.boot,
                "seq": self.seq,
                "t": self.t,
                "left": self.counts[:, 0],
                "right": self.counts[:, 1],
                "left_rail": self.rail[:, 0],
                "right_rail": self.rail[:, 1],
                **(dict(zip(IMU_COLUMNS, self.imu.T, strict=True)) if self.imu.size else {}),
            }
        )


def read_esp32(source: str | Path | bytes | bytearray | memoryview) -> Esp32Recording:
    """Decode a recorded stream of the antenna board.

    Damaged frames are skipped and counted; duplicates are dropped; samples that arrived late are
    put back into their place.

    Args:
        source: A file of raw bytes as they came over USB or TCP, or the bytes themselves.

    Raises:
        BadInputError: It is neither a path nor bytes, the file cannot be read, or there is no
            usable sample in it.
    """
    decoder, hellos, samples, refused = FrameDecoder(), {}, {}, ""
    if isinstance(source, bytes | bytearray | memoryview):
        source = bytes(source)
        data = source
    else:
        data = read_limited(checks.path("source", source), _LARGEST)
    for frame in decoder.feed(data):
        if isinstance(frame, Hello):
            hellos.setdefault(frame.boot_id, frame)
        elif isinstance(frame, Sample):
            samples.setdefault(frame.boot_id, []).append(frame)
        else:
            refused = frame.reason
    known = [boot for boot in samples if boot in hellos]
    if not known:
        raise BadInputError(_empty(source, decoder.counters, len(hellos), len(samples), refused))
    parts = [_boot_arrays(samples[boot], hellos[boot]) for boot in known]
    t, seq, counts, flags = (np.concatenate([part[i] for part in parts]) for i in range(4))
    imu = np.concatenate([part[5] for part in parts])
    return Esp32Recording(
        t=t,
        boot=np.repeat(np.arange(len(parts)), [len(part[0]) for part in parts]),
        seq=seq,
        counts=counts,
        rail=(flags[:, None] & np.array([FLAG_LEFT_RAIL, FLAG_RIGHT_RAIL])) != 0,
        hellos=tuple(hellos[boot] for boot in known),
        counters=decoder.counters,
        unknown_boot=sum(len(samples[boot]) for boot in samples if boot not in hellos),
        unordered=sum(part[4] for part in parts),
        imu=imu if any(s.imu for boot in known for s in samples[boot]) else imu[:, :0],
    )


def _boot_arrays(
    samples: list[Sample], hello: Hello
) -> tuple[Floats, Ints, Floats, Ints, int, Floats]:
    """Times [s], numbers, counts and flags of one boot in order, and how many were unordered.

    Last, what its inertial sensor read [counts], NaN for nothing.
    """
    seq = np.array([sample.seq for sample in samples])
    ahead = (np.diff(seq, prepend=seq[0]) + (1 << 31)) % (1 << 32) - (1 << 31)
    number, first = np.unique(seq[0] + np.cumsum(ahead), return_index=True)
    ticks = np.array([samples[i].ticks for i in first])
    modulus, period = 1 << hello.tick_bits, 1e6 / hello.rate
    places = np.arange(len(number))
    while True:
        expected = period * np.diff(number[places])
        step = np.diff(ticks[places]) % modulus
        step = step + modulus * np.maximum(0, np.rint((expected - step) / modulus)).astype(int)
        bad = (step == 0) | (step - expected > modulus / 2)
        if not bad.any():
            break
        places = np.delete(places, 1 + int(np.argmax(bad)))
    chosen = [samples[i] for i in first[places]]
    counts = np.array([(s.left, s.right) for s in chosen], dtype=np.float64)
    flags = np.array([s.flags for s in chosen], dtype=np.int64)
    t = 1e-6 * np.concatenate([[0], np.cumsum(step)])
    imu = np.array([imu_counts(s.imu) for s in chosen])
    return t, number[places], counts, flags, len(number) - len(places), imu


def _empty(
    source: str | Path | bytes, counters: Counters, hellos: int, boots: int, refused: str
) -> str:
    where = f"{len(source)} bytes" if isinstance(source, bytes) else str(source)
    if boots and not hellos:
        why = f"{counters.good} samples but no HELLO, which says how the board counts time"
    elif boots:
        why = f"{counters.good} good frames, but no HELLO of the boot that the samples belong to"
    else:
        damaged = counters.crc_errors + counters.cobs_errors
        why = f"{counters.received} bytes with {counters.good} good and {damaged} damaged frames"
    why += f" ({refused})" if refused else ""
    return f"{where}: expected samples of an antenna board, found {why}"
