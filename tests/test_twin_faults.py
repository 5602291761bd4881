"""Wires that damage bytes and a supply that runs empty, in invented time."""

from __future__ import annotations

from collections import defaultdict

import numpy as np
import pytest
from twin_rig import Rig, rig

from antennate.errors import BadInputError
from antennate.hardware.config import DriveConfig
from antennate.hardware.driving.drive import drive
from antennate.hardware.esp32.wire import FrameDecoder, Sample
from antennate.hardware.safety.session import Session
from antennate.params.hardware import BatteryParams
from antennate.robots.spec import RobotSpec
from antennate.twin.board import Converter
from antennate.twin.config import TwinConfig, watched
from antennate.twin.faults import Faults, read
from antennate.twin.robot import TwinRobot
from antennate.types import State
from dynamixel_bus import packets
from dynamixel_bus.faults import Noise
from dynamixel_bus.packets import Instruction
from dynamixel_bus.parser import Parser

IDS = RobotSpec().ids


def broken(robot: TwinRobot, *texts: str) -> None:
    Faults([read(text) for text in texts], IDS).apply(robot, robot.t)


@pytest.mark.parametrize("ber", [1e-3, 1e-2])
def test_as_many_bits_are_wrong_as_asked_for(ber: float) -> None:
    noise, sent = Noise(seed=4), bytes(125_000)
    noise.ber = ber
    wrong = int(np.unpackbits(np.frombuffer(noise(sent), np.uint8)).sum())
    assert wrong == noise.wrong
    assert wrong == pytest.approx(1e6 * ber, abs=4 * (1e6 * ber) ** 0.5)


def test_lost_bytes_leave_the_others_as_they_are_and_chance_has_a_seed() -> None:
    noise, again, sent = Noise(seed=4), Noise(seed=4), bytes(range(250)) * 400
    noise.loss = again.loss = 0.1
    came = noise(sent)
    assert came == again(sent)
    assert len(sent) - len(came) == noise.lost == pytest.approx(10_000, abs=400)
    steps = np.diff(np.frombuffer(came, np.uint8).astype(int)) % 250
    assert steps.min() > 0  # in order: one value never comes twice in a row
    assert steps.max() < 10


def test_each_wire_has_the_noise_that_was_asked_for() -> None:
    robot = watched(TwinConfig())[0]
    broken(robot, "bus=ber:1e-3", "wire=loss:0.02", "esp32=ber:1e-4")
    assert (robot.bus.noise.ber, robot.bus.noise.loss) == (1e-3, 0.02)
    assert (robot.noise.ber, robot.noise.loss) == (1e-4, 0.02)
    broken(robot, "wire=ber:1e-5")
    assert (robot.bus.noise.ber, robot.noise.ber) == (1e-5, 1e-5)


@pytest.mark.parametrize("text", ["wire=ber:2", "wire=loss:-1", "bus=loss:1.5", "esp32=ber:1e1"])
def test_a_share_is_not_above_one_or_below_zero(text: str) -> None:
    with pytest.raises(BadInputError, match="share of 0 to 1"):
        read(text)


class Overheard(Noise):
    """Noise that notes the readings in the board's frames before it spoils them."""

    def __init__(self, readings: dict[int, tuple[int, int]]) -> None:
        super().__init__(seed=0)
        self.readings, self.decoder = readings, FrameDecoder()

    def __call__(self, data: bytes) -> bytes:
        for found in self.decoder.feed(data):
            if isinstance(found, Sample):
                self.readings[found.seq] = (found.left, found.right)
        return super().__call__(data)


class Truth:
    """What was really sent: goals by the session, readings by the board."""

    def __init__(self, made: Rig) -> None:
        self.goals: dict[int, set[int]] = defaultdict(set)
        self.readings: dict[int, tuple[int, int]] = {}
        self.positions: dict[int, set[int]] = defaultdict(set)
        self._parser, self._robot = Parser(), made.robot
        send = made.clock.write

        def write(data: bytes) -> None:
            for packet in self._parser.feed(data):
                self._note(packet.instruction, packet.params)
            send(data)

        made.clock.write = write  # type: ignore[method-assign]
        made.robot.noise = Overheard(self.readings)

    def _note(self, instruction: int, params: bytes) -> None:
        for servo in self._robot.servos:
            self.positions[servo.get("id")].add(servo.get("present_position"))
        if instruction == Instruction.SYNC_WRITE and params[:4] == b"\x74\x00\x04\x00":
            for at in range(4, len(params), 5):
                goal = int.from_bytes(params[at + 1 : at + 5], "little", signed=True)
                self.goals[params[at]].add(goal)


