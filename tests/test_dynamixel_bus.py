"""The master of the servo bus under faults, in invented time; B1 ... are rows of a fault table."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest
from servo_rig import IDS, MODELS, Rig, positions

from antennate.hardware.dynamixel import bringup
from antennate.hardware.dynamixel.actuators import ServoMonitor
from antennate.hardware.dynamixel.bringup import BringUpError
from antennate.hardware.safety import torque
from dynamixel_bus import packets
from dynamixel_bus.answers import (
    MOTION,
    POSITION,
    SILENT,
    Refused,
    Silent,
    Span,
    Value,
)
from dynamixel_bus.bus import Bus
from dynamixel_bus.models import XL330_M288
from dynamixel_bus.packets import Status, StatusError
from dynamixel_bus.port import PortError
from dynamixel_bus.servo import Servo
from dynamixel_bus.servo_bus import Fault, ServoBus, Trouble
from dynamixel_bus.simulated_wire import SimulatedWire

LIMIT = 0.010 + 1e-9
TRUE = {i: 100 * i for i in IDS}


def test_all_answer_in_a_third_of_the_period() -> None:
    """19 x (10 + 4) + 8 bytes of reply and 33 of request take 3.07 ms at 1 Mbit/s."""
    rig = Rig()
    rig.cycle()
    answers, took = rig.cycle()
    assert positions(answers) == TRUE
    assert took == pytest.approx((19 * 14 + 8 + 33) * 1e-5)
    slow = Rig(fast=False)
    slow.cycle()
    answers, took = slow.cycle()
    assert positions(answers) == TRUE
    assert took == pytest.approx((19 * 21 + 33) * 1e-5)


@pytest.mark.parametrize("fast", [True, False])
@pytest.mark.parametrize(
    "dead", [i if i in (1, 10, 19) else pytest.param(i, marks=pytest.mark.slow) for i in IDS]
)
def test_B1_one_silent_servo_costs_10_ms_and_no_other_value(dead: int, fast: bool) -> None:
    rig = Rig(fast)
    rig.twin.trouble[dead] = Trouble(Fault.SILENT)
    for cycle in range(15):
        answers, took = rig.cycle()
        assert took <= (LIMIT if cycle < 2 else 0.0065 if fast else 0.0075)
        assert list(answers) == IDS
        assert isinstance(answers[dead], Silent)
        assert positions(answers) == {i: p for i, p in TRUE.items() if i != dead}
    rig.twin.trouble.clear()
    assert positions(rig.cycle()[0] | rig.cycle()[0]) == TRUE


def test_B1_two_silent_servos_leave_seventeen() -> None:
    rig = Rig()
    rig.twin.trouble = {5: Trouble(Fault.SILENT), 12: Trouble(Fault.SILENT)}
    for cycle in range(15):
        answers, took = rig.cycle()
        assert took <= LIMIT
        assert len(positions(answers)) == 17 or cycle == 0


@pytest.mark.parametrize("fast", [True, False])
def test_B2_an_answer_spoiled_once_is_there_in_the_same_cycle(fast: bool) -> None:
    for hurt in IDS:
        rig = Rig(fast)
        rig.cycle()
        rig.twin.trouble[hurt] = Trouble(Fault.BAD_CRC, count=1)
        answers, took = rig.cycle()
        assert positions(answers) == TRUE
        assert took <= LIMIT


@pytest.mark.parametrize("fast", [True, False])
@pytest.mark.parametrize(
    "fault", [Fault.BAD_CRC, Fault.TRUNCATED, Fault.OVERSIZED, Fault.WRONG_ID, Fault.DOUBLED]
)
def test_B3_no_wrong_value_and_the_bus_works_on(fault: Fault, fast: bool) -> None:
    for hurt in (1, 10, 19):
        rig = Rig(fast)
        rig.twin.trouble[hurt] = Trouble(fault, count=1)
        answers, took = rig.cycle()
        assert took <= LIMIT
        assert positions(answers).items() <= TRUE.items()
        assert positions(rig.cycle()[0]) == TRUE


@pytest.mark.parametrize("fast", [True, False])
def test_B3_a_servo_that_never_gets_it_right_is_silent(fast: bool) -> None:
    rig = Rig(fast)
    rig.twin.trouble[7] = Trouble(Fault.BAD_CRC)
    for _ in range(5):
        answers, took = rig.cycle()
        assert took <= LIMIT
        assert answers[7] == SILENT
        assert len(positions(answers)) == 18
    assert rig.bus.tally.bad_crc > 0


@pytest.mark.parametrize("fast", [True, False])
def test_B3_L1_answers_broken_by_turned_bits_are_counted(fast: bool) -> None:
    """One in a thousand bits: every answer that is hit counts once, or twice if its CRC is."""
    rig = Rig(fast)
    rig.twin.noise.ber = 1e-3
    hit, transmit = 0, rig.twin.transmit

    def watched(t: float) -> bytes:
        nonlocal hit
        before = rig.twin.noise.wrong
        data = transmit(t)
        hit += rig.twin.noise.wrong > before
        return data

    rig.twin.transmit = watched  # type: ignore[method-assign]
    for _ in range(300):
        rig.cycle()
    assert hit > 100
    assert 0.7 * hit <= rig.bus.tally.bad_crc <= 1.5 * hit


@pytest.mark.parametrize("delay", [0.003, 0.020, 0.040, 0.060])
@pytest.mark.parametrize("fast", [True, False])
def test_B4_no_late_answer_is_taken_for_a_new_one(delay: float, fast: bool) -> None:
    """Each cycle has its own true positions; what is accepted is true now."""
    rig = Rig(fast)
    rig.cycle()
    rng = np.random.default_rng(4)
    for cycle in range(60):
        late = int(rng.integers(1, 20))
        rig.twin.trouble = {late: Trouble(Fault.LATE, delay, count=1)} if cycle % 3 == 0 else {}
        for i in IDS:
            rig.servo(i).place(1000 * i + cycle)
        answers, took = rig.cycle()
        assert took <= LIMIT
        assert positions(answers).items() <= {i: 1000 * i + cycle for i in IDS}.items()
    assert rig.bus.tally.stale + rig.bus.tally.drained > 0


def test_B4_single_reads_after_a_late_answer() -> None:
    """The case that the manufacturer's program gets wrong: asked again, the old value comes."""
    rig = Rig()
    rig.twin.trouble[3] = Trouble(Fault.LATE, 0.050, count=1)
    stale = 0
    for k in range(300):
        rig.servo(3).place(k)
        answer = rig.bus.read(3, POSITION)
        if isinstance(answer, Value):
            assert int.from_bytes(answer.data, "little") == k
        rig.link.sleep(0.0005)
        stale = rig.bus.tally.stale
        if k % 100 == 50:
            rig.twin.trouble[3] = Trouble(Fault.LATE, 0.030, count=1)
    assert stale > 0


