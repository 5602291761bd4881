"""A day of an antenna board, faults and all, in invented time, before decoder, clock and ladder."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from esp32_streams import hello
from hardware_rig import BAND, BENT, FREE, LIMIT, PERIOD, healthy

from antennate.hardware.esp32 import frame
from antennate.hardware.esp32.board import Board, BoardReader
from antennate.hardware.safety.causes import Cause
from antennate.hardware.safety.channel import ChannelDiagnosis
from antennate.hardware.safety.supervisor import Outputs, Supervisor
from antennate.params.safety import SupervisorParams
from antennate.types import Contact, State

DRIFT = 50e-6
"""The board's clock against the host's, [s/s]: ages at the ticks take every value in a day."""
SHORTEST = 0.001
"""Shortest way of a frame to the host [s], which nobody can see."""
LOSS = 0.01
"""Share of frames lost or damaged on the way."""
SEEN = {
    "reset": {Cause.STALE, Cause.REBOOT},
    "unplug": {Cause.STALE},
    "stall": {Cause.STALE},
    "wire": {Cause.OPEN, Cause.LOST},
    "servo": {Cause.SILENT_SERVO},
}
"""Causes that a fault brings about; at least one must be in force while it lasts."""
NO_DATA = {Cause.STALE, Cause.LOST, Cause.OPEN}
"""What is said while no sample comes: a channel without readings also counts as open."""
AFTER = 1.0
"""Time after the end of a fault in which it still explains a hold [s]."""


@dataclass(slots=True)
class Event:
    """One injected fault: what, from when to when [s], and whether its cause was named."""

    what: str
    begin: float
    end: float
    seen: bool = False


def schedule(rng: np.random.Generator, hours: int, hour: float, apart: float) -> list[Event]:
    """Faults at realistic rates: each kind once an hour, unplugged every second one."""
    shortest = {"reset": 0.3, "unplug": 1.0, "stall": 0.2, "wire": 1.0, "servo": 0.2}
    events = []
    for number in range(hours):
        kinds = [kind for kind in SEEN if kind != "unplug" or number % 2 == 0]
        slots = rng.permutation(np.linspace(apart, hour - apart, len(kinds)))
        for kind, slot in zip(kinds, slots.tolist(), strict=True):
            begin = number * hour + slot + rng.uniform(0, 0.2 * apart)
            longest = min(30.0 if kind == "unplug" else 3.0, 0.3 * apart)
            events.append(Event(kind, begin, begin + rng.uniform(shortest[kind], longest)))
    return sorted(events, key=lambda event: event.begin)


def readings(rng: np.random.Generator) -> list[list[float]]:
    """A minute of both films: free, and bent for 2 s of every 10, with noise."""
    t = np.arange(6000) * PERIOD
    bend = np.clip(np.minimum(t % 10 - 4, 7 - t % 10), 0, 1)
    levels = FREE + (BENT - FREE) * np.stack([bend, np.roll(bend, 500)], axis=1)
    return np.rint(levels + rng.normal(0, 2.5, (6000, 2))).tolist()


class Source:
    """The board and its wire, as a Port: what has reached the host."""

    def __init__(self, rng: np.random.Generator) -> None:
        self._rng = rng
        self._films = readings(rng)
        self._luck: Iterator[tuple[float, int]] = iter(())
        self.came = b""
        self.held: list[bytes] = []
        self.taken: dict[int, float] = {}
        self.boot = 0
        self.restart(0.0, frame.RESET_POWER_ON)

    def restart(self, t: float, reason: int = frame.RESET_WATCHDOG) -> None:
        """A new boot, which greets."""
        self.boot += 1
        self._start, self._seq = t, 0
        self._encoder = frame.SampleEncoder(self.boot)
        self.came += hello(self.boot, reset=reason)

    def sample(self, t: float, floating: bool) -> bytes:
        """The frame of a sample taken at t [s], perhaps lost or damaged."""
        left, right = self._films[self._seq % 6000]
        if floating:
            left = float(self._rng.integers(0, 4096))
        ticks = round((t - self._start) * (1 + DRIFT) * 1e6) & frame.TICK_MASK
        buffer = bytearray(frame.SAMPLE_FRAME_SIZE)
        self._encoder.encode_sample_into(buffer, self._seq, ticks, int(left), int(right), 0, 0)
        self.taken[self._seq] = t
        self.taken.pop(self._seq - 500, None)
        self._seq += 1
        luck, place = self._chance()
        if luck < LOSS / 2:
            return b""
        if luck < LOSS:
            buffer[place % len(buffer)] ^= 1 + place % 255
        return bytes(buffer)

    def _chance(self) -> tuple[float, int]:
        for pair in self._luck:
            return pair
        luck, place = self._rng.random(10_000), self._rng.integers(0, 10_000, 10_000)
        self._luck = iter(list(zip(luck.tolist(), place.tolist(), strict=True)))
        return next(self._luck)

    def read(self, most: int, timeout: float) -> bytes:
        """What has come."""
        part, self.came = self.came[:most], self.came[most:]
        return part

    def write(self, data: bytes) -> None:
        """The board does not listen."""

    def drain(self) -> int:
        """Nobody asks for that here."""
        return 0


class Now:
    """The host's clock."""

    t = 0.0

    def now(self) -> float:
        return self.t


