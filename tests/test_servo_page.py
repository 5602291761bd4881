"""The examples of docs/twin.md, as they stand there, before servos in real time."""

from __future__ import annotations

import contextlib
import io
import re
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from test_servo_clients import Moving, served, stub

from dynamixel_bus.models import XC430_W240, XL330_M288, XL430_W250

PAGE = Path(__file__).parents[1] / "docs" / "twin.md"
SECTION = PAGE.read_text().partition("\n## Servos without a robot\n")[2]
BLOCKS = re.findall(r"```python\n(.*?)```", SECTION, flags=re.DOTALL)


@pytest.fixture(autouse=True)
def patient(monkeypatch: pytest.MonkeyPatch) -> None:
    """The SDK waits half a second for an answer and not 34 ms: machines are busy."""
    module = pytest.importorskip("dynamixel_sdk.port_handler")
    monkeypatch.setattr(module, "LATENCY_TIMER", 500)


def run(word: str, server: Moving, **more: Any) -> str:
    """Run the example that has a word; what it prints."""
    (block,) = (block for block in BLOCKS if word in block)
    said = io.StringIO()
    with contextlib.redirect_stdout(said):
        exec(block.replace("/dev/pts/2", server.path), more)
    return said.getvalue()


@pytest.fixture
def turned(monkeypatch: pytest.MonkeyPatch) -> Iterator[Moving]:
    """Two servos that somebody turns while LeRobot looks, who then presses Enter."""
    pytest.importorskip("lerobot", reason="docs/twin.md says how to install it")
    stub(monkeypatch, "torch", "accelerate", "datasets", "datasets.utils", "datasets.utils.logging")
    common = pytest.importorskip("lerobot.motors.motors_bus")
    with served(XL330_M288, XL330_M288, million=True) as server:
        turns = iter([1000.0, 3000.0, 2047.0])

        def enter_pressed() -> bool:
            turn = next(turns, None)
            with server.lock:
                for servo in server.bus.servos if turn is not None else ():
                    servo.place(turn)
            return turn is None

        monkeypatch.setattr(common, "enter_pressed", enter_pressed)
        yield server


def test_lerobot(turned: Moving) -> None:
    run("DynamixelMotorsBus", turned)
    time.sleep(0.1)
    with turned.lock:
        servos = turned.bus.servos
        assert [servo.get("goal_position") for servo in servos] == [2500, 1500]
        assert [servo.get("homing_offset") for servo in servos] == [2047 - 1300, 2047 - 1600]
        assert not any(servo.torque for servo in servos)


def test_the_sdk() -> None:
    with served(XC430_W240) as server:
        with server.lock:
            server.bus.servos[0].set("return_delay_time", 7)
        run("regWriteTxRx", server)
        time.sleep(0.4)
        with server.lock:
            servo = server.bus.servos[0]
            assert servo.get("return_delay_time") == 250
            assert servo.position > 1300  # it had begun to go to 3000


def test_the_easy_layer() -> None:
    with served(XL330_M288) as server:
        run("dynamixel_easy_sdk", server)
        time.sleep(1.5)
        with server.lock:
            assert server.bus.servos[0].get("present_velocity") == pytest.approx(100, abs=2)


def test_rustypot() -> None:
    pytest.importorskip("rustypot")
    with served(XL330_M288, XL430_W250) as server:
        with server.lock:
            server.bus.servos[1].set("position_p_gain", 3)
        run("rustypot", server)
        time.sleep(0.4)
        with server.lock:
            servo = server.bus.servos[1]
            assert (servo.get("id"), servo.get("position_p_gain")) == (2, 640)
            assert not servo.torque


def test_every_example_of_the_page_is_run() -> None:
    assert len(BLOCKS) == 4
