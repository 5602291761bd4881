"""The twin servos: what the manuals say of registers; the manufacturer's program on a port."""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from pty_server import PtyServer, tried
from servo_rig import IDS, MODELS, Rig, positions, servos

from dynamixel_bus import packets
from dynamixel_bus.answers import MOTION, Timing, Value
from dynamixel_bus.bus import Bus
from dynamixel_bus.models import XC430_W240
from dynamixel_bus.packets import Status, StatusError
from dynamixel_bus.parser import Parser
from dynamixel_bus.port import PortError
from dynamixel_bus.ports import SerialPort
from dynamixel_bus.servo import BOOT_TIME, Servo
from dynamixel_bus.servo_bus import Fault, ServoBus, Trouble

GOAL, TORQUE, WATCHDOG = 116, 64, 98


def put(servo: Servo, name: str, value: int) -> StatusError:
    register = servo.model[name]
    return servo.write(register.address, register.encode(value))


def moving(goal: int = 4000) -> Servo:
    servo = Servo(XC430_W240, 1, position=0.0)
    assert put(servo, "torque_enable", 1) == StatusError.NONE
    assert put(servo, "goal_position", goal) == StatusError.NONE
    return servo


# one servo


@pytest.mark.parametrize(
    ("address", "data", "error"),
    [
        (117, b"\0\0\0", StatusError.ACCESS),
        (112, bytes(4) + (5000).to_bytes(4, "little"), StatusError.DATA_LIMIT),
        (112, b"\x07\0\0\0" + bytes(4), StatusError.NONE),
    ],
)
def test_writes_are_refused_as_a_whole(address: int, data: bytes, error: StatusError) -> None:
    servo = Servo(XC430_W240, 1)
    before = servo.read(104, 16)
    assert servo.write(address, data) == error
    assert (servo.read(104, 16) == before) == (error != StatusError.NONE)


def test_a_watchdog_without_torque_or_turned_off_never_trips() -> None:
    servo = Servo(XC430_W240, 1)
    put(servo, "bus_watchdog", 1)
    servo.advance(10.0)
    assert servo.get("bus_watchdog") == 1
    servo = moving()
    servo.advance(10.0)
    assert servo.get("bus_watchdog") == 0


def test_B11_a_restart_forgets_ram_and_starts_the_tick_anew() -> None:
    servo = moving(4000)
    put(servo, "bus_watchdog", 100)
    servo.advance(0.5)
    assert servo.get("realtime_tick") == 500
    servo.restart(0.5)
    assert not servo.awake(0.5 + 0.9 * BOOT_TIME)
    servo.advance(0.6 + BOOT_TIME)
    assert servo.awake(0.6 + BOOT_TIME)
    assert servo.get("realtime_tick") == pytest.approx(100, abs=1)
    assert not servo.torque
    assert servo.get("bus_watchdog") == 0
    assert servo.get("goal_position") == servo.get("present_position")


# the wire


def ask(bus: ServoBus, request: bytes, t: float = 0.0) -> tuple[list[Status], float]:
    """What comes back, and when the last of it is there [s]."""
    bus.receive(t, request)
    parser, found, last = Parser(), list[Status](), t
    while (due := bus.next_time()) is not None:
        last = due
        found += [s for p in parser.feed(bus.transmit(due)) if (s := packets.as_status(p))]
    return found, last


@pytest.mark.parametrize(("baud", "delay"), [(1_000_000, 0), (57_600, 0), (1_000_000, 250)])
def test_answers_take_the_time_of_their_bytes(baud: int, delay: int) -> None:
    """19 sync read answers of 10 bytes: 10 bits a byte, 2 us a count of return delay."""
    bus = ServoBus(servos(), baud)
    for servo in bus.servos:
        servo.set("return_delay_time", delay)
    found, last = ask(bus, packets.sync_read(IDS, 126, 10))
    assert [status.id for status in found] == IDS
    assert last == pytest.approx((33 + 19 * 21) * 10 / baud + 19 * 2e-6 * delay)


@pytest.mark.parametrize("slow", [True, False])
def test_the_chain_stops_at_a_silent_servo(slow: bool) -> None:
    bus = ServoBus(servos())
    bus.trouble[7] = Trouble(Fault.SILENT)
    request = (packets.sync_read if slow else packets.fast_sync_read)(IDS, 126, 10)
    if slow:
        assert [status.id for status in ask(bus, request)[0]] == IDS[:6]
    else:
        bus.receive(0.0, request)
        found = packets.split_fast_reply(bus.transmit(1.0), IDS, 10)
        assert [status.id for status in found] == IDS[:6]