def test_B4_without_spare_bytes_a_servo_in_doubt_is_not_asked() -> None:
    rig = Rig()
    rig.twin.trouble[3] = Trouble(Fault.LATE, 0.050, count=1)
    exact = Span(132, 4)
    assert rig.bus.read(3, exact) == SILENT
    rig.servo(3).place(77)
    assert rig.bus.read(3, exact) == SILENT
    rig.link.sleep(0.1)
    assert rig.bus.read(3, exact) == Value((77).to_bytes(4, "little"), alert=False)


def test_B4_a_late_confirmation_does_not_confirm_the_next_write() -> None:
    """The second answer is slow itself, so that the first one would be there before it."""
    rig = Rig()
    rig.twin.trouble[3] = Trouble(Fault.LATE, 0.003, count=1)
    assert rig.bus.write(3, 116, bytes(4)) == SILENT
    rig.twin.trouble[3] = Trouble(Fault.LATE, 0.0015, count=1)
    answer = rig.bus.write(3, 116, (99_999).to_bytes(4, "little"))
    assert answer == Refused(StatusError.DATA_LIMIT, alert=False)


def test_B4_a_late_refusal_does_not_refuse_the_next_read() -> None:
    rig = Rig()
    rig.twin.trouble[3] = Trouble(Fault.LATE, 0.003, count=1)
    assert rig.bus.read(3, Span(66, 1)) == SILENT
    rig.twin.trouble[3] = Trouble(Fault.LATE, 0.0015, count=1)
    assert rig.bus.read(3, POSITION) == Value((300).to_bytes(4, "little"), alert=False)


