"""Programs of other people, unchanged, before twin servos; what they do is as the manual says.

LeRobot and dynio are not among the locked dependencies, because what they need themselves is not
used here; docs/twin.md says how to install them alone. Without them their tests are skipped.
Modules that they import for other purposes are stubs here.
"""

from __future__ import annotations

import importlib
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import ModuleType
from typing import Any
from unittest.mock import MagicMock

import pytest
from pty_server import PtyServer

from dynamixel_bus.model import ServoModel
from dynamixel_bus.models import XC430_W240, XL330_M288, XL430_W250
from dynamixel_bus.servo import Servo
from dynamixel_bus.servo_bus import ServoBus

RPM = 0.229
FACTORY_BAUD = 57_600


def servos(*tables: ServoModel, million: bool = False) -> list[Servo]:
    """New servos with ids from 1 on, at 57600 bit/s or at a million."""
    made = [Servo(table, n, position=1000.0 + 300 * n) for n, table in enumerate(tables, 1)]
    for servo in made:
        servo.set("baud_rate", 3 if million else 1)
    return made


class Moving(PtyServer):
    """Serves servos that also move on while nobody asks."""

    def __enter__(self) -> Moving:
        super().__enter__()
        self._over = threading.Event()
        self._mover = threading.Thread(target=self._move, daemon=True)
        self._mover.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
        self._mover.join()
        super().__exit__()

    def _move(self) -> None:
        while not self._over.wait(0.02):
            with self.lock:
                self.bus.advance(self.now())


@contextmanager
def served(*tables: ServoModel, million: bool = False) -> Iterator[Moving]:
    interval = sys.getswitchinterval()
    sys.setswitchinterval(1e-4)
    with Moving(ServoBus(servos(*tables, million=million))) as server:
        yield server
    sys.setswitchinterval(interval)


def eventually(call: Callable[[], Any], good: Callable[[Any], bool]) -> Any:
    """What it returns once that is good, asked for a few seconds: machines are busy."""
    found: Any = None
    for _ in range(60):
        try:
            found = call()
        except Exception as error:  # noqa: BLE001  (each client has errors of its own)
            found = error
        else:
            if good(found):
                return found
        time.sleep(0.05)
    raise AssertionError(found)


# the manufacturer's SDK


@pytest.fixture
def sdk() -> Iterator[tuple[Any, Any, Any, Moving]]:
    module = pytest.importorskip("dynamixel_sdk")
    with served(XC430_W240, XL430_W250) as server:
        port = module.PortHandler(server.path)
        assert port.openPort()
        assert port.setBaudRate(FACTORY_BAUD)
        yield module, port, module.PacketHandler(2.0), server
        port.closePort()


def test_the_sdk_writes_and_reads_in_bulk(sdk: tuple[Any, Any, Any, Moving]) -> None:
    module, port, handler, _ = sdk
    write = module.GroupBulkWrite(port, handler)
    assert write.addParam(1, 65, 1, [1])
    assert write.addParam(2, 116, 4, list((1700).to_bytes(4, "little")))
    read = module.GroupBulkRead(port, handler)
    assert read.addParam(1, 65, 1)
    assert read.addParam(2, 116, 4)
    for fast in (False, True):
        assert write.txPacket() == module.COMM_SUCCESS
        call = getattr(read, "fastBulkRead" if fast else "txRxPacket", read.txRxPacket)
        eventually(call, lambda result: result == module.COMM_SUCCESS)
        assert (read.getData(1, 65, 1), read.getData(2, 116, 4)) == (1, 1700)


def test_the_sdk_registers_a_write_and_lets_both_act_at_once(
    sdk: tuple[Any, Any, Any, Moving],
) -> None:
    module, port, handler, server = sdk
    for servo in (1, 2):
        eventually(lambda i=servo: handler.write1ByteTxRx(port, i, 64, 1), lambda r: r == (0, 0))
        goal = list((2500).to_bytes(4, "little"))
        eventually(
            lambda i=servo, g=goal: handler.regWriteTxRx(port, i, 116, 4, g), lambda r: r == (0, 0)
        )
    with server.lock:
        assert [s.get("registered_instruction") for s in server.bus.servos] == [1, 1]
        assert [s.get("moving") for s in server.bus.servos] == [0, 0]
    handler.action(port, module.BROADCAST_ID)
    for servo in (1, 2):
        eventually(lambda i=servo: handler.read4ByteTxRx(port, i, 132)[0], lambda p: p == 2500)


