"""The board's clock seen from the host: which samples may be used, and how old they are.

Nothing here reads a clock: the host's time [s] comes in as an argument, from one that never steps.

A frame cannot arrive before its sample was taken. The lowest difference ever seen between the
host's time and the board's is therefore the difference of the clocks plus the shortest delay; what
a frame exceeds it by is its age. Crystals drift, so the lowest difference may rise by DRIFT.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass
from enum import Enum, auto

from antennate.hardware.esp32.wire import Hello, Reset, Sample

DRIFT = 250e-6
"""Most by which two clocks run apart: crystals within 100 ppm each, and a margin (assumed)."""
SETTLE_SAMPLES = 10
"""Samples that a new lowest delay must last until ages are believed: 100 ms (assumed)."""
SETTLE_TIME = 0.05
"""Time that it must last likewise [s]: the age of stale data (assumed)."""
SETTLE_FALL = 0.005
"""How far the lowest delay may fall meanwhile [s]: half a period. A backlog that drains makes it
fall faster (assumed)."""
EARLY = 0.02
"""How much earlier than expected a sample may come [s], after a lie also later; two periods."""
RETIRED_BOOTS = 8
HIDDEN_WRAP = 0.5
"""Share of the span of the board's counter after which an outage may hide a wrap."""

_SEQ = 1 << 32
_WINDOW = 64
_WINDOW_MASK = (1 << _WINDOW) - 1


class SampleState(Enum):
    """What becomes of a sample; only USED ones may be acted upon."""

    USED = auto()
    DUPLICATE = auto()
    LATE = auto()
    OTHER_BOOT = auto()
    OVERRANGE = auto()
    FROZEN = auto()
    BACK = auto()
    AHEAD = auto()


class Sequence:
    """Unwraps 32-bit sequence numbers; tells new ones from late and doubled ones.

    Attributes:
        highest: The newest number, unwrapped, or None before the first.
        received: Different numbers received from the first on.
    """

    def __init__(self) -> None:
        self.highest: int | None = None
        self.received = 0
        self._first = 0
        self._seen = _WINDOW_MASK

    @property
    def number(self) -> int:
        """The newest number, 0 before the first."""
        return self.highest or 0

    @property
    def lost(self) -> int:
        """Numbers between the first and the newest that never came [samples]."""
        return 0 if self.highest is None else self.highest - self._first + 1 - self.received

    def place(self, seq: int) -> SampleState:
        """Where a number belongs: USED if it is newer than all before, else LATE or DUPLICATE."""
        if self.highest is None:
            self.highest = self._first = seq
            self.received = 1
            return SampleState.USED
        ahead = (seq - self.highest) % _SEQ
        if 0 < ahead < _SEQ // 2:
            self.highest += ahead
            self.received += 1
            self._seen = (self._seen << ahead) & _WINDOW_MASK if ahead < _WINDOW else 0
            self._seen |= 1
            return SampleState.USED
        behind = -ahead % _SEQ
        if behind < _WINDOW and not self._seen >> behind & 1:
            self._seen |= 1 << behind
            self.received += 1
            return SampleState.LATE
        return SampleState.DUPLICATE if behind < _WINDOW else SampleState.LATE


@dataclass(frozen=True, slots=True)
class Timed:
    """A sample that may be used.

    Attributes:
        epoch: Rises with every new time base; never mix samples of two epochs.
        seq: Its number, unwrapped.
        elapsed_us: The board's time since the epoch began [us], unwrapped.
        t: Host's time at which it was taken [s], as known when it arrived.
        arrived: Host's time at which it arrived [s].
    """

    sample: Sample
    epoch: int
    seq: int
    elapsed_us: int
    t: float
    arrived: float


