"""The inertial sensor of the board: its driver, and frames that carry its readings."""

from __future__ import annotations

import shutil
import struct
import sys
import zlib
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from esp32_board import INERTIAL, WHOLE_PROGRAM, Board, Lsm6dsox
from esp32_streams import BOOT, framed
from test_firmware import FIRMWARE, Program, load, on_micropython, program, sent

from antennate.hardware.esp32 import frame
from antennate.hardware.esp32.wire import FrameDecoder, Refused, Sample

__all__ = ["program"]  # a fixture
AXES = (-2, 1, 3)
"""A sensor turned by a quarter to the right: its y points backward, its x to the left."""
FELT = (2, 1, 3, -500, -400, -32767)
"""What it reads then, along the axes of the head."""
NONE = (frame.IMU_NONE,) * 6


@pytest.fixture
def inertial(program: Program, monkeypatch: pytest.MonkeyPatch) -> Any:
    """main.py on a board with an inertial sensor, and its bus."""

    def start(board: Board, rate: int = 100) -> tuple[ModuleType, Lsm6dsox]:
        main, bus = program(board), Lsm6dsox()
        config = sys.modules["config"]
        config.__dict__.update(PIN_SDA=21, PIN_SCL=22, IMU_AXES=AXES, RATE=rate)
        machine = sys.modules["machine"]
        machine.__dict__["I2C"] = lambda number, scl, sda, freq, timeout: bus
        monkeypatch.setitem(sys.modules, "imu", load(FIRMWARE / "imu.py", "imu"))
        return main, bus

    return start


def test_its_readings_come_along_the_axes_of_the_head(inertial: Any) -> None:
    board = Board()
    main, bus = inertial(board)
    main.main()
    greetings, samples = sent(board)
    assert {(found.imu, found.misses) for found in samples} == {(FELT, 0)}
    assert [found.seq for found in samples] == list(range(len(samples)))
    settings = struct.pack("<HHBBBBBbbb", 100, 15, 34, 35, 21, 22, 0x6A, *AXES)
    assert greetings[0].config_hash == zlib.crc32(settings)
    # lsm6dsox_reg.h: BDU and IF_INC; 104 Hz and 8 g; 104 Hz and 1000 deg/s
    assert bus.registers == {0x12: 0x44, 0x10: 0x4C, 0x11: 0x48}


@pytest.mark.parametrize(("rate", "code"), [(50, 4), (104, 4), (200, 5), (833, 8)])
def test_it_measures_at_least_as_often_as_it_is_read(inertial: Any, rate: int, code: int) -> None:
    main, bus = inertial(Board(), rate)
    sensor = main.inertial()
    sensor.read_into([0] * 6, 0)
    assert {bus.registers[0x10] >> 4, bus.registers[0x11] >> 4} == {code}


def test_one_that_falls_silent_is_marked_counted_and_begun_again(inertial: Any) -> None:
    main, bus = inertial(Board())
    sensor, target = main.inertial(), [0] * 6
    found = list[tuple[int, ...]]()
    for tick in range(250):
        bus.silent = 20 <= tick < 60
        if tick == 20:
            bus.registers.clear()
        sensor.read_into(target, 0)
        found.append(tuple(target))
    assert found[:20] == [FELT] * 20
    assert found[20:120] == [NONE] * 100
    assert found[121:] == [FELT] * 129
    assert 100 <= sensor.misses <= 101
    assert len(bus.registers) == 3  # it had lost its settings


def test_another_part_is_not_taken_for_it(inertial: Any) -> None:
    main, bus = inertial(Board())
    bus.identity = 0x68
    sensor, target = main.inertial(), [0] * 6
    for _ in range(5):
        sensor.read_into(target, 0)
    assert tuple(target) == NONE
    assert bus.tries == 1
    assert not bus.registers


def test_one_pin_without_the_other_is_an_error(program: Program) -> None:
    main = program(Board())
    sys.modules["config"].__dict__["PIN_SDA"] = 21
    with pytest.raises(ValueError, match="both of PIN_SDA and PIN_SCL, or neither, found one"):
        main.main()


def test_the_frame_has_its_layout() -> None:
    body = struct.pack("<BBIIIHHBH6hH", 1, 5, BOOT, 7, 1_070_312, 1650, 4095, 2, 3, *FELT, 9)
    encoder = frame.SampleEncoder(BOOT, motion=True)
    buffer = bytearray(encoder.size)
    assert encoder.encode_sample_into(buffer, 7, 1_070_312, 1650, 4095, 2, 3, FELT, 9) == 42
    assert bytes(buffer) == framed(body)
    (found,) = FrameDecoder().feed(bytes(buffer))
    assert found == Sample(BOOT, 7, 1_070_312, 1650, 4095, 2, 3, FELT, 9)
    (short,) = FrameDecoder().feed(framed(body[:-1]))
    assert isinstance(short, Refused)
    assert "frame kind 5 has 35 bytes, found 34" in short.reason


def test_micropython_runs_the_driver(tmp_path: Path) -> None:
    """Its tenth to nineteenth reading fail: it marks that one, and waits to begin again."""
    shutil.copy(FIRMWARE / "imu.py", tmp_path / "imu.py")
    script = WHOLE_PROGRAM.format(folder=str(tmp_path))
    script = script.replace("import main", f"{INERTIAL}import main", 1)
    frames = FrameDecoder().feed(on_micropython(tmp_path, script))
    samples = [found for found in frames if isinstance(found, Sample)]
    assert len(samples) > 20
    assert [found.imu for found in samples] == [FELT] * 10 + [NONE] * (len(samples) - 10)
    assert samples[-1].misses == len(samples) - 10