def test_a_fault_stays_with_its_servo_when_the_id_changes() -> None:
    bus = ServoBus(servos())
    bus.trouble[7] = Trouble(Fault.SILENT)
    bus.servos[6].set("id", 8)  # as a script that gives ids may do
    bus.servos[7].set("id", 7)
    found, _ = ask(bus, packets.ping(7))
    assert [status.id for status in found] == [7]
    assert ask(bus, packets.ping(8))[0] == []


def test_what_servos_do_not_know_they_refuse_and_a_wrong_crc_they_do_not_hear() -> None:
    bus = ServoBus([Servo(XC430_W240, 1)])
    said, _ = ask(bus, packets.encode(1, 0x7F, b"\xff"))
    assert said[0].error == StatusError.INSTRUCTION
    hurt = packets.write(1, 65, b"\x01")[:-1] + b"\0"
    assert ask(bus, hurt)[0] == []
    assert bus.servos[0].get("led") == 0


def test_half_a_request_is_forgotten() -> None:
    bus = ServoBus([Servo(XC430_W240, 1)])
    whole = packets.ping(1)
    bus.receive(0.0, whole[:5])
    assert len(ask(bus, whole, t=0.1)[0]) == 1


def test_two_servos_with_one_id_spoil_what_differs() -> None:
    bus = ServoBus([Servo(XC430_W240, 1, position=7.0), Servo(XC430_W240, 1, position=4000.0)])
    assert len(ask(bus, packets.ping(1))[0]) == 1
    assert ask(bus, packets.read(1, 132, 4))[0] == []


def test_a_broadcast_ping_is_answered_by_all_in_order() -> None:
    found, _ = ask(ServoBus(servos()), packets.ping())
    assert {s.id: int.from_bytes(s.data[:2], "little") for s in found} == MODELS
    assert [s.id for s in found] == IDS


def test_B7_every_servo_stops_by_itself_when_the_master_dies() -> None:
    """Register 5: at most 120 ms after the last packet, in position and in velocity mode."""
    rig = Rig()
    for i in IDS:
        put(rig.servo(i), "operating_mode", 1 if i % 2 else 3)
        put(rig.servo(i), "torque_enable", 1)
        put(rig.servo(i), "bus_watchdog", 5)
    rig.bus.write_all(104, {i: (50).to_bytes(4, "little") for i in IDS if i % 2})
    rig.bus.write_all(GOAL, {i: (4000).to_bytes(4, "little") for i in IDS if not i % 2})
    for _ in range(20):
        rig.cycle()
    assert all(servo.get("moving") for servo in rig.twin.servos)
    last = rig.link.now()
    rig.link.sleep(0.12)
    assert all(servo.get("bus_watchdog") == -1 for servo in rig.twin.servos)
    rig.link.sleep(0.58)  # an XL330 comes to rest within 0.6 s: six times damping over stiffness
    stopped = [servo.position for servo in rig.twin.servos]
    rig.link.sleep(1.0)
    assert [servo.position for servo in rig.twin.servos] == pytest.approx(stopped, abs=1)
    assert rig.link.now() > last


def test_B7_any_packet_feeds_every_watchdog() -> None:
    """The trap: a bus that is only polled keeps a dead control's robot walking."""
    rig = Rig()
    put(rig.servo(1), "torque_enable", 1)
    put(rig.servo(1), "bus_watchdog", 5)
    for _ in range(50):
        rig.bus.ping(19)
        rig.link.sleep(0.09)
    assert rig.servo(1).get("bus_watchdog") == 5


# on a serial port, in real time


@pytest.fixture
def server() -> Iterator[PtyServer]:
    with PtyServer(ServoBus(servos())) as serving:
        yield serving


@pytest.fixture
def sdk(server: PtyServer) -> Iterator[tuple[Any, Any, Any]]:
    """The manufacturer's program as it is: module, port, packet handler."""
    module = pytest.importorskip("dynamixel_sdk")
    port = module.PortHandler(server.path)
    assert port.openPort()
    assert port.setBaudRate(1_000_000)
    interval = sys.getswitchinterval()
    sys.setswitchinterval(1e-4)
    yield module, port, module.PacketHandler(2.0)
    sys.setswitchinterval(interval)
    port.closePort()