@pytest.mark.parametrize(
    "seed", [0, 1, 2, *(pytest.param(n, marks=pytest.mark.slow) for n in range(3, 8))]
)
def test_B3_B4_whatever_happens_no_value_is_wrong_and_no_cycle_late(seed: int) -> None:
    """Random faults of random servos, late by up to 60 ms; each cycle has its own positions."""
    rng = np.random.default_rng(seed)
    rig = Rig(fast=bool(seed % 2), loss=0.01)
    kinds = [f for f in Fault if f is not Fault.WRONG_ID]
    for cycle in range(60):
        for i in IDS:
            rig.servo(i).place(1000 * i + cycle)
        if rng.random() < 0.3:
            kind = kinds[rng.integers(len(kinds))]
            count = None if kind is Fault.SILENT else 1
            trouble = Trouble(kind, float(rng.uniform(0.0, 0.06)), count)
            rig.twin.trouble = {int(rng.integers(1, 20)): trouble}
        answers, took = rig.cycle()
        assert took <= LIMIT
        assert positions(answers).items() <= {i: 1000 * i + cycle for i in IDS}.items()


class Boom(Exception):
    """Something that is no error of the port."""


class Fragile(SimulatedWire):
    """A wire that raises at its n-th call."""

    def __init__(self, bus: ServoBus) -> None:
        super().__init__(bus)
        self.until = -1

    def count(self) -> None:
        self.until -= 1
        if self.until == 0:
            raise Boom

    def write(self, data: bytes) -> None:
        self.count()
        super().write(data)
        self.count()

    def read(self, most: int, timeout: float) -> bytes:
        self.count()
        came = super().read(most, timeout)
        self.count()
        return came

    def drain(self) -> int:
        self.count()
        return super().drain()


@pytest.mark.ci
@pytest.mark.parametrize("fast", [True, False])
def test_B5_the_bus_works_after_an_exception_anywhere(fast: bool) -> None:
    raised = 0
    for call in range(1, 60):
        link = Fragile(Rig().twin)
        bus = Bus(link, fast=fast, clock=link.now)
        bus.read_all(IDS, MOTION)
        link.until = call
        try:
            bus.read_all(IDS, MOTION)
        except Boom:
            raised += 1
        link.until = -1
        for i in IDS:
            link.bus.servos[i - 1].place(7 * i)
        begin = link.now()
        answers = bus.read_all(IDS, MOTION)
        assert link.now() - begin <= LIMIT
        assert positions(answers).items() <= {i: 7 * i for i in IDS}.items()
        assert positions(bus.read_all(IDS, MOTION)) == {i: 7 * i for i in IDS}
    assert raised >= 40


def test_B6_all_silent_costs_no_more_and_all_are_back_soon_after() -> None:
    rig = Rig()
    rig.cycle()
    rig.twin.trouble = {i: Trouble(Fault.SILENT) for i in IDS}
    for _ in range(30):
        answers, took = rig.cycle()
        assert took <= LIMIT
        assert set(answers.values()) == {SILENT}
    rig.twin.trouble = {}
    begin = rig.link.now()
    while len(positions(rig.cycle()[0])) < 19:
        assert rig.link.now() - begin < 0.2


def test_servos_that_do_not_know_fast_reads_are_asked_slowly() -> None:
    rig = Rig()
    rig.say_firmware(44)
    for _ in range(6):
        answers, took = rig.cycle()
        assert took <= LIMIT
        assert len(positions(answers)) >= 18
    assert not rig.bus.fast
    answers, took = rig.cycle()
    assert took < 0.005
    assert positions(answers) == TRUE


def test_a_silent_first_servo_does_not_end_fast_reads() -> None:
    rig = Rig()
    rig.twin.trouble[1] = Trouble(Fault.SILENT)
    for _ in range(20):
        rig.cycle()
    assert rig.bus.fast


def test_fast_reads_that_were_answered_outlast_a_busy_computer() -> None:
    rig = Rig()
    rig.cycle()
    rig.say_firmware(44)  # no answer, as when it comes too late
    for _ in range(20):
        rig.cycle()
    rig.say_firmware(52)
    answers, took = rig.cycle()
    assert rig.bus.fast
    assert took < 0.005
    assert positions(answers) == TRUE


def test_goals_reach_all_servos() -> None:
    rig = Rig()
    rig.bus.write_all(116, {i: (50 * i).to_bytes(4, "little") for i in IDS})
    rig.link.sleep(0.01)
    assert [servo.get("goal_position") for servo in rig.twin.servos] == [50 * i for i in IDS]


