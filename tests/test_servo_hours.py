"""The servo bus for an hour, under four callers at once, and under a flood of hostile bytes."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Iterator

import numpy as np
import pytest
from hardware_rig import Ticker
from servo_rig import IDS, Rig, positions, servos

from antennate.hardware.dynamixel.actuators import ServoMonitor
from antennate.hardware.safety.causes import Cause
from antennate.types import State
from dynamixel_bus import packets
from dynamixel_bus.answers import POSITION, Value
from dynamixel_bus.bus import Bus
from dynamixel_bus.packets import LONGEST, Packet
from dynamixel_bus.parser import Parser
from dynamixel_bus.servo import Servo
from dynamixel_bus.servo_bus import ServoBus
from dynamixel_bus.simulated_wire import SimulatedWire

GOAL = 116


class Standing(Servo):
    """A servo that stays where it is put, which costs no time."""

    def advance(self, t: float) -> None:
        """Nothing moves."""


def standing() -> list[Servo]:
    made: list[Servo] = []
    for servo in servos():
        still = Standing(servo.model, servo.get("id"), servo.position)
        still.set("return_delay_time", 0)
        made.append(still)
    return made


def hold_up(cycles: int, loss: float) -> tuple[int, int]:
    """Walk with answers that get lost; longest run of misses of a servo, and answers missed.

    A cycle is that of a session: goals, all positions, a watchdog and now and then the supply.
    """
    rig = Rig()
    rig.twin.servos = standing()
    rig.twin.loss = loss
    watch, ticker = ServoMonitor(rig.bus, tuple(IDS), rig.link.now), Ticker()
    goals = {i: (100 * i).to_bytes(4, "little") for i in IDS}
    worst = 0
    for n in range(cycles):
        begin = rig.link.now()
        if n > 20:
            rig.bus.write_all(GOAL, goals)
        watch.step()
        assert watch.positions.items() <= {i: 100 * i for i in IDS}.items()
        worst = max(worst, *watch.missed.values())
        out = ticker.step(missed=watch.missed, bus_error=watch.bus_error, arm=n == 20)
        assert n < 20 or out.state <= State.DEGRADED, (n, [a.text for a in out.causes])
        assert {a.cause for a in out.causes} <= {Cause.LATE_ANSWERS, Cause.NOT_ARMED, Cause.STALE}
        rig.link.sleep(max(begin + 0.01 - rig.link.now(), 0.0))
    return worst, rig.bus.tally.misses


@pytest.mark.ci
def test_B2_a_lost_answer_in_a_hundred_never_holds_the_robot() -> None:
    worst, misses = hold_up(1000, 0.01)
    assert worst <= 3
    assert misses > 100


@pytest.mark.slow
def test_B2_an_hour_with_one_lost_answer_in_a_hundred_has_no_hold() -> None:
    worst, misses = hold_up(360_000, 0.01)
    sys.stdout.write(f"longest run of misses {worst}, answers missed {misses}\n")


class Strict(SimulatedWire):
    """A wire that counts requests sent while the answer to another one is on its way."""

    def __init__(self, bus: ServoBus) -> None:
        super().__init__(bus)
        self.interleaved = self.requests = 0

    def write(self, data: bytes) -> None:
        self.requests += 1
        self.interleaved += self.bus.next_time() is not None
        super().write(data)

    def read(self, most: int, timeout: float) -> bytes:
        time.sleep(0)  # let another thread have its chance in the middle of a request
        return super().read(most, timeout)


def hammer(requests: int, bus_type: type[Bus] = Bus) -> None:
    """Four threads read their own servos through one master; every answer is that of its servo."""
    link = Strict(ServoBus(standing()[:8]))
    bus = bus_type(link, clock=link.now)
    wrong: list[str] = []

    def call(mine: range) -> None:
        try:
            for n in range(requests // 4):
                servo = mine[n % len(mine)]
                said = bus.read(servo, POSITION)
                if said != Value((100 * servo).to_bytes(4, "little"), alert=False):
                    wrong.append(f"servo {servo}: {said}")
        except Exception as error:  # noqa: BLE001 anything that goes wrong in a thread is told
            wrong.append(repr(error))

    interval = sys.getswitchinterval()
    sys.setswitchinterval(1e-5)
    callers = [threading.Thread(target=call, args=(range(1 + 2 * k, 3 + 2 * k),)) for k in range(4)]
    for caller in callers:
        caller.start()
    for caller in callers:
        caller.join()
    sys.setswitchinterval(interval)
    assert wrong == []
    assert link.interleaved == 0
    assert link.requests == requests // 4 * 4


def test_B16_four_callers_of_one_master_never_interleave() -> None:
    hammer(2000)


@pytest.mark.slow
def test_B16_four_callers_never_interleave_in_100_000_requests() -> None:
    hammer(100_000)


def hostile(rng: np.random.Generator) -> Iterator[tuple[bytes, list[Packet]]]:
    """Pieces of about 1 MB and the packets in them: noise, damaged packets, storms of headers."""
    sent, wire = [], []
    for _ in range(2000):
        servo, size = int(rng.integers(1, 20)), int(rng.integers(0, 40))
        data = bytes(rng.choice([0xFF, 0xFD, 0x00, 0x55, 0xFE], size).tolist())
        sent.append(Packet(servo, 0x55, b"\0" + data))
        wire.append(packets.encode(servo, 0x55, b"\0" + data))
    whole = np.frombuffer(b"".join(wire) * 16, np.uint8)
    while True:
        yield rng.bytes(1_000_000), []
        damaged = whole.copy()
        hit = rng.random(damaged.size) < 0.02
        damaged[hit] = rng.integers(0, 256, int(hit.sum()))
        yield damaged.tobytes(), sent
        likely = np.frombuffer(b"\xff\xff\xff\xfd\x00\x10\x01\x03", np.uint8)
        headers = rng.choice(likely, 1_000_000)
        yield headers.tobytes(), []


def flood(size: int) -> tuple[float, int, int]:
    """Speed [MB/s], packets found that were never sent, and wrong CRCs met on the way."""
    parser, fed, most, right, false = Parser(), 0, 0, 0, 0
    begin = time.process_time()
    for piece, sent in hostile(np.random.default_rng(3)):
        known = set(sent)
        for at in range(0, len(piece), 777):
            found = parser.feed(piece[at : at + 777])
            wrong = sum(packet not in known for packet in found)
            right, false = right + len(found) - wrong, false + wrong
            most = max(most, parser.pending)
        fed += len(piece)
        if fed >= size:
            break
    spent = time.process_time() - begin
    assert right > 1000
    assert most < 2 * LONGEST
    return fed / spent / 1e6, false, parser.counters.bad_crc


def bound(tries: int) -> float:
    """A CRC of 16 bits lets one wrong packet in 65 536 pass; five sigma more is too many."""
    return tries / 65_536 + 5 * (1 + tries / 65_536) ** 0.5


def test_B3_a_flood_of_hostile_bytes_raises_nothing_and_makes_nothing_up() -> None:
    _, false, tries = flood(3_000_000)
    assert false <= bound(tries)


@pytest.mark.slow
def test_B3_a_hundred_million_hostile_bytes() -> None:
    speed, false, tries = flood(100_000_000)
    sys.stdout.write(f"{speed:.2f} MB/s, {false} false packets of {tries} wrong CRCs\n")
    assert false <= bound(tries)
    assert speed >= 0.2


def test_positions_of_the_standing_servos_are_true() -> None:
    rig = Rig()
    rig.twin.servos = standing()
    assert positions(rig.cycle()[0]) == {i: 100 * i for i in IDS}
