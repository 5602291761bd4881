"""Every example packet of the manual, byte for byte: made, understood, and answered by the twin.

Source: https://emanual.robotis.com/docs/en/dxl/protocol2/, the examples of each instruction. One is
a misprint there: the CRC of Fast Bulk Read is that of Fast Sync Read, 20 F2. The one here is right.
"""

from __future__ import annotations

import itertools
from typing import Any

import pytest
from servo_rig import Rig

from dynamixel_bus import packets
from dynamixel_bus.answers import Refused, Span
from dynamixel_bus.models import XC430_W240
from dynamixel_bus.packets import BROADCAST, Instruction, Packet, Status, StatusError
from dynamixel_bus.parser import Parser
from dynamixel_bus.servo import Servo
from dynamixel_bus.servo_bus import ServoBus

ASKED: dict[str, tuple[str, int, Instruction, str]] = {
    "ping": ("FF FF FD 00 01 03 00 01 19 4E", 1, Instruction.PING, ""),
    "ping all": ("FF FF FD 00 FE 03 00 01 31 42", BROADCAST, Instruction.PING, ""),
    "read": (
        "FF FF FD 00 01 07 00 02 84 00 04 00 1D 15",
        1,
        Instruction.READ,
        "84 00 04 00",
    ),
    "write": (
        "FF FF FD 00 01 09 00 03 74 00 00 02 00 00 CA 89",
        1,
        Instruction.WRITE,
        "74 00 00 02 00 00",
    ),
    "reg write": (
        "FF FF FD 00 01 09 00 04 68 00 C8 00 00 00 AE 8E",
        1,
        Instruction.REG_WRITE,
        "68 00 C8 00 00 00",
    ),
    "action": ("FF FF FD 00 01 03 00 05 02 CE", 1, Instruction.ACTION, ""),
    "factory reset": ("FF FF FD 00 01 04 00 06 01 A1 E6", 1, Instruction.FACTORY_RESET, "01"),
    "reboot": ("FF FF FD 00 01 03 00 08 2F 4E", 1, Instruction.REBOOT, ""),
    "clear": (
        "FF FF FD 00 01 08 00 10 01 44 58 4C 22 B1 DC",
        1,
        Instruction.CLEAR,
        "01 44 58 4C 22",
    ),
    "sync read": (
        "FF FF FD 00 FE 09 00 82 84 00 04 00 01 02 CE FA",
        BROADCAST,
        Instruction.SYNC_READ,
        "84 00 04 00 01 02",
    ),
    "sync write": (
        "FF FF FD 00 FE 11 00 83 74 00 04 00 01 96 00 00 00 02 AA 00 00 00 82 87",
        BROADCAST,
        Instruction.SYNC_WRITE,
        "74 00 04 00 01 96 00 00 00 02 AA 00 00 00",
    ),
    "fast sync read": (
        "FF FF FD 00 FE 0A 00 8A 84 00 04 00 03 07 04 20 F2",
        BROADCAST,
        Instruction.FAST_SYNC_READ,
        "84 00 04 00 03 07 04",
    ),
    "bulk read": (
        "FF FF FD 00 FE 0D 00 92 01 90 00 02 00 02 92 00 01 00 1A 05",
        BROADCAST,
        Instruction.BULK_READ,
        "01 90 00 02 00 02 92 00 01 00",
    ),
    "bulk write": (
        "FF FF FD 00 FE 10 00 93 01 20 00 02 00 A0 00 02 1F 00 01 00 50 B7 68",
        BROADCAST,
        Instruction.BULK_WRITE,
        "01 20 00 02 00 A0 00 02 1F 00 01 00 50",
    ),
    "fast bulk read": (
        "FF FF FD 00 FE 12 00 9A 03 84 00 04 00 07 7C 00 02 00 04 92 00 01 00 DA 2D",
        BROADCAST,
        Instruction.FAST_BULK_READ,
        "03 84 00 04 00 07 7C 00 02 00 04 92 00 01 00",
    ),
}
MADE = {
    "ping": packets.ping(1),
    "ping all": packets.ping(),
    "read": packets.read(1, 132, 4),
    "write": packets.write(1, 116, b"\0\2\0\0"),
    "reboot": packets.reboot(1),
    "clear": packets.clear(1),
    "sync read": packets.sync_read([1, 2], 132, 4),
    "sync write": packets.sync_write(116, {1: b"\x96\0\0\0", 2: b"\xaa\0\0\0"}),
    "fast sync read": packets.fast_sync_read([3, 7, 4], 132, 4),
}
"""Requests that have a function of their own."""
SAID: dict[str, tuple[str, int, str]] = {
    "ping 1": ("FF FF FD 00 01 07 00 55 00 06 04 26 65 5D", 1, "06 04 26"),
    "ping 2": ("FF FF FD 00 02 07 00 55 00 06 04 26 6F 6D", 2, "06 04 26"),
    "read 1": ("FF FF FD 00 01 08 00 55 00 A6 00 00 00 8C C0", 1, "A6 00 00 00"),
    "read 2": ("FF FF FD 00 02 08 00 55 00 1F 08 00 00 BA BE", 2, "1F 08 00 00"),
    "done": ("FF FF FD 00 01 04 00 55 00 A1 0C", 1, ""),
    "bulk 1": ("FF FF FD 00 01 06 00 55 00 77 00 C3 69", 1, "77 00"),
    "bulk 2": ("FF FF FD 00 02 05 00 55 00 24 8B A9", 2, "24"),
}
"""Packets in which one servo answers: id and data."""
FAST = {
    "sync": [
        "FF FF FD 00 FE 19 00 55 00 03 A6 00 00 00 84 08",
        "00 07 1F 08 00 00 16 CA",
        "00 04 FF 03 00 00 D1 9E",
    ],
    "bulk": [
        "FF FF FD 00 FE 14 00 55 00 03 A6 00 00 00 67 A4",
        "00 07 A5 01 24 74",
        "00 04 1F D9 C1",
    ],
}
"""Replies in which several servos answer together, one piece a servo."""
ANSWERED = {
    "ping": ["ping 1"],
    "ping all": ["ping 1", "ping 2"],
    "read": ["read 1"],
    "write": ["done"],
    "reg write": ["done"],
    "action": ["done"],
    "factory reset": ["done"],
    "reboot": ["done"],
    "clear": ["done"],
    "sync read": ["read 1", "read 2"],
    "sync write": [],
    "bulk read": ["bulk 1", "bulk 2"],
    "bulk write": [],
}
"""What the twin says to each."""


