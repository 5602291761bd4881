"""The inertial sensor of the board: its driver, and frames that carry its readings."""

from __future__ import annotations

import shutil
import struct
import sys
import zlib
from collections.abc import Callable
from itertools import product
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from esp32_board import INERTIAL, WHOLE_PROGRAM, Board, Lsm6dsox
from esp32_streams import BOOT, framed
from test_firmware import FIRMWARE, Program, load, on_micropython, program, sent

from antennate.hardware.esp32 import frame
from antennate.hardware.esp32.wire import FrameDecoder, Refused, Sample
from antennate.twin.robot import BOARD_SETTINGS

__all__ = ["program"]  # a fixture
AXES = (2, -1, 3)
"""A sensor turned by a quarter to the right: its y points forward, its x to the right."""
FELT = (-2, -1, 3, 500, 400, -32767)
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
    assert {found.imu for found in samples[:10]} == {NONE}  # the first 100 ms
    assert {(found.imu, found.misses) for found in samples[10:]} == {(FELT, 10)}
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


def test_axes_of_a_mounted_sensor_are_a_rotation() -> None:
    """Turned by a quarter to the right about z: what is felt is turned the other way round."""
    turned = np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 1]])  # Rz(-90 deg)
    readings = np.array([1, -2, 3, -400, 500, -32767]).reshape(2, 3)
    assert tuple((readings @ turned.T).ravel()) == FELT


def read(sensor: Any, count: int, before: Callable[[int], None] = lambda tick: None) -> list[Any]:
    """That many samples of a sensor, with something done before each."""
    target, found = [0] * 6, list[tuple[int, ...]]()
    for tick in range(count):
        before(tick)
        sensor.read_into(target, 0)
        found.append(tuple(target))
    return found


def test_single_failures_cost_their_own_samples_alone(inertial: Any) -> None:
    main, bus = inertial(Board())
    sensor = main.inertial()
    read(sensor, 10)
    lost = {3, 10, 11, 12, 13, 30}
    found = read(sensor, 40, lambda tick: setattr(bus, "silent", tick in lost))
    assert [tick for tick in range(40) if found[tick] == NONE] == sorted(lost)
    assert set(found) == {NONE, FELT}
    assert sensor.misses == 10 + len(lost)


@pytest.mark.parametrize("rate", [50, 100, 200])
def test_one_that_stays_silent_is_asked_once_a_second_and_begun_again(
    inertial: Any, rate: int
) -> None:
    main, bus = inertial(Board(), rate)
    sensor = main.inertial()
    read(sensor, rate // 10)
    tries = list[int]()

    def silent(tick: int) -> None:
        tries.append(bus.tries)
        bus.silent = tick < 2.5 * rate
        if tick == 0:
            bus.registers.clear()  # it has lost its settings

    found = read(sensor, 4 * rate, silent)
    asked = [tick for tick, more in enumerate(np.diff(tries)) if more][:7]
    assert asked == [0, 1, 2, 3, 4, rate + 4, 2 * rate + 4]
    begun = 3 * rate + 4
    assert found[: begun + rate // 10] == [NONE] * (begun + rate // 10)
    assert set(found[begun + rate // 10 :]) == {FELT}
    assert len(bus.registers) == 3


def test_one_that_restarts_gives_zeros_which_are_no_readings(inertial: Any) -> None:
    """Its settings are those of a sensor without supply: it measures nothing, and answers."""
    main, bus = inertial(Board())
    sensor, readings = main.inertial(), bus.readings
    read(sensor, 10)
    bus.registers.clear()

    def restarted(tick: int) -> None:
        bus.readings = readings if bus.registers else (0,) * 6

    found = read(sensor, 40, restarted)
    assert found == [NONE] * 20 + [FELT] * 20
    assert len(bus.registers) == 3


def test_another_part_is_not_taken_for_it(inertial: Any) -> None:
    main, bus = inertial(Board())
    bus.identity = 0x68
    assert set(read(main.inertial(), 50)) == {NONE}
    assert bus.tries == 5
    assert not bus.registers


def impossible(number: int, **_: object) -> Any:
    raise ValueError("invalid pin")


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"PIN_SCL": None}, "config.py: expected both of PIN_SDA and PIN_SCL, found one"),
        ({"PIN_SCL": 21}, "config.py: expected pins for PIN_SDA and PIN_SCL alone"),
        ({"PIN_SDA": 34}, "config.py: expected pins for PIN_SDA and PIN_SCL alone"),
        ({"IMU_AXES": (1, 1, 3)}, "found (1, 1, 3)"),
        ({"IMU_AXES": (2, 1, 3)}, "found (2, 1, 3)"),  # a mirror image
        ({"IMU_AXES": (-1, -2, -3)}, "found (-1, -2, -3)"),
        ({"IMU_AXES": (1, 2)}, "found (1, 2)"),
        ({"IMU_AXES": (1.0, 2, 3)}, "found (1.0, 2, 3)"),
        ({"IMU_ADDRESS": 0x16A}, "config.py: expected IMU_ADDRESS 0x6A or 0x6B, found 362"),
        ({"IMU_AXES": None}, "NoneType"),
        ({"I2C": impossible}, "invalid pin"),
        ({"imu": None}, "imu"),
    ],
)
def test_what_is_wrong_with_it_is_told_in_a_line_and_the_antennae_go_on(
    inertial: Any,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    changes: dict[str, Any],
    said: str,
) -> None:
    board = Board()
    main, bus = inertial(board)
    for name, value in changes.items():
        if name == "imu":  # no such file on the board
            monkeypatch.setitem(sys.modules, "imu", value)
        else:
            sys.modules["machine" if name == "I2C" else "config"].__dict__[name] = value
    main.main()
    (line,) = capsys.readouterr().out.splitlines()
    assert line.startswith("no inertial sensor: ")
    assert said in line
    greetings, samples = sent(board)
    assert len(samples) > 50
    assert {(found.left, found.right, found.imu) for found in samples} == {(3400, 3500, NONE)}
    assert samples[-1].misses == len(samples)
    assert greetings[0].config_hash == frame.config_hash(100, *BOARD_SETTINGS, (0,) * 6)
    assert bus.tries == 0


