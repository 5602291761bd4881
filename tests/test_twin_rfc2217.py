"""The twin as a serial line on the network: RFC 2217, by pyserial's own client."""

from __future__ import annotations

import json
import random
import select
import socket
import struct
import subprocess
import sys
from collections.abc import Callable
from typing import Any

import pytest

from antennate.dxl import packets
from antennate.hardware.esp32 import frame
from antennate.twin.config import TwinConfig, watched

serial = pytest.importorskip("serial")

from antennate.dxl.endpoints import Rfc2217Endpoint  # noqa: E402

IAC, SB, SE, COM_PORT, SET_CONTROL = 255, 250, 240, 44, 5
"""Bytes of Telnet (RFC 854) and of RFC 2217."""
DTR_ON, DTR_OFF, RTS_ON, RTS_OFF = 8, 9, 11, 12


def control(what: int) -> bytes:
    return bytes([IAC, SB, COM_PORT, SET_CONTROL, what, IAC, SE])


def boots(data: bytes) -> list[int]:
    """Boot ids of the greetings in a stream of the board."""
    bodies = [frame.unstuff(chunk) for chunk in data.split(b"\0") if chunk]
    greetings = [body for body in bodies if body and body[1] == frame.HELLO]
    return [struct.unpack_from(frame.HELLO_LAYOUT, body)[2] for body in greetings]


def reach(end: Rfc2217Endpoint) -> socket.socket:
    """A client that the end has taken."""
    host, _, port = end.path.removeprefix("rfc2217://").partition(":")
    client = socket.create_connection((host, int(port)))
    assert select.select([end], [], [], 1.0)[0]
    end.read()
    return client


def heard(end: Rfc2217Endpoint, client: socket.socket, data: bytes) -> bytes:
    """What the end takes for data of what a client sends."""
    client.sendall(data)
    assert select.select([end], [], [], 1.0)[0]
    return end.read()


def test_data_and_commands_are_told_apart() -> None:
    states: list[tuple[bool, bool]] = []
    end = Rfc2217Endpoint("127.0.0.1", 0, lambda dtr, rts: states.append((dtr, rts)))
    client = reach(end)
    assert states == [(True, True)]  # both in one step, as Linux does when a line is opened
    assert end.baud() is None
    speed = bytes([IAC, SB, COM_PORT, 1, *(57_600).to_bytes(4, "big"), IAC, SE])
    assert heard(end, client, b"a" + speed + b"\xff\xff" + control(DTR_OFF) + b"b") == b"a\xffb"
    assert end.baud() == 57_600
    assert states[1:] == [(False, True)]
    assert heard(end, client, control(DTR_ON)[:3]) + heard(end, client, control(DTR_ON)[3:]) == b""
    client.recv(4096)
    end.write(b"\xff\xff\xfd\0")
    assert client.recv(4096).endswith(b"\xff" * 4 + b"\xfd\0")
    client.close()
    assert select.select([end], [], [], 1.0)[0]
    end.read()
    assert states[2:] == [(True, True), (False, False)]
    end.close()


def test_a_client_that_sends_nonsense_is_sent_away_and_the_next_one_served() -> None:
    end = Rfc2217Endpoint("127.0.0.1", 0)
    chance = random.Random(1)
    known = [IAC, SB, SE, COM_PORT, 251, 253, *range(13)]
    for data in (
        bytes([IAC, SE]),
        bytes([IAC, SB, COM_PORT, 1, IAC, SE]),
        bytes([IAC, SB, COM_PORT, 3, 99, IAC, SE]),
        bytes([IAC, SB]) + bytes(200),
        *(bytes(chance.choices(known, k=300)) for _ in range(100)),
    ):
        client = reach(end)
        client.sendall(data)
        assert select.select([end], [], [], 1.0)[0]
        end.read()
        client.close()
        while end.read() or select.select([end], [], [], 0.01)[0]:
            pass
    client = reach(end)
    assert heard(end, client, b"sound") == b"sound"
    client.close()
    end.close()


@pytest.mark.parametrize(
    ("states", "sends", "new"),
    [
        ([(True, True), (False, False)], True, 0),
        ([(True, True), (False, True)], False, 0),
        ([(True, True), (False, True), (False, False)], True, 1),
        ([(True, False)], False, 0),
        ([(True, False), (False, False)], False, 0),
        ([(False, True), (True, False), (False, False)], False, 0),
        ([(False, True), (True, True)], True, 1),
    ],
)
def test_E3_modem_lines_reset_the_board_as_the_circuit_of_the_usual_one_does(
    states: list[tuple[bool, bool]], sends: bool, new: int
) -> None:
    """RTS alone holds EN low; DTR alone presses BOOT, which ends its stream until a reset.

    Espressif's circuit for automatic programming; BOOT while EN rises loads no program at all.
    """
    robot = watched(TwinConfig())[0]
    robot.advance(0.1)
    before = boots(robot.take())
    for state in states:
        robot.set_lines(*state)
    robot.advance(2.6)
    data = robot.take()
    assert bool(data) == sends
    assert len({*boots(data)} - {*before}) == new


def test_modem_lines_do_not_wake_a_dead_board() -> None:
    robot = watched(TwinConfig())[0]
    robot.break_board("silent")
    robot.take()
    for state in ((False, True), (False, False)):
        robot.set_lines(*state)
    robot.advance(2.0)
    assert robot.take() == b""


@pytest.mark.ci
@pytest.mark.filterwarnings("ignore:set(Daemon|Name):DeprecationWarning")  # within pyserial
def test_E3_a_client_of_pyserial_resets_the_twins_board_and_sets_the_speed_of_its_bus() -> None:
    command = [sys.executable, "-m", "antennate", "twin", "--rfc2217", "0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as twin:
        try:
            assert twin.stdout is not None
            places = json.loads(twin.stdout.readline())
            _reset(places["esp32"])
            _speed(places["bus"])
        finally:
            twin.terminate()
            twin.communicate()


def _reset(address: str) -> None:
    with serial.serial_for_url(address, 115_200, timeout=3.0) as line:
        (before,) = boots(_until_hello(line))
        line.dtr = False
        line.rts = False
        (after,) = boots(_until_hello(line, no=before))
        assert after != before


def _until_hello(line: Any, no: int | None = None) -> bytes:
    """The frame of the next greeting, but for those of a boot id."""
    line.timeout = 5.0
    while True:
        data = line.read_until(b"\0")
        assert data, "the board is silent"
        if {*boots(data)} - {no}:
            return data


def _speed(address: str) -> None:
    with serial.serial_for_url(address, 1_000_000, timeout=3.0) as line:
        line.write(packets.ping(3))
        assert len(line.read(14)) == 14
        line.baudrate = 57_600
        line.timeout = 0.2
        line.write(packets.ping(3))
        assert line.read(14) == b""


def test_only_one_kind_of_tcp_end_is_served(refused: Callable[..., str]) -> None:
    assert "--rfc2217: expected none beside --tcp, found both" in refused(
        "twin", "--tcp", "0", "--rfc2217", "0"
    )
    assert "--rfc2217: expected [HOST:]PORT" in refused(
        "twin", "--servos", "1:xl330-m288", "--rfc2217", "x"
    )