def twin(firmware: int = 38) -> ServoBus:
    """Servos with the model, firmware and positions of the examples."""
    made = []
    for name, position in ((1, 166), (2, 2079), (3, 166), (7, 2079), (4, 1023)):
        servo = Servo(XC430_W240, name, position)
        servo.set("return_delay_time", 0)
        servo.set("model_number", 1030)
        servo.set("firmware_version", firmware)
        servo.set("present_input_voltage", 119 if name == 1 else 111)
        servo.set("present_temperature", {2: 36, 4: 31}.get(name, 25))
        servo.advance(1e-6)  # it rests from now on, and has told so
        servo.read(120, 28)
        if name == 7:
            servo.memory.show("present_pwm", 421)
        made.append(servo)
    return ServoBus(made)


def answer_to(bus: ServoBus, request: bytes) -> bytes:
    bus.receive(0.0, request)
    return bus.transmit(1.0)


@pytest.mark.parametrize("name", ASKED)
def test_a_request_of_the_manual_is_made_and_understood(name: str) -> None:
    printed, servo, instruction, params = ASKED[name]
    wire = bytes.fromhex(printed)
    assert packets.encode(servo, instruction, bytes.fromhex(params)) == wire
    assert MADE.get(name, wire) == wire
    assert Parser().feed(wire) == [Packet(servo, instruction, bytes.fromhex(params))]


@pytest.mark.parametrize("name", SAID)
def test_an_answer_of_the_manual_is_made_and_understood(name: str) -> None:
    printed, servo, data = SAID[name]
    wire, said = bytes.fromhex(printed), Status(servo, StatusError.NONE, False, bytes.fromhex(data))
    assert packets.status(said) == wire
    assert [packets.as_status(packet) for packet in Parser().feed(wire)] == [said]


