"""Torque on and off whatever the bus does, and the command held before."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import pytest
from servo_rig import IDS
from servo_rig import Rig as Servos
from twin_rig import Rig, rig

from antennate.control.loop import run_loop
from antennate.hardware.config import DriveConfig
from antennate.hardware.driving.drive import drive
from antennate.hardware.dynamixel.actuators import ServoMonitor
from antennate.hardware.dynamixel.bringup import BringUpError
from antennate.hardware.safety import torque
from antennate.hardware.safety.causes import Cause
from antennate.hardware.safety.session import Session
from antennate.twin.config import TwinConfig
from antennate.types import State
from dynamixel_bus.answers import SILENT, Answer, Span
from dynamixel_bus.packets import Instruction, StatusError
from dynamixel_bus.parser import Parser
from dynamixel_bus.port import PortError
from dynamixel_bus.servo_bus import Fault, Trouble

CONFIG = DriveConfig(dry_run=0.5, duration=0.5)
TORQUE, GOAL = b"\x40\0", b"\x74\0"
"""Addresses 64 and 116 of the XC430-W240 and XL330-M288, low byte first (e-manual)."""


def writes(made: Rig) -> list[tuple[float, bytes, bytes]]:
    """Time, address and data of all that is written to several servos from now on."""
    seen: list[tuple[float, bytes, bytes]] = []
    receive = made.robot.bus.receive

    def listen(t: float, data: bytes) -> None:
        packets = [p for p in Parser().feed(data) if p.instruction == Instruction.SYNC_WRITE]
        seen.extend((made.clock.now(), p.params[:2], p.params[4:]) for p in packets)
        receive(t, data)

    made.robot.bus.receive = listen
    return seen


class Noise:
    """Bytes that nobody sent, from a time on for a while [s]."""

    def __init__(self, link: Any, length: float) -> None:
        self._link, self._length, self.begin = link, length, float("inf")
        self._read, self._drain = link.read, link.drain
        link.read, link.drain = self.read, self.drain

    def _on(self) -> bool:
        return self.begin <= self._link.now() < self.begin + self._length

    def read(self, most: int, timeout: float) -> bytes:
        if not self._on():
            return self._read(most, timeout)
        self._link.sleep_until(self._link.now() + min(timeout, 1e-3))
        return b"\x55"

    def drain(self) -> int:
        return self._drain() + 3 * self._on()


@pytest.mark.parametrize("length", [0.04, 0.2, 60.0])
def test_B19_noise_at_the_release_leaves_no_servo_with_torque_within_2_s(length: float) -> None:
    made = rig(TwinConfig())
    noise, stand, begin = Noise(made.clock, length), made.session.stand, list[float]()

    def then_noise(time: float) -> None:
        begin.append(made.clock.now())
        stand(time)
        noise.begin = made.clock.now()

    made.session.stand = then_noise  # type: ignore[method-assign]
    report = drive(made.session, CONFIG, arm=True)
    assert made.session.tally.sent > 20
    assert not any(servo.torque for servo in made.robot.servos)
    assert made.clock.now() - begin[0] <= 2.0
    assert report.safe == (length < 1.0), "what cannot confirm in endless noise is named"


def test_B19_a_bus_that_nobody_answers_on_is_given_up_within_2_s() -> None:
    made = rig(TwinConfig())
    begin: list[float] = []

    def cut(session: Session, t: float) -> None:
        if session.tally.sent == 20:
            made.robot.bus.loss = 1.0
            begin.append(t)
            raise KeyboardInterrupt

    report = drive(made.session, CONFIG, arm=True, on_tick=cut)
    assert sorted(report.on or []) == IDS
    assert made.clock.now() - begin[0] <= 2.0


def test_B19_a_group_whose_release_fails_keeps_no_other_from_its_own(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    made, disable = rig(TwinConfig()), torque.disable
    first = made.session.actuators.joints.in_order_of_release[0]

    def broken(bus: Any, ids: Any, *words: Any) -> list[int]:
        if tuple(ids) == first:
            raise RuntimeError("a bug")
        return disable(bus, ids, *words)

    with monkeypatch.context() as patch:
        patch.setattr(torque, "disable", broken)
        report = drive(made.session, CONFIG, arm=True)
    assert report.on == list(first)
    assert {servo.get("id") for servo in made.robot.servos if servo.torque} == set(first)
    assert "a bug" in report.result(made.session)["tracebacks"][0]


def deaf_at_first(made: Servos, times: int) -> None:
    """Servo 6 does not hear the first so many orders to let go."""
    write = made.bus.write_all
    told: list[int] = []

    def counted(address: int, data: Any, anyway: bool = False) -> None:
        if address == 64:
            told.append(len(data))
            made.twin.trouble.pop(6, None)
            if len(told) <= times:
                made.twin.trouble[6] = Trouble(Fault.SILENT)
        write(address, data, anyway)

    made.bus.write_all = counted  # type: ignore[method-assign]


@pytest.mark.parametrize(("times", "on"), [(0, []), (1, []), (4, []), (5, [6])])
def test_B19_a_servo_is_told_five_times_to_let_go(times: int, on: list[int]) -> None:
    made = Servos()
    torque.arm_watchdogs(made.bus, IDS)
    torque.enable(made.bus, IDS)
    deaf_at_first(made, times)
    assert torque.disable(made.bus, IDS) == on
    assert [servo.get("id") for servo in made.twin.servos if servo.torque] == on


def test_B19_watchdogs_go_off_with_the_torque_and_no_sooner() -> None:
    """A tripped one tells of a program that died, and stops a servo that still has torque."""
    made = Servos()
    torque.arm_watchdogs(made.bus, IDS)
    torque.enable(made.bus, IDS)
    write = made.servo(6).write

    def refuse(address: int, data: bytes) -> StatusError:
        return StatusError.RESULT_FAIL if (address, data) == (64, b"\0") else write(address, data)

    made.servo(6).write = refuse  # type: ignore[method-assign]
    assert torque.disable(made.bus, IDS) == [6]
    made.link.sleep(0.5)
    assert {servo.get("bus_watchdog") for servo in made.twin.servos if not servo.torque} == {0}
    assert made.servo(6).get("bus_watchdog") == -1


def test_B19_a_bus_that_is_gone_makes_no_error_of_a_release() -> None:
    made = Servos()
    torque.enable(made.bus, IDS)

    def gone(*_: Any) -> Any:
        raise PortError("the wire is gone")

    made.link.write = made.link.read = made.link.drain = gone  # type: ignore[method-assign]
    assert torque.disable(made.bus, IDS) == IDS


def ticked(made: Rig, end: float, act: Callable[[float], None]) -> None:
    """Armed at 0.5 s, with something done after each tick."""
    session, clock = made.session, made.clock

    def go_on(*_: object) -> bool:
        session.orders.arm = clock.now() >= 0.5
        act(clock.now())
        return clock.now() < end

    run_loop(session, session.control, session.period, go_on)


def test_B19_servos_that_kept_their_torque_in_off_are_told_again_until_they_let_go() -> None:
    made = rig(TwinConfig())
    on: dict[float, list[int]] = {}
    states: list[State] = []

    def act(t: float) -> None:
        made.session.orders.stop = t >= 1.0
        for servo in (4, 18):
            made.robot.bus.trouble[servo] = Trouble(Fault.SILENT)
            if not 1.0 <= t < 2.5:
                del made.robot.bus.trouble[servo]
        on[t] = [servo.get("id") for servo in made.robot.servos if servo.torque]
        assert made.session.outputs is not None
        states.append(made.session.outputs.state)

    ticked(made, 3.0, act)
    assert states[-1] is State.OFF
    kept = [ids for t, ids in on.items() if 2.0 <= t < 2.5]
    assert len(kept) > 20, "telling them takes no more than two ticks"
    assert {tuple(ids) for ids in kept} == {(4, 18)}
    assert not any(ids for t, ids in on.items() if t >= 2.6)
    assert made.session.actuators.left_on == []


def test_B10_B19_a_servo_that_keeps_torque_after_half_an_arming_is_told_again() -> None:
    made = rig(TwinConfig())
    servos, trouble = made.robot.servos, made.robot.bus.trouble
    write, on = servos[11].write, list[tuple[float, int]]()

    def refuse(address: int, data: bytes) -> Any:
        if (address, data) == (64, b"\1"):
            trouble[4] = Trouble(Fault.SILENT)  # which has taken it just before
            return write(address, b"\0")
        return write(address, data)

    servos[11].write = refuse  # type: ignore[method-assign]

    def act(t: float) -> None:
        if t >= 2.5:
            trouble.pop(4, None)
        on.append((t, sum(servo.torque for servo in servos)))

    ticked(made, 3.0, act)
    assert {count for t, count in on if 2.0 <= t < 2.5} == {1}
    assert {count for t, count in on if t >= 2.6} == {0}
    assert made.session.tally.sent == 0


def test_B19_the_pose_is_held_for_as_long_as_told_before_the_torque_goes() -> None:
    made = rig(TwinConfig())
    seen, ended = writes(made), list[float]()

    def note(session: Session, t: float) -> None:
        ended[:] = [t]

    drive(made.session, CONFIG.model_copy(update={"stand": 0.4}), arm=True, on_tick=note)
    after = [(t, data) for t, address, data in seen if address == GOAL and t > ended[0]]
    let_go = [t for t, address, _ in seen if address == TORQUE and t > ended[0]]
    assert let_go[0] - ended[0] == pytest.approx(0.4, abs=0.011)
    assert len(after) == pytest.approx(40, abs=1)
    assert len({data for _, data in after}) == 1


def test_B6_B19_no_goal_is_sent_before_the_release_once_the_bus_was_lost() -> None:
    """Not even for a moment: servos may have been turned by hand meanwhile."""
    made = rig(TwinConfig())
    seen, lost = writes(made), list[float]()

    def cut(session: Session, t: float) -> None:
        made.robot.bus.loss = float(0.8 <= t < 1.2)
        if session.mute and not lost:
            lost.append(t)

    config = CONFIG.model_copy(update={"duration": 1.5, "fault_time": 0.0})
    report = drive(made.session, config, arm=True, on_tick=cut)
    assert lost
    assert report.safe
    assert any(address == TORQUE for t, address, _ in seen if t > lost[0])
    assert not any(address == GOAL for t, address, _ in seen if t > lost[0] + 0.03)


def test_B19_a_release_on_purpose_is_no_loss_of_torque() -> None:
    made = rig(TwinConfig())
    causes: set[Cause] = set()

    def act(t: float) -> None:
        made.session.orders.stop = t >= 1.0
        if t >= 1.0:
            assert made.session.outputs is not None
            causes.update(active.cause for active in made.session.outputs.causes)

    ticked(made, 2.5, act)  # longer than a round of all 19 takes
    assert not any(servo.torque for servo in made.robot.servos)
    assert Cause.STOPPED in causes
    assert not causes & {Cause.DISARMED, Cause.WATCHDOG}


@pytest.mark.parametrize("lost", [1, 2])
def test_a_packet_that_arming_lost_is_written_again(lost: int) -> None:
    made = Servos()
    for servo in made.twin.servos:
        servo.set("goal_position", 3000)
    write_all, written = made.bus.write_all, Counter[int]()

    def lossy(address: int, data: Mapping[int, bytes]) -> None:
        written[address] += 1
        if written[address] > lost:
            write_all(address, data)

    made.bus.write_all = lossy  # type: ignore[method-assign]
    torque.enable(made.bus, IDS)
    assert all(servo.torque for servo in made.twin.servos)
    assert written[64] == 1 + lost  # torque enable
    assert [servo.get("goal_position") for servo in made.twin.servos] == [
        servo.get("present_position") for servo in made.twin.servos
    ]


def test_a_servo_that_takes_no_goal_is_named_with_what_it_has() -> None:
    made = Servos()
    made.twin.servos[5].set("goal_position", 3000)
    write_all = made.bus.write_all

    def deaf(address: int, data: Mapping[int, bytes]) -> None:
        if others := {i: value for i, value in data.items() if i != 6}:
            write_all(address, others)

    made.bus.write_all = deaf  # type: ignore[method-assign]
    with pytest.raises(BringUpError, match=r"goal_position, found 3000 in servos \[6\]"):
        torque.enable(made.bus, IDS)
    assert not any(servo.torque for servo in made.twin.servos)


def test_a_hardware_error_keeps_its_name_while_its_register_does_not_answer() -> None:
    made = Servos()
    monitor = ServoMonitor(made.bus, tuple(IDS), made.link.now)
    made.twin.servos[6].fail(1 << 5)
    monitor.step()
    assert monitor.errors == {7: "overload"}
    read_all = made.bus.read_all

    def without(ids: Sequence[int], span: Span, *rest: float) -> dict[int, Answer]:
        return {7: SILENT} if span.address == 70 else read_all(ids, span, *rest)

    made.bus.read_all = without  # type: ignore[method-assign]
    monitor.step()
    assert monitor.errors == {7: "overload"}