def test_a_babbling_bus_is_given_up_in_time() -> None:
    class Noise(SimulatedWire):
        def read(self, most: int, timeout: float) -> bytes:
            self.sleep(min(timeout, 0.0003))
            return b"\xff\xff\xfd\x00\x01"

        def drain(self) -> int:
            return 5

    link = Noise(Rig().twin)
    bus = Bus(link, clock=link.now)
    assert set(bus.read_all(IDS, MOTION).values()) == {SILENT}
    assert link.now() <= 0.011
    begin = link.now()
    with pytest.raises(PortError, match="quiet"):
        bus.write_all(116, {1: bytes(4)})
    assert link.now() - begin <= 0.011


@pytest.mark.parametrize("stopped", ["drain", "read"])
def test_a_process_that_did_not_run_for_a_while_does_not_take_the_bus_for_busy(
    stopped: str,
) -> None:
    """For 30 ms the machine ran something else. The late answer that came meanwhile was all."""
    late = {"drain": [b""], "read": [b""]}

    class Late(SimulatedWire):
        def read(self, most: int, timeout: float) -> bytes:
            return self.come("read") or super().read(most, timeout)

        def drain(self) -> int:
            return len(self.come("drain")) + super().drain()

        def come(self, where: str) -> bytes:
            if not (data := late[where].pop() if late[where] else b""):
                return b""
            self.sleep(0.03)
            return data

    rig = Rig()
    wire = Late(rig.twin)
    bus = Bus(wire, clock=wire.now)
    late[stopped].append(b"\xff\xff\xfd\x00\x01")
    if stopped == "read":  # something has to come first, or nothing is awaited
        wire.write(packets.ping(1))
        wire.sleep(0.001)
    bus.write_all(116, {1: (2000).to_bytes(4, "little")})
    assert wire.now() > 0.03
    wire.sleep(0.01)
    assert rig.twin.servos[0].get("goal_position") == 2000


def test_B12_an_alert_comes_with_the_value_and_names_its_cause() -> None:
    rig = Rig()
    rig.servo(4).fail(0b100000)
    answers, _ = rig.cycle()
    said = answers[4]
    assert isinstance(said, Value)
    assert said.alert
    assert [i for i, a in answers.items() if isinstance(a, Value) and a.alert] == [4]
    assert rig.bus.read(4, Span(70, 1)) == Value(b"\x20", alert=True)


def test_B15_all_as_expected() -> None:
    rig = Rig()
    bringup.require(rig.bus, MODELS)
    assert rig.link.now() < 3.0


def test_B15_missing_wrong_double_and_strange_servos_are_named_within_3_s() -> None:
    rig = Rig()
    rig.twin.trouble[2] = Trouble(Fault.SILENT)
    rig.twin.servos[4] = Servo(XL330_M288, 5)
    rig.twin.servos.append(Servo(XL330_M288, 19, position=5.0, t=0.3))
    rig.twin.servos.append(Servo(XL330_M288, 42))
    rig.link.sleep(1.0)
    begin = rig.link.now()
    with pytest.raises(BringUpError) as caught:
        bringup.require(rig.bus, MODELS)
    assert rig.link.now() - begin < 3.0
    said = str(caught.value)
    assert "expected 19 servos, found 16 fit" in said
    for part in (
        "id 2: silent, perhaps it answers as 19",
        "id 5: expected model XC430",
        "id 19: two servos answer",
        "id 42",
    ):
        assert part in said
    assert not any(servo.torque for servo in rig.twin.servos)


def test_B15_two_models_with_one_id_are_not_called_silent() -> None:
    rig = Rig()
    assert rig.servo(3).model is not XL330_M288
    rig.twin.servos.append(Servo(XL330_M288, 3))
    with pytest.raises(BringUpError, match="id 3: no answer is whole: two servos"):
        bringup.require(rig.bus, MODELS)


def torque_on(times: int) -> None:
    """Row B10: nobody's goal is far when torque comes on, and nobody moves for 50 ticks."""
    rng = np.random.default_rng(10)
    for _ in range(times):
        rig = Rig()
        for servo in rig.twin.servos:
            servo.set("goal_position", int(rng.integers(0, 4096)))
        torque.enable(rig.bus, IDS)
        for _ in range(50):
            rig.link.sleep(0.01)
            for servo in rig.twin.servos:
                assert servo.torque
                assert abs(servo.get("goal_position") - servo.position) <= 5
                assert abs(servo.position - 100 * servo.get("id")) <= 5