@pytest.mark.ci
@pytest.mark.parametrize(("ber", "worst"), [("1e-4", State.HOLD), ("1e-3", State.FAULT)])
def test_L1_B3_bit_errors_are_counted_and_no_wrong_value_is_ever_used(
    ber: str, worst: State
) -> None:
    """At 1e-4 of the answers of 19 servos one in five has a bit error, and it walks on."""
    made = rig(TwinConfig())
    truth, states = Truth(made), list[State]()

    def look(session: Session, t: float) -> None:
        if t < 0.9:
            return
        if not made.robot.noise.ber:
            broken(made.robot, f"wire=ber:{ber}")
        out, newest = session.outputs, session.board.clock.newest
        assert out is not None
        assert newest is not None
        states.append(out.state)
        sample = newest.sample
        assert (sample.left, sample.right) == truth.readings[sample.seq]
        for servo in made.robot.servos:
            if t > 1.0:
                assert servo.get("goal_position") in truth.goals[servo.get("id")]
        for servo, position in session.actuators.state.positions.items():
            assert position in truth.positions[servo]

    duration = 8.0 if worst is State.FAULT else 3.5  # until five answers in a row are missed
    config = DriveConfig(dry_run=0.3, duration=duration, fault_time=0.5)
    report = drive(made.session, config, arm=True, on_tick=look)
    result = report.result(made.session)
    assert made.robot.bus.noise.wrong > 50
    assert made.robot.noise.wrong > 5
    assert result["crc_errors"] >= 3
    assert made.session.actuators.bus.tally.misses > 100
    assert max(states[:-1]) <= worst
    assert (states[-1] is State.FAULT) == (worst is State.FAULT)
    assert not any(servo.torque for servo in made.robot.servos)


def test_a_supply_sags_at_its_rate_and_servos_latch_when_it_is_below_their_limit() -> None:
    robot = watched(TwinConfig())[0]
    large, small = robot.servos[0], robot.servos[17]
    robot.advance(1.0)
    broken(robot, "bus=discharge:2")
    robot.advance(3.0)
    assert large.get("present_input_voltage") == pytest.approx(71, abs=1)  # 11.1 V - 2 s * 2 V/s
    assert small.get("present_input_voltage") == 50  # behind its regulator
    assert large.get("hardware_error_status") == 0
    robot.advance(3.6)  # 5.9 V: the limits are 6.0 and 3.5 V
    assert large.get("hardware_error_status") == 1
    assert small.get("hardware_error_status") == 0
    robot.advance(5.0)
    assert small.get("hardware_error_status") == 1


def test_a_sagging_supply_gives_way_under_load() -> None:
    """Two servos blocked at full strength: 2 * 1.3 A through 0.5 ohm."""
    robot = watched(TwinConfig(battery=BatteryParams(resistance=0.5, stall_current=1.3)))[0]
    broken(robot, "bus=discharge:0")
    for servo in robot.servos[:2]:
        servo.set("torque_enable", 1)
        servo.shaft(2048.0, duty=1.0)
    robot.battery.feed(robot.servos, 1.0)
    assert robot.servos[5].get("present_input_voltage") == round(10 * (11.1 - 1.3))


def test_a_fault_of_the_answers_is_taken_back() -> None:
    robot = watched(TwinConfig())[0]
    robot.advance(1.0)
    heard: list[bool] = []
    for what in ("silent", "none"):
        broken(robot, f"servo:7={what}")
        robot.bus.receive(robot.t, packets.ping(7))
        robot.advance(robot.t + 0.1)
        heard.append(bool(robot.bus.transmit(robot.t)))
    assert heard == [False, True]


def test_a_board_that_fell_silent_speaks_again() -> None:
    """100 samples a second."""
    robot = watched(TwinConfig())[0]
    robot.advance(1.0)
    robot.take()
    heard: list[int] = []
    for what in ("silent", "none"):
        broken(robot, f"esp32={what}")
        robot.advance(robot.t + 0.5)
        heard.append(len(robot.take()))
    assert heard[0] == 0
    assert heard[1] > 500


@pytest.mark.parametrize("counts", [0.0, 4095.0, 60000.0, 1250.0])
@pytest.mark.parametrize("others", [(), ("hum:900",), ("plateau:1250",), ("plateau:0", "sticky")])
def test_every_code_is_one_of_the_converter(counts: float, others: tuple[str, ...]) -> None:
    """0 to 4095 of 12 bits (ESP32 datasheet), and none above a plateau."""
    converter = Converter(seed=1, mains=50.02)
    demands = [read(f"esp32={text}") for text in (f"left:{counts}", *others, "stuck_left")]
    for demand in demands:
        converter.set(demand.what, demand.size)
    codes = [converter.codes(t, np.full(2, 1800.0), np.zeros(2))[0] for t in np.arange(40) / 100]
    largest = next((int(text[8:]) for text in others if text.startswith("plateau")), 4095)
    assert min(codes) >= 0
    assert max(codes) <= largest
    assert max(codes) - min(codes) <= 2


@pytest.mark.parametrize("text", ["servo:7=late", "bus=latency", "bus=latency:-1", "bus=discharge"])
def test_delays_and_falls_need_a_size_too(text: str) -> None:
    with pytest.raises(BadInputError, match=r"--fault: expected (seconds|volts)"):
        read(text)


@pytest.mark.parametrize(
    "text", ["servo:7=torque_enable:0", "servo:7=silent", "bus=latency:0.05", "esp32=left:0"]
)
def test_a_fault_is_told_as_it_was_asked_for(text: str) -> None:
    assert str(read(text)) == text
