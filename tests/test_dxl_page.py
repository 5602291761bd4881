"""The examples of docs/dxl.md, as they stand there, before virtual servos in real time."""

from __future__ import annotations

import contextlib
import io
import time
from pathlib import Path

import pytest
from pages import Block, blocks
from test_servo_clients import served

from antennate.twin.servos import read_list
from dynamixel_bus.answers import SILENT, Span, Value
from dynamixel_bus.inquiry import read_some
from dynamixel_bus.models import XL330_M288, XL430_W250, servo_model

BLOCKS: dict[str, list[Block]] = {}
for _block in blocks("dxl.md"):
    BLOCKS.setdefault(_block.kind, []).append(_block)


def run(word: str, path: str = "") -> str:
    """Run the example that has a word, on a port; what it prints."""
    (block,) = (block.text for block in BLOCKS["python"] if word in block.text)
    said = io.StringIO()
    with contextlib.redirect_stdout(said):
        exec(block.replace("/dev/ttyUSB0", path).replace("t < 10.0", "t < 0.2"), {})
    return said.getvalue()


def test_values_come_in_the_order_of_their_servos_whoever_answers_late() -> None:
    class Late:
        """Servo 1 answers the second question alone."""

        times = 0

        def read_all(self, ids: list[int], span: Span, budget: float) -> dict[int, object]:
            self.times += 1
            value = Value(b"\x05\x00\x00\x00", alert=False)
            return {i: value if i != 1 or self.times > 1 else SILENT for i in ids}

        def settle(self) -> None:
            pass

    found = read_some(Late(), [1, 2], XL430_W250["present_position"])  # type: ignore[arg-type]
    assert [*found.items()] == [(1, 5), (2, 5)]


def test_servos_are_read_and_written() -> None:
    pytest.importorskip("serial")
    with served(XL430_W250, XL430_W250) as server:
        out = run("bus.scan()", server.path)
        time.sleep(0.2)
        with server.lock:
            assert [servo.get("goal_position") for servo in server.bus.servos] == [2500, 1500]
            assert [servo.torque for servo in server.bus.servos] == [True, False]
    assert "ids: [1, 2]" in out
    assert "positions: {1: 1300, 2: 1600}" in out
    assert "Value(data=b'', alert=False)" in out


def test_servos_are_read_in_a_loop() -> None:
    pytest.importorskip("serial")
    with served(XL430_W250, XL330_M288) as server:
        assert "Tally(misses=" in run("bus.read_all", server.path)


def test_virtual_servos_are_served() -> None:
    assert run("Server(ServoBus(servos))").startswith("/dev/")


def test_virtual_servos_are_asked_in_no_time() -> None:
    begin = time.monotonic()
    out = run("Trouble(Fault.LATE")
    assert time.monotonic() - begin < 0.5
    assert "data=b'\\x00\\x08\\x00\\x00'" in out  # 2048


def test_a_model_is_a_file(tmp_path: Path) -> None:
    (block,) = BLOCKS["toml"]
    path = tmp_path / block.title
    path.write_text(block.text)
    model = servo_model(path)
    assert (model.number, model["return_delay_time"].default) == (1070, 0)
    (entry,) = read_list([f"1:{path}"])
    assert entry.make().get("model_number") == 1070
    by_file = tmp_path / "box.toml"
    by_file.write_text(f'[[servo]]\nmodel = "{block.title}"\nid = 3\n')
    assert read_list([str(by_file)])[0].make().get("id") == 3


def test_every_example_of_the_page_is_run() -> None:
    assert len(BLOCKS["python"]) == 4