def test_B10_torque_goes_on_without_a_jump() -> None:
    torque_on(20)


@pytest.mark.slow
def test_B10_torque_goes_on_without_a_jump_a_thousand_times() -> None:
    torque_on(1000)


def test_B9_latched_watchdogs_are_seen_and_rearmed_in_place() -> None:
    rig = Rig()
    torque.arm_watchdogs(rig.bus, IDS)
    torque.enable(rig.bus, IDS)
    rig.bus.write_all(116, {i: (100 * i + 500).to_bytes(4, "little") for i in IDS})
    rig.link.sleep(0.5)
    watchdog = Span(98, 1)
    said = rig.bus.read_all(IDS, watchdog)
    assert set(said.values()) == {Value(b"\xff", alert=False)}
    with pytest.raises(BringUpError, match="goal_position"):
        torque.hold_here(rig.bus, IDS)
    before = [servo.position for servo in rig.twin.servos]
    torque.arm_watchdogs(rig.bus, IDS)
    assert [servo.get("bus_watchdog") for servo in rig.twin.servos] == [5] * 19
    assert [servo.position for servo in rig.twin.servos] == pytest.approx(before, abs=1.0)


def test_B9_watchdogs_are_rearmed_in_order_with_goals_where_servos_stand() -> None:
    """Off, goals where they stand, on: one whose watchdog is off would go on to its old goal."""
    rig = Rig()
    for servo in rig.twin.servos:
        servo.set("goal_position", 4000)
        servo.set("bus_watchdog", -1)
    written: list[tuple[int, int]] = []
    write_all = rig.bus.write_all

    def note(address: int, data: Mapping[int, bytes]) -> None:
        assert list(data) == IDS
        written.append((address, int.from_bytes(data[7], "little", signed=True)))
        write_all(address, data)

    rig.bus.write_all = note  # type: ignore[method-assign]
    torque.arm_watchdogs(rig.bus, IDS)
    assert written == [(98, 0), (116, 700), (98, 5)]
    assert [servo.get("goal_position") for servo in rig.twin.servos] == [100 * i for i in IDS]


def test_B9_extended_mode_with_an_offset_is_refused() -> None:
    rig = Rig()
    rig.servo(8).set("operating_mode", 4)
    rig.servo(8).set("homing_offset", 100)
    with pytest.raises(BringUpError, match=r"\[8\]"):
        torque.arm_watchdogs(rig.bus, IDS)


def test_an_answer_with_another_id_is_no_answer() -> None:
    rig = Rig(fast=False)
    rig.twin.trouble[3] = Trouble(Fault.WRONG_ID, count=1)
    assert list(rig.bus.read_all([3, 7], POSITION)) == [3, 7]
    assert rig.bus.tally.stale == 1


def test_two_answers_of_one_servo_that_differ_are_none() -> None:
    class Echo(SimulatedWire):
        def read(self, most: int, timeout: float) -> bytes:
            came = super().read(most, timeout)
            other = Status(3, StatusError.NONE, False, bytes(4))
            return packets.status(other) + came if came else came

    link = Echo(Rig().twin)
    assert Bus(link, clock=link.now).read(3, POSITION) == SILENT


def test_a_dead_wire_is_noted_by_the_watch_and_ends_nothing() -> None:
    class Dead(SimulatedWire):
        def write(self, data: bytes) -> None:
            raise PortError("the wire is gone")

    link = Dead(Rig().twin)
    watch = ServoMonitor(Bus(link, clock=link.now), tuple(IDS), link.now)
    watch.step()
    assert watch.bus_error == "the wire is gone"
    assert set(watch.missed.values()) == {1}


def test_B19_torque_off_is_confirmed_and_what_did_not_is_named() -> None:
    rig = Rig(loss=0.05)
    torque.enable(rig.bus, IDS)
    rig.twin.trouble[6] = Trouble(Fault.SILENT)
    assert torque.disable(rig.bus, IDS) == [6]
    assert [servo.torque for servo in rig.twin.servos] == [i == 6 for i in IDS]