class Soak:
    """Ticks of a robot that walks, with faults; every invariant is checked in every tick."""

    def __init__(self, events: list[Event], seed: int = 0) -> None:
        self._rng = np.random.default_rng(seed)
        self._source = Source(self._rng)
        self._clock = Now()
        self._board = Board(self._source, SupervisorParams().stale_age)
        self._reader = BoardReader(self._board, self._clock)
        self._films = [ChannelDiagnosis(BAND) for _ in range(2)]
        self._supervisor = Supervisor(SupervisorParams())
        self._events = events
        self._next = 0
        self._event: Event | None = None
        self._explained = AFTER
        self._possible: set[Cause] = set()
        self._missed = 0
        self._out: Outputs | None = None
        self._due = SHORTEST
        self._n = self._well = 0
        self.oldest = 0.0
        self.holds = self.moves = 0

    def run(self, until: float) -> None:
        """Go on until this time [s]."""
        while self._n * PERIOD < until:
            self._n += 1
            self._tick(self._n * PERIOD)

    def _tick(self, now: float) -> None:
        self._begin_and_end(now)
        self._send(now)
        self._clock.t = now
        clock = self._board.clock
        t, counts = self._reader.read()
        sides = zip(self._films, counts[0].tolist(), strict=True)
        said = [film.step(t, c).counts for film, c in sides]
        clear = self._out is not None and self._out.clear
        contact = [Contact.FREE if clear and c == c else Contact.UNKNOWN for c in said]
        self._out = self._supervisor.step(
            now,
            healthy(
                now,
                age=clock.age(now),
                valid=self._reader.used,
                refused=self._reader.refused,
                findings=(self._films[0].reading.finding, self._films[1].reading.finding),
                noise=(self._films[0].noise_text, self._films[1].noise_text),
                contact=(contact[0], contact[1]),
                resets=clock.resets,
                missed={7: self._missed} if self._missed else {},
                arm=self._wants_arming(now),
            ),
        )
        self._check(now, self._out)

    def _wants_arming(self, now: float) -> bool:
        out = self._out
        down = out is not None and out.state >= State.FAULT and self._event is None
        self._well = self._well + 1 if down else 0
        return self._well % 200 == 100

    def _begin_and_end(self, now: float) -> None:
        event = self._event
        if event is not None and now >= event.end:
            assert event.seen, event
            if event.what == "reset":
                self._source.restart(now)
            self._source.came += b"".join(self._source.held)
            self._source.held.clear()
            self._explained, self._event, self._missed = now + AFTER, None, 0
        if self._next < len(self._events) and now >= self._events[self._next].begin:
            event = self._event = self._events[self._next]
            self._next += 1
            self._possible = SEEN[event.what]
            if event.what in ("reset", "unplug"):
                self._source.came += b"\x11\x02half a frame"
        if event is not None and event.what == "servo" and self._event is event:
            self._missed += 1

    def _send(self, now: float) -> None:
        """All that reaches the host by now; the board's period is not quite the host's."""
        what = self._event.what if self._event else ""
        while self._due <= now:
            taken = self._due - SHORTEST
            self._due += PERIOD / (1 + DRIFT)
            if what == "reset":
                continue
            wire = self._source.sample(taken, what == "wire")
            if what == "stall":
                self._source.held.append(wire)
            elif what != "unplug":
                self._source.came += wire

    def _check(self, now: float, out: Outputs) -> None:
        causes = {active.cause for active in out.causes}
        if out.move:
            newest = self._board.clock.newest
            assert newest is not None
            assert newest.sample.boot_id == self._source.boot
            assert self._board.clock.age(now) <= LIMIT
            age = now - self._source.taken[newest.sample.seq]
            self.oldest = max(self.oldest, age)
            self.moves += 1
        if self._event is not None and causes & SEEN[self._event.what]:
            self._event.seen = True
        severe = {c for c in causes if c.severity >= State.HOLD} - {Cause.UNKNOWN_CONTACT}
        if severe:
            self.holds += 1
            if self._event is None and now > self._explained:
                # a fault that an arm event has to end stays until it comes
                assert severe <= {Cause.SILENT_SERVO, Cause.NOT_ARMED}, (now, causes)
            else:
                allowed = self._possible | NO_DATA | {Cause.NOT_ARMED}
                assert severe <= allowed, (now, causes, self._event)

    @property
    def seen(self) -> int:
        """Faults whose cause was named."""
        return sum(event.seen for event in self._events)

    @property
    def share_of_motion(self) -> float:
        """Share of ticks in which a command was sent."""
        return self.moves / max(1, self._n)

    @property
    def memory(self) -> int:
        """Bytes of this process that are in memory."""
        with open("/proc/self/statm", encoding="ascii") as table:  # noqa: PTH123
            return 4096 * int(table.read().split()[1])