@pytest.mark.parametrize(("option", "left"), [(0xFF, (1, 1)), (0x01, (7, 1)), (0x02, (7, 3))])
def test_the_sdk_resets_a_servo_to_what_it_was_delivered_with(
    sdk: tuple[Any, Any, Any, Moving], option: int, left: tuple[int, int]
) -> None:
    _, port, handler, server = sdk
    with server.lock:
        server.bus.servos[0].set("id", 7)
        server.bus.servos[0].set("baud_rate", 3)
        server.bus.servos[0].set("return_delay_time", 9)
        del server.bus.servos[1:]
    assert port.setBaudRate(1_000_000)

    def is_reset(_: object) -> bool:
        with server.lock:
            return server.bus.servos[0].get("return_delay_time") == 250

    # its answer may come too late for the client; a servo that is reset answers no second time
    eventually(lambda: handler.factoryReset(port, 7, option), is_reset)
    time.sleep(0.3)
    servo, code = left
    assert port.setBaudRate({1: FACTORY_BAUD, 3: 1_000_000}[code])
    eventually(lambda: handler.read1ByteTxRx(port, servo, 9), lambda r: r == (250, 0, 0))


# LeRobot


def stub(monkeypatch: pytest.MonkeyPatch, *names: str) -> None:
    """Let heavy modules be imported that nothing here calls."""
    for name in names:
        made = ModuleType(name)
        made.__getattr__ = lambda _: MagicMock()  # type: ignore[method-assign]
        monkeypatch.setitem(sys.modules, name, made)


@pytest.fixture
def lerobot(monkeypatch: pytest.MonkeyPatch) -> Any:
    pytest.importorskip("lerobot", reason="see the top of the file")
    stub(monkeypatch, "torch", "accelerate", "datasets", "datasets.utils", "datasets.utils.logging")
    for name in [n for n in sys.modules if n.split(".")[0] == "lerobot"]:
        monkeypatch.delitem(sys.modules, name)
    return importlib.import_module("lerobot.motors.motors_bus"), importlib.import_module(
        "lerobot.motors.dynamixel"
    )


def test_lerobot_finds_a_new_servo_and_gives_it_id_and_speed(lerobot: Any) -> None:
    common, dynamixel = lerobot
    motor = common.Motor(6, "xl330-m288", common.MotorNormMode.DEGREES)
    with served(XL330_M288) as server:
        bus = dynamixel.DynamixelMotorsBus(server.path, {"gripper": motor})
        eventually(lambda: bus.setup_motor("gripper") is None, bool)
        with server.lock:
            servo = server.bus.servos[0]
            assert (servo.get("id"), servo.get("baud_rate")) == (6, 3)
        assert eventually(lambda: bus.ping("gripper"), lambda n: n == 1200)
        bus.disconnect(disable_torque=False)


# dynio


def test_dynio_turns_a_servo_at_a_speed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its table of the MX-28 has the same addresses under Protocol 2.0."""
    pytest.importorskip("dynamixel_sdk")
    stub(monkeypatch, "pkg_resources")
    monkeypatch.setitem(sys.modules, "deprecation", MagicMock())
    dynio = pytest.importorskip("dynio.dynamixel_controller", reason="see the top of the file")
    table = f"{dynio.__file__.rpartition('/')[0]}/DynamixelJSON/MX28.json"
    with served(XC430_W240) as server:
        line = dynio.DynamixelIO(server.path, FACTORY_BAUD)
        motor = line.new_motor(1, table, protocol=2, control_table_protocol=2)

        def turn() -> int:
            """Its speed; what got no answer is printed, so all is said again."""
            if motor.read_control_table("Operating_Mode") != 1:
                motor.torque_disable()
                motor.set_velocity_mode()
            motor.torque_enable()
            motor.set_velocity(-50)
            return motor.read_control_table("Present_Velocity")

        eventually(turn, lambda speed: speed in (2**32 - 50, -50))
        line.port_handler.closePort()