def test_a_bus_that_hangs_makes_five_samples_late_and_one_a_second(inertial: Any) -> None:
    """Each transfer ends after its 20 ms: no two readings of the antennae are further apart."""
    board = Board()
    board.until_us = 3_000_000
    main, bus = inertial(board)

    class Hung:
        def __getattr__(self, name: str) -> Any:
            def transfer(*_: object) -> None:
                bus.tries += 1
                board.us += imu.TIMEOUT_US
                raise OSError(116)

            return transfer

    imu = sys.modules["imu"]
    sys.modules["machine"].__dict__["I2C"] = lambda *_, **__: Hung()
    main.main()
    samples = sent(board)[1]
    ticks = np.array([found.ticks for found in samples])
    assert imu.TIMEOUT_US == 20_000  # two ticks of ESP-IDF's default, 100 Hz
    assert bus.tries == 5 + 2
    assert np.diff(ticks).max() <= 20_000
    assert sum(found.flags == 4 for found in samples) <= bus.tries
    assert {(found.left, found.right, found.imu) for found in samples} == {(3400, 3500, NONE)}


def test_all_24_ways_to_mount_it_are_taken_and_no_other(inertial: Any) -> None:
    """The rotations of a cube."""
    inertial(Board())
    taken = set[tuple[int, ...]]()
    for axes in product(range(-4, 5), repeat=3):
        try:
            sys.modules["imu"].require_rotation(axes)
        except ValueError:
            continue
        rows = [[np.sign(axis) * (abs(axis) == n) for n in (1, 2, 3)] for axis in axes]
        assert np.linalg.det(np.array(rows, float)) == pytest.approx(1.0)
        taken.add(axes)
    assert len(taken) == 24


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


@pytest.mark.ci
def test_micropython_runs_the_driver(tmp_path: Path) -> None:
    """Its eleventh to twentieth read fail: five in a row, then it is left alone for a second."""
    shutil.copy(FIRMWARE / "imu.py", tmp_path / "imu.py")
    script = WHOLE_PROGRAM.format(folder=str(tmp_path))
    script = script.replace("import main", f"{INERTIAL}import main", 1)
    frames = FrameDecoder().feed(on_micropython(tmp_path, script))
    samples = [found for found in frames if isinstance(found, Sample)]
    assert len(samples) > 25
    expected = [NONE] * 10 + [FELT] * 10 + [NONE] * (len(samples) - 20)
    assert [found.imu for found in samples] == expected
    assert samples[-1].misses == len(samples) - 10


@pytest.mark.ci
def test_micropython_goes_on_without_the_driver(tmp_path: Path) -> None:
    script = WHOLE_PROGRAM.format(folder=str(tmp_path))
    script = script.replace("import main", f"{INERTIAL}import main", 1)
    said = on_micropython(tmp_path, script)
    assert b"no inertial sensor: no module named 'imu'" in said
    samples = [found for found in FrameDecoder().feed(said) if isinstance(found, Sample)]
    assert len(samples) > 20
    assert {(found.left, found.right, found.imu) for found in samples} == {(3400, 3500, NONE)}