@pytest.mark.parametrize("fast", [True, False])
def test_the_sdk_reads_19_servos(sdk: tuple[Any, Any, Any], fast: bool) -> None:
    module, port, handler = sdk
    group = module.GroupSyncRead(port, handler, 132, 4)
    for i in IDS:
        assert group.addParam(i)
    call = group.fastSyncRead if fast else group.txRxPacket
    assert tried(call, module.COMM_SUCCESS) == module.COMM_SUCCESS
    assert [group.getData(i, 132, 4) for i in IDS] == [100 * i for i in IDS]


def test_the_sdk_writes_goals_and_the_servos_go_there(
    sdk: tuple[Any, Any, Any], server: PtyServer
) -> None:
    module, port, handler = sdk
    for i in IDS:
        good = (module.COMM_SUCCESS, 0)
        assert tried(partial(handler.write1ByteTxRx, port, i, TORQUE, 1), good) == good
    group = module.GroupSyncWrite(port, handler, GOAL, 4)
    for i in IDS:
        assert group.addParam(i, list((100 * i + 20).to_bytes(4, "little")))
    assert group.txPacket() == module.COMM_SUCCESS
    time.sleep(0.05)
    for i in IDS:
        good = (100 * i + 20, module.COMM_SUCCESS, 0)
        assert tried(partial(handler.read4ByteTxRx, port, i, 132), good) == good
    with server.lock:
        assert all(servo.torque for servo in server.bus.servos)


def test_the_sdk_hears_refusals_alerts_and_reboots(
    sdk: tuple[Any, Any, Any], server: PtyServer
) -> None:
    module, port, handler = sdk
    good = (module.COMM_SUCCESS, 6)
    assert tried(partial(handler.write4ByteTxRx, port, 3, GOAL, 5000), good) == good
    with server.lock:
        server.bus.servos[2].fail(0b100000)
    status = partial(handler.read1ByteTxRx, port, 3, 70)
    good = (0b100000, module.COMM_SUCCESS, 0x80)
    assert tried(status, good) == good
    assert handler.reboot(port, 3)[0] in (module.COMM_SUCCESS, module.COMM_RX_TIMEOUT)
    time.sleep(BOOT_TIME + 0.05)
    assert tried(status, (0, module.COMM_SUCCESS, 0)) == (0, module.COMM_SUCCESS, 0)


def test_our_master_over_a_serial_line(server: PtyServer) -> None:
    """Patience is for a busy machine here; what is measured is that every value comes."""
    pytest.importorskip("serial")
    port = SerialPort(server.path, 1_000_000)
    try:
        bus = Bus(port, Timing(gap=0.1, latest=0.5))
        for _ in range(20):
            answers = bus.read_all(IDS, MOTION, budget=2.0)
            assert positions(answers) == {i: 100 * i for i in IDS}
        assert bus.ping(19) == Value(bytes([1200 % 256, 1200 // 256, 52]), alert=False)
        with pytest.raises(PortError, match=f"could not open {server.path}"):
            SerialPort(server.path, 1_000_000)
    finally:
        port.close()


def test_L12_a_line_that_goes_away_is_a_port_error() -> None:
    pytest.importorskip("serial")
    with PtyServer(ServoBus(servos())) as server:
        port = SerialPort(server.path, 1_000_000)
        bus = Bus(port)
        bus.read_all(IDS, MOTION)
    with pytest.raises(PortError):
        bus.read_all(IDS, MOTION)
    port.close()


@pytest.mark.smoke
def test_B7_a_killed_program_leaves_a_robot_that_stops(server: PtyServer) -> None:
    """Servos slow enough to be on their way for seconds; 120 ms after the last packet all stand."""
    pytest.importorskip("serial")
    with server.lock:
        for servo in server.bus.servos:
            servo.set("profile_velocity", 10)
    client = Path(__file__).with_name("bus_client.py")
    command = [sys.executable, str(client), server.path]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as program:
        assert program.stdout is not None
        for _ in range(10):
            assert program.stdout.readline() == "cycle\n"
        program.kill()
    time.sleep(0.15)
    with server.lock:
        last = max(servo.last_fed for servo in server.bus.servos)
        server.bus.advance(last + 0.12)
        assert {servo.get("bus_watchdog") for servo in server.bus.servos} == {-1}
        server.bus.advance(last + 0.7)  # an XL330 comes to rest within 0.6 s
        stopped = [servo.position for servo in server.bus.servos]
        server.bus.advance(last + 10.0)
        assert [servo.position for servo in server.bus.servos] == stopped
        assert all(100 * i < p < 4000 for i, p in zip(IDS, stopped, strict=True))
