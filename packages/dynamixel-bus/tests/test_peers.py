"""rustypot, a program of other people, drives the twin's 19 servos over a pseudo-terminal.

The manufacturer's own program does so in `test_virtual_servos.py`. Both are used as they are.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from typing import Any

import pytest
from pty_server import PtyServer, tried
from servo_rig import IDS, MODELS, servos

from dynamixel_bus.packets import ALERT
from dynamixel_bus.servo_bus import Fault, ServoBus, Trouble

POSITION, GOAL = 132, 116
TRUE = [100 * i for i in IDS]
TIMEOUT = 0.1
"""What the other program waits for an answer [s]: generous, for a busy machine."""


@pytest.fixture
def server() -> Iterator[PtyServer]:
    interval = sys.getswitchinterval()
    sys.setswitchinterval(1e-4)
    with PtyServer(ServoBus(servos())) as serving:
        yield serving
    sys.setswitchinterval(interval)


@pytest.fixture
def peer(server: PtyServer) -> Iterator[Any]:
    """Its controller for XL430 servos; the twin's two models have the same registers here."""
    module = pytest.importorskip("rustypot")
    controller = module.Xl430PyController(server.path, 1_000_000, TIMEOUT)
    yield controller
    controller.close()


def ticks(read: list[Any]) -> list[int]:
    return [int.from_bytes(bytes(data), "little") for data in read]


def test_rustypot_pings_19_servos(peer: Any) -> None:
    for i in IDS:
        assert tried(lambda i=i: peer.ping(i), True) is True
    peer.set_timeout(0.01)
    assert peer.ping(42) is False


@pytest.mark.parametrize("how", ["scan", "broadcast_scan"])
def test_rustypot_finds_19_servos_and_their_models(peer: Any, how: str) -> None:
    assert tried(lambda: getattr(peer, how)(IDS), MODELS) == MODELS


@pytest.mark.parametrize("fast", [False, True])
def test_rustypot_reads_19_servos(peer: Any, fast: bool) -> None:
    peer.set_fast_sync_read(fast)
    assert tried(lambda: peer.sync_read_present_position(IDS), TRUE) == TRUE
    assert tried(lambda: ticks(peer.sync_read_raw_data(IDS, POSITION, 4)), TRUE) == TRUE


def test_rustypot_writes_goals_and_the_servos_go_there(peer: Any, server: PtyServer) -> None:
    goals = [100 * i + 20 for i in IDS]
    peer.sync_write_torque_enable(IDS, [True] * 19)
    peer.sync_write_raw_data(IDS, GOAL, [list(goal.to_bytes(4, "little")) for goal in goals])
    time.sleep(0.7)  # an XL330 comes to rest within 0.6 s
    found = tried(lambda: ticks(peer.sync_read_raw_data(IDS, POSITION, 4)), goals)
    assert found == pytest.approx(goals, abs=1)
    with server.lock:
        assert all(servo.torque for servo in server.bus.servos)


def test_rustypot_hears_alerts_and_reboots(peer: Any, server: PtyServer) -> None:
    with server.lock:
        server.bus.servos[2].fail(0b100000)

    def errors() -> tuple[bytes, int]:
        data, error = peer.read_raw_data_with_error(3, 70, 1)
        return bytes(data), error

    assert tried(errors, (b"\x20", ALERT)) == (b"\x20", ALERT)
    assert tried(lambda: peer.reboot(3), True) is not False
    time.sleep(0.3)
    assert tried(errors, (b"\0", 0)) == (b"\0", 0)


def test_rustypot_gives_no_value_when_one_servo_is_silent(peer: Any, server: PtyServer) -> None:
    """Why this project has a master of its own: the 18 that answered are lost with the one."""
    with server.lock:
        server.bus.trouble[7] = Trouble(Fault.SILENT)
    with pytest.raises(RuntimeError):
        peer.sync_read_present_position(IDS)
