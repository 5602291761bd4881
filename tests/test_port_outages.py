"""A whole session, in invented time, whose cables are pulled and put back."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from lockstep import BoardPort
from twin_rig import rig

from antennate.control.loop import run_loop
from antennate.errors import BadInputError
from antennate.hardware.config import DriveConfig
from antennate.hardware.driving.connect import prepare, require_servos
from antennate.hardware.driving.drive import drive
from antennate.hardware.dynamixel.bringup import BringUpError
from antennate.hardware.esp32.frame import SAMPLE_FRAME_SIZE
from antennate.hardware.safety.deadlines import ANSWER
from antennate.hardware.safety.session import Session
from antennate.robots.spec import RobotSpec
from antennate.twin.config import TwinConfig
from antennate.types import State
from dynamixel_bus.answers import Timing
from dynamixel_bus.bus import Bus
from dynamixel_bus.port import Port, PortError

ARM, OUT, BACK, AGAIN = 0.5, 1.2, 1.7, 2.2
"""When torque comes on, a cable is pulled and put back, and an arm event comes [s]."""

SYNC_WRITE = 0x83
"""Instruction, the eighth byte of a packet, by which goals are sent (DYNAMIXEL protocol 2.0)."""


class Cable:
    """A port that raises as long as it is out."""

    def __init__(self, port: Port) -> None:
        self._port, self.out, self.sent = port, False, list[bytes]()

    def _check(self) -> Port:
        if self.out:
            raise PortError("the cable is out")
        return self._port

    def read(self, most: int, timeout: float) -> bytes:
        return self._check().read(most, timeout)

    def drain(self) -> int:
        return self._check().drain()

    def write(self, data: bytes) -> None:
        self._check().write(data)
        self.sent.append(data)


class Story:
    """A session that is armed; states and goals of every tick."""

    def __init__(self, act: Callable[[Story, float], None]) -> None:
        self.rig = rig(TwinConfig(), cable=Cable)
        self.board, self.bus = self.rig.board_port, self.rig.bus_port
        self.waiting: list[bytes] = []
        self._act = act
        self.t: list[float] = []
        self.state: list[State] = []
        self.goals: list[list[int]] = []
        self.texts: list[str] = []

    def run(self, end: float) -> Story:
        session, clock = self.rig.session, self.rig.clock

        def go_on(*_: object) -> bool:
            t, out = clock.now(), session.outputs
            assert out is not None
            self.t.append(t)
            self.state.append(out.state)
            self.texts.append("; ".join(active.text for active in out.causes))
            self.goals.append([s.get("goal_position") for s in self.rig.robot.servos])
            session.orders.arm = ARM <= t < OUT
            self._act(self, t)
            return t < end

        run_loop(session, session.control, session.period, go_on)
        return self

    def during(self, begin: float, end: float) -> list[int]:
        return [i for i, t in enumerate(self.t) if begin < t < end]

    def held_after(self, begin: float) -> float:
        """Time from then to the first HOLD or worse [s]."""
        return next(self.t[i] for i in self.during(begin, 99) if self.state[i] >= 2) - begin

    def walks(self, begin: float, end: float) -> bool:
        goals = np.array([self.goals[i] for i in self.during(begin, end)])
        return bool(np.ptp(goals, axis=0)[5:17].min() > 50)

    def stands(self, begin: float, end: float) -> bool:
        return len({tuple(self.goals[i]) for i in self.during(begin, end)}) == 1


def test_L12_L13_a_board_pulled_out_makes_it_hold_and_put_back_walk_within_a_second() -> None:
    def act(story: Story, t: float) -> None:
        story.board.out = OUT <= t < BACK

    story = Story(act).run(3.1)
    assert story.walks(ARM + 0.3, OUT)
    assert story.held_after(OUT) <= 0.1
    assert any("the cable is out" in story.texts[i] for i in story.during(OUT, BACK))
    assert story.stands(OUT + 0.1, BACK)
    assert all(story.state[i] <= State.DEGRADED for i in story.during(BACK + 1.0, 9))
    assert story.walks(BACK + 1.0, 9)


def pulled(how: str) -> Callable[[Story, float], None]:
    """The cable before the adapter, or that behind it, is out for a while."""

    def act(story: Story, t: float) -> None:
        if how == "usb":
            story.bus.out = OUT <= t < BACK
        else:
            story.rig.robot.bus.loss = float(OUT <= t < BACK)
        if t < BACK:
            story.bus.sent.clear()
        if t < AGAIN:
            story.waiting = list(story.bus.sent)
        else:
            story.rig.session.orders.arm = True

    return act


@pytest.mark.ci
@pytest.mark.parametrize("how", ["usb", "servos"])
def test_B6_L12_a_bus_put_back_stands_until_an_arm_event_and_begins_where_the_servos_are(
    how: str,
) -> None:
    story = Story(pulled(how)).run(3.0)
    assert story.walks(ARM + 0.3, OUT)
    assert story.held_after(OUT) <= 0.1
    assert all(story.state[i] == State.FAULT for i in story.during(OUT + 0.1, AGAIN))
    assert story.stands(OUT + 0.1, AGAIN)
    assert story.waiting
    assert not any(packet[7] == SYNC_WRITE for packet in story.waiting)
    assert story.walks(AGAIN + 0.3, 9)
    armed = next(i for i in story.during(AGAIN, 9) if story.state[i] < State.FAULT)
    assert story.t[armed] - AGAIN <= 1.0
    steps = abs(np.diff(story.goals[armed : armed + 50], axis=0))
    assert steps.max() <= 35  # legs: 5.26 rad/s in 10 ms, in ticks of 2 pi / 4096
    servos = story.rig.robot.servos
    assert {s.get("bus_watchdog") for s in servos} == {5}


def test_B6_another_robot_on_the_bus_does_not_get_armed() -> None:
    def act(story: Story, t: float) -> None:
        pulled("usb")(story, t)
        if t >= OUT:
            story.rig.robot.servos[3].set("model_number", 1200)

    story = Story(act).run(2.6)
    assert story.stands(OUT + 0.1, 9)
    assert any("found {4: 1200}" in text for text in story.texts)
    assert story.state[-1] == State.FAULT


@pytest.mark.parametrize(("patience", "safe"), [(5.0, True), (0.3, False)])
def test_B6_a_drive_waits_for_a_lost_bus_to_take_the_torque_off(
    patience: float, safe: bool
) -> None:
    made = rig(TwinConfig(), cable=Cable)
    cable = made.bus_port
    back: list[float] = []

    def act(session: Session, t: float) -> None:
        cable.out = OUT <= t < OUT + 1.0
        if t >= OUT + 1.0:
            back.append(t)

    config = DriveConfig(dry_run=0.5, duration=9.0, fault_time=0.0, bus_return=patience)
    report = drive(made.session, config, arm=True, on_tick=act)
    assert report.worst == State.FAULT
    assert "servo bus" in report.why
    assert report.safe == safe
    assert any(servo.torque for servo in made.robot.servos) != safe
    assert len(back) <= 10  # ends within 0.1 s of the bus, never walks again


@pytest.mark.parametrize("patience", [0.5, 1.5])
def test_L14_swapped_ports_are_refused_by_name_and_no_servo_hears_a_byte(patience: float) -> None:
    made = rig(TwinConfig())
    board, bus = Cable(BoardPort(made.robot, made.clock)), Cable(made.clock)
    begin = made.clock.now()
    with pytest.raises(BadInputError, match=r"expected an antenna board.*swapped"):
        prepare(DriveConfig(swapped=patience), esp32=bus, bus=board, clock=made.clock)
    assert patience < made.clock.now() - begin <= patience + 0.2
    assert not bus.sent
    assert not board.sent


class Speaks:
    """A board on the port of the bus: a frame every 10 ms, whatever it is asked."""

    def __init__(self, now: Callable[[], float]) -> None:
        self._now, self._told = now, 0

    def drain(self) -> int:
        told, self._told = self._told, SAMPLE_FRAME_SIZE * int(100 * self._now())
        return self._told - told

    def read(self, most: int, timeout: float) -> bytes:
        return bytes(min(self.drain(), most))

    def write(self, data: bytes) -> None:
        raise AssertionError("nothing may be written")


def test_L14_boards_on_both_ports_are_refused_within_2_s() -> None:
    made = rig(TwinConfig())
    board = Cable(BoardPort(made.robot, made.clock))
    begin = made.clock.now()
    with pytest.raises(BadInputError, match=r"--bus: expected servos.* another antenna board"):
        prepare(DriveConfig(), esp32=board, bus=Speaks(made.clock.now), clock=made.clock)
    assert made.clock.now() - begin <= 2.0
    assert not board.sent


@pytest.mark.parametrize("what", ["nothing", "servos"])
def test_L14_a_port_without_a_board_is_refused_within_2_s(what: str) -> None:
    """Servos on both ports say nothing either, nor does the one without a board."""
    made, other = rig(TwinConfig()), rig(TwinConfig())
    made.robot.board_silent = True
    made.robot.take()
    wrong = Cable(other.clock if what == "servos" else BoardPort(made.robot, made.clock))
    bus = Cable(made.clock)
    begin = made.clock.now()
    with pytest.raises(BadInputError, match=r"--esp32: expected an antenna board within 1\.9 s"):
        prepare(DriveConfig(), esp32=wrong, bus=bus, clock=made.clock)
    assert made.clock.now() - begin <= 2.0
    assert not wrong.sent
    assert not bus.sent


def test_L14_a_board_on_the_port_of_the_bus_is_refused_by_name() -> None:
    made = rig(TwinConfig())
    board = BoardPort(made.robot, made.clock)
    bus = Bus(board, Timing(RobotSpec().baud, latest=ANSWER), clock=made.clock.now)
    begin = made.clock.now()
    with pytest.raises(BringUpError, match=r"--bus: .* swapped"):
        require_servos(bus, RobotSpec())
    assert made.clock.now() - begin <= 10.0