@pytest.mark.parametrize("name", FAST)
def test_each_crc_of_a_fast_reply_of_the_manual_is_that_of_all_bytes_before_it(name: str) -> None:
    whole = b""
    for piece in map(bytes.fromhex, FAST[name]):
        whole += piece
        assert packets.crc16(whole[:-2]) == int.from_bytes(piece[-2:], "little")
    assert len(whole) == 7 + int.from_bytes(whole[5:7], "little")


def sdk_crc(data: bytes) -> bytes:
    sdk: Any = pytest.importorskip("dynamixel_sdk")
    return sdk.PacketHandler(2.0).updateCRC(0, list(data), len(data)).to_bytes(2, "little")


def test_the_manufacturers_program_finds_the_same_crcs() -> None:
    printed = [packet[0] for packet in (*ASKED.values(), *SAID.values())]
    printed += ["".join(pieces[: n + 1]) for pieces in FAST.values() for n in range(len(pieces))]
    for wire in map(bytes.fromhex, printed):
        assert sdk_crc(wire[:-2]) == wire[-2:]


@pytest.mark.parametrize("name", ANSWERED)
def test_the_twin_answers_a_request_of_the_manual_as_the_manual_says(name: str) -> None:
    bus = twin()
    if name.startswith("ping"):
        del bus.servos[2:]
    if name == "action":
        bus.servos[0].registered = (104, bytes.fromhex("C8 00 00 00"))
    expected = b"".join(bytes.fromhex(SAID[said][0]) for said in ANSWERED[name])
    assert answer_to(bus, bytes.fromhex(ASKED[name][0])) == expected
    if name == "sync write":
        assert [servo.get("goal_position") for servo in bus.servos[:2]] == [150, 170]
    if name == "bulk write":
        assert bus.servos[0].get("max_voltage_limit") == 160
        assert bus.servos[1].get("temperature_limit") == 80
    if name in ("reg write", "action"):
        assert bus.servos[0].get("registered_instruction") == (name == "reg write")
        assert bus.servos[0].get("goal_velocity") == (200 if name == "action" else 0)


@pytest.mark.parametrize("kind", FAST)
def test_the_twin_answers_a_fast_read_as_the_manual_says(kind: str) -> None:
    expected = bytes.fromhex("".join(FAST[kind]))
    bus = twin(firmware=45)  # 38, which answers the ping, takes no fast read
    assert answer_to(bus, bytes.fromhex(ASKED[f"fast {kind} read"][0])) == expected


@pytest.mark.parametrize(("number", "alert"), list(itertools.product(range(8), (0, 0x80))))
def test_every_error_number_and_the_alert_bit(number: int, alert: int) -> None:
    """As made by hand and by the CRC of the manufacturer's program."""
    wire = bytes.fromhex("FF FF FD 00 05 04 00 55") + bytes([number | alert])
    wire += sdk_crc(wire)
    said = Status(5, StatusError(number), bool(alert), b"")
    assert packets.status(said) == wire
    assert [packets.as_status(packet) for packet in Parser().feed(wire)] == [said]


def test_the_twin_gives_each_error_for_its_reason_and_the_master_hears_it() -> None:
    """All but the CRC error: a servo does not answer to what it cannot have understood."""
    rig = Rig()
    rig.servo(2).fail(0b100000)
    given = {
        rig.bus.write(2, 64, b"\1"),
        rig.bus.clear(4),
        rig.bus.write(4, 65, b"\7"),
        rig.bus.write(4, 116, bytes(2)),
        rig.bus.write(4, 116, (9999).to_bytes(4, "little")),
        rig.bus.read(4, Span(66, 1)),
    }
    refused = {(said.error, said.alert) for said in given if isinstance(said, Refused)}
    assert refused == {
        (StatusError.RESULT_FAIL, True),
        (StatusError.DATA_RANGE, False),
        (StatusError.DATA_LENGTH, False),
        (StatusError.DATA_LIMIT, False),
        (StatusError.ACCESS, False),
    }