class DeviceClock:
    """Classifies samples by boot, number and the board's time.

    Attributes:
        states: How many samples got which state.
        resets: Boots after the first.
        last_reset: Why the present boot began, None before the first HELLO.
        epoch: Time bases begun.
        newest: The newest usable sample, None before the first of a boot.
        sequence: Numbers of the present boot.
    """

    def __init__(self) -> None:
        self.states = dict.fromkeys(SampleState, 0)
        self.resets = 0
        self.last_reset: Reset | None = None
        self.epoch = 0
        self.newest: Timed | None = None
        self.sequence = Sequence()
        self._lost_before = 0
        self._boot: int | None = None
        self._retired: deque[int] = deque(maxlen=RETIRED_BOOTS)
        self._modulus = 0
        self._period = self._arrived = self._floor = 0.0
        self._settled = False
        self._calm = (0.0, 0.0, 0)
        self._suspect: tuple[int, int] = (0, 0)
        self._suspects = 0

    def greet(self, hello: Hello) -> bool:
        """Take a HELLO; True if a boot begins with it. One of an earlier boot is ignored."""
        if hello.boot_id == self._boot or hello.boot_id in self._retired:
            return False
        if self._boot is not None:
            self._retired.append(self._boot)
            self.resets += 1
        self._boot = hello.boot_id
        self.last_reset = hello.reset
        self._modulus = 1 << hello.tick_bits
        self._period = 1e6 / hello.rate
        self.newest = None
        self._lost_before += self.sequence.lost
        self.sequence = Sequence()
        self._suspects = 0
        return True

    @property
    def lost(self) -> int:
        """Samples of all boots that never came; a late one lowers it again."""
        return self._lost_before + self.sequence.lost

    def take(self, sample: Sample, now: float) -> SampleState:
        """Classify a sample that arrived at host's time now [s]; a USED one becomes `newest`."""
        state = self._state_of(sample, now)
        self.states[state] += 1
        return state

    def age(self, now: float) -> float:
        """Time since the newest usable sample was taken [s]; inf if that is not known."""
        newest = self.newest
        if newest is None or not self._settled:
            return math.inf
        return max(0.0, now - self._floor - 1e-6 * newest.elapsed_us)

    def _state_of(self, sample: Sample, now: float) -> SampleState:
        if sample.boot_id != self._boot:
            return SampleState.OTHER_BOOT
        if sample.ticks >= self._modulus:
            return SampleState.OVERRANGE
        place = self.sequence.place(sample.seq)
        if place is not SampleState.USED:
            return place
        newest = self.newest
        if newest is None or now - self._arrived >= HIDDEN_WRAP * 1e-6 * self._modulus:
            self._rebase(sample, now)
            return SampleState.USED
        step = (sample.ticks - newest.sample.ticks) % self._modulus
        state = self._state_by_time(newest, step, now)
        if state is SampleState.USED:
            self._follow(sample, newest.elapsed_us + step, step, now)
        elif self._consistent(sample):
            self._rebase(sample, now)
            return SampleState.USED
        return state

    def _state_by_time(self, newest: Timed, step: int, now: float) -> SampleState:
        if step == 0:
            return SampleState.FROZEN
        if step >= self._modulus // 2:
            return SampleState.BACK
        late = now - 1e-6 * (newest.elapsed_us + step) - self._floor
        if self._suspects and late > EARLY + DRIFT * 1e-6 * step:
            return SampleState.BACK
        impossible = late < -EARLY - DRIFT * 1e-6 * step
        numbers = self.sequence.number - newest.seq
        return (
            SampleState.AHEAD
            if impossible and step > self._longest_step(numbers)
            else SampleState.USED
        )

    def _longest_step(self, numbers: int) -> float:
        """Most the board's time should move over some samples [us]."""
        return 1.5 * self._period * numbers + 1e5

    def _consistent(self, sample: Sample) -> bool:
        """Whether enough suspect samples in a row agree among themselves on a new time."""
        number = self.sequence.number
        ticks, before = self._suspect
        step = (sample.ticks - ticks) % self._modulus
        agrees = self._suspects and 0 < step < self._longest_step(number - before)
        self._suspects = self._suspects + 1 if agrees else 1
        self._suspect = (sample.ticks, number)
        return self._suspects >= SETTLE_SAMPLES

    def _rebase(self, sample: Sample, now: float) -> None:
        """Begin a new time base with a sample of unknown age."""
        self.epoch += 1
        self._floor = now
        self._settled = False
        self._calm = (now, now, 0)
        self._follow(sample, 0, 0, now)

    def _follow(self, sample: Sample, elapsed_us: int, step: int, now: float) -> None:
        difference = now - 1e-6 * elapsed_us
        self._floor = min(difference, self._floor + DRIFT * 1e-6 * step)
        self._arrived = now
        if not self._settled:
            self._settle(now)
        self._suspects = 0
        t = self._floor + 1e-6 * elapsed_us
        self.newest = Timed(sample, self.epoch, self.sequence.number, elapsed_us, t, now)

    def _settle(self, now: float) -> None:
        """Believe ages once the lowest difference has stopped falling."""
        since, floor, samples = self._calm
        if self._floor < floor - SETTLE_FALL:
            since, floor, samples = now, self._floor, 0
        self._calm = (since, floor, samples + 1)
        self._settled = samples + 1 >= SETTLE_SAMPLES and now - since >= SETTLE_TIME
