"""The board's program, run under CPython on a stand-in board and under MicroPython's Unix port."""

from __future__ import annotations

import importlib.util
import shutil
import subprocess
import sys
import zlib
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest
from esp32_board import BYTES_PER_S, ON_BOARD, WHOLE_PROGRAM, Board, machine_of
from esp32_streams import encoded, made

from antennate.hardware.esp32 import frame
from antennate.hardware.esp32.wire import FrameDecoder, Hello, Reset, Sample
from antennate.twin.robot import BOARD_SETTINGS

ROOT = Path(__file__).parents[1]
FIRMWARE = ROOT / "firmware"


def load(path: Path, name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


Program = Callable[..., ModuleType]


@pytest.fixture
def program(monkeypatch: pytest.MonkeyPatch) -> Program:
    """main.py on a board, not yet started."""

    def start(board: Board, cause: int = 1) -> ModuleType:
        poller = SimpleNamespace(
            register=lambda *_: None, ipoll=lambda _: [None] if board.received else []
        )
        micropython = ModuleType("micropython")
        micropython.__dict__["kbd_intr"] = board.interrupts.append
        monkeypatch.setitem(sys.modules, "machine", machine_of(board, cause))
        monkeypatch.setitem(sys.modules, "micropython", micropython)
        monkeypatch.setitem(sys.modules, "antenna_frame", frame)
        monkeypatch.setitem(sys.modules, "config", load(FIRMWARE / "config.py", "config"))
        main = load(FIRMWARE / "main.py", "firmware_main")
        stand_ins = {
            "time": SimpleNamespace(
                ticks_us=board.ticks_us,
                ticks_ms=lambda: board.us // 1000,
                ticks_diff=lambda a, b: a - b,
                sleep_ms=lambda ms: board.wait(1000 * ms),
            ),
            "select": SimpleNamespace(POLLIN=1, poll=lambda: poller),
            "sys": SimpleNamespace(
                stdout=SimpleNamespace(buffer=SimpleNamespace(write=board.write)),
                stdin=SimpleNamespace(buffer=SimpleNamespace(read=board.read)),
            ),
        }
        main.__dict__.update(stand_ins)
        return main

    return start


def sent(board: Board) -> tuple[list[Hello], list[Sample]]:
    """What a host would decode, every byte of it."""
    decoder = FrameDecoder()
    frames = decoder.feed(bytes(board.sent))
    counters = decoder.counters
    assert counters.delimiters + counters.judged == counters.received == len(board.sent)
    assert counters.good == len(frames)
    greetings = [found for found in frames if isinstance(found, Hello)]
    samples = [found for found in frames if isinstance(found, Sample)]
    assert len(greetings) + len(samples) == len(frames)
    return greetings, samples


def test_it_streams_at_its_rate_and_greets_every_second(program: Program) -> None:
    board = Board()
    board.until_us = 3_500_000
    program(board).main()
    greetings, samples = sent(board)
    assert len(greetings) == 4
    assert len(set(greetings)) == 1
    assert greetings[0].rate == 100
    assert greetings[0].device_id == "240ac40102030000"
    assert greetings[0].config_hash == frame.config_hash(100, *BOARD_SETTINGS)
    assert [found.seq for found in samples] == list(range(len(samples)))
    assert len(samples) == pytest.approx(350, abs=1)
    assert {found.boot_id for found in samples} == {greetings[0].boot_id}
    assert {b.ticks - a.ticks for a, b in pairwise(samples)} == {10_000}
    assert {(found.left, found.right, found.flags) for found in samples} == {(3400, 3500, 0)}
    assert len(board.sent) / 3.5 < 0.3 * BYTES_PER_S


def test_the_median_ignores_seven_wild_readings_of_fifteen(program: Program) -> None:
    rng = np.random.default_rng(2)
    high = rng.integers(0, 8, 400)
    wild = np.concatenate([rng.permutation([0] * (7 - n) + [4095] * n + [-1] * 8) for n in high])
    board = Board()
    board.readings = lambda pin, count: (
        1000 + pin if wild[(count - 1) // 2] < 0 else int(wild[(count - 1) // 2])
    )
    program(board).main()
    _, samples = sent(board)
    assert {(found.left, found.right) for found in samples} == {(1034, 1035)}


@pytest.mark.parametrize(("left", "right", "flags"), [(0, 9, 1), (9, 4095, 2), (4095, 0, 3)])
def test_a_reading_at_the_rail_is_flagged(
    program: Program, left: int, right: int, flags: int
) -> None:
    board = Board()
    board.readings = lambda pin, count: left if pin == 34 else right
    program(board).main()
    _, samples = sent(board)
    assert {(found.left, found.right, found.flags) for found in samples} == {(left, right, flags)}


def test_E4_ticks_wrap_on_the_board(program: Program) -> None:
    board = Board(ticks=2**30 - 500_000)
    program(board).main()
    _, samples = sent(board)
    ticks = np.array([found.ticks for found in samples])
    assert ticks.max() < 2**30
    assert np.sum(np.diff(ticks) < 0) == 1
    assert set((np.diff(ticks) % 2**30).tolist()) == {10_000}
    assert {found.flags for found in samples} == {0}


def test_a_loop_that_falls_behind_drops_the_oldest_and_counts_them(program: Program) -> None:
    """Held up for 0.3 s while the timer goes on: the newest 8 samples are kept."""
    board = Board()
    board.stall_us = {500_000: 300_000}
    program(board).main()
    _, samples = sent(board)
    numbers = [found.seq for found in samples]
    missing = set(range(numbers[-1])) - set(numbers)
    assert len(missing) == pytest.approx(22, abs=1)
    assert max(missing) - min(missing) + 1 == len(missing)
    assert samples[-1].drops == len(missing)
    assert {found.ticks - 10_000 * found.seq for found in samples} == {samples[0].ticks}


def test_a_sample_that_comes_late_is_flagged(program: Program) -> None:
    board = Board()
    main = program(board)
    sampler = main.Sampler(*(main.channel(pin) for pin in (34, 35)))
    flags = []
    encoder, buffer = frame.SampleEncoder(1), bytearray(frame.SAMPLE_FRAME_SIZE)
    for us in (0, 10_000, 24_999, 40_000, 40_000 + 2**30 - 1):
        board.us = us
        sampler.sample(None)
        assert sampler.encode_next_into(encoder, buffer)
        (found,) = FrameDecoder().feed(bytes(buffer))
        assert isinstance(found, Sample)
        flags.append(found.flags)
    assert flags == [0, 0, 0, 4, 4]
    assert not sampler.encode_next_into(encoder, buffer)


def test_a_slot_overwritten_while_it_is_encoded_is_not_sent(program: Program) -> None:
    """The timer fires in the middle of encoding the oldest of eight: the next one is sent."""
    board = Board()
    main = program(board)
    sampler = main.Sampler(*(main.channel(pin) for pin in (34, 35)))
    encoder, buffer = frame.SampleEncoder(1), bytearray(frame.SAMPLE_FRAME_SIZE)

    class Interrupted:
        fired = False

        def encode_sample_into(self, *fields: object) -> None:
            if not self.fired:
                self.fired = True
                sampler.sample(None)
            encoder.encode_sample_into(*fields)  # pyright: ignore[reportArgumentType]

    for n in range(8):
        board.us = n * 10_000
        sampler.sample(None)
    assert sampler.encode_next_into(Interrupted(), buffer)
    (found,) = FrameDecoder().feed(bytes(buffer))
    assert isinstance(found, Sample)
    assert (found.seq, found.ticks, found.drops) == (1, 10_000, 1)


def test_it_answers_a_request_and_nothing_else(program: Program) -> None:
    """10 000 hostile bytes, Ctrl-C and commands among them, then one request among noise."""
    board = Board()
    board.until_us = 15_000_000
    rng = np.random.default_rng(3)
    board.received += rng.integers(0, 256, 10_000, dtype=np.uint8).tobytes()
    board.received += b"\x03\x03\r\nimport machine; machine.reset()\r\n\x04"
    program(board).main()
    assert not board.received
    quiet = len(sent(board)[0])
    board = Board()
    board.until_us = 15_000_000
    board.received += b"\x03\x00noise" + frame.encode_request() * 2 + b"\x00\x00"
    program(board).main()
    assert len(sent(board)[0]) == quiet + 2


def test_X31_a_fuzzed_request_parser_knows_only_the_request(program: Program) -> None:
    """Bytes drawn from those of the request itself, judged by a plain search."""
    matcher = program(Board()).Requests()
    request = frame.encode_request()
    stream = np.random.default_rng(4).choice(list(request), 200_000).tobytes()
    stream = stream[:1000] + request + stream[1000:] + request + request[1:]
    found = [i for i, byte in enumerate(stream) if matcher.feed(byte)]
    expected = [i + len(request) - 1 for i in range(len(stream)) if stream.startswith(request, i)]
    assert found == expected
    assert len(found) >= 3


def test_the_button_gives_the_prompt_back(program: Program) -> None:
    board = Board()
    program(board).main()
    assert board.interrupts == [-1, 3]
    assert board.callback is None


def test_a_fault_gives_the_prompt_back_too(program: Program) -> None:
    board = Board()

    def broken(pin: int, count: int) -> int:
        raise OSError(5)

    board.readings = broken
    with pytest.raises(OSError, match="5"):
        program(board).main()
    assert board.interrupts == [-1, 3]
    assert board.callback is None


@pytest.mark.parametrize(
    ("cause", "reason"),
    [
        (1, Reset.POWER_ON),
        (2, Reset.HARD),
        (3, Reset.WATCHDOG),
        (4, Reset.DEEP_SLEEP),
        (5, Reset.SOFT),
        (0, Reset.UNKNOWN),
    ],
)
def test_E1_the_greeting_says_why_the_board_started(
    program: Program, cause: int, reason: Reset
) -> None:
    board = Board()
    program(board, cause).main()
    assert sent(board)[0][0].reset is reason


def test_E1_each_boot_has_its_own_number(program: Program) -> None:
    numbers = {program(Board()).random_id() for _ in range(100)}
    assert len(numbers) == 100
    assert max(numbers) > 2**24


def test_one_copy_of_the_frame_code_and_the_docs_say_where() -> None:
    source = Path(frame.__file__)
    there = ROOT / "packages/antennate/src/antennate/hardware/esp32/frame.py"
    assert source.read_bytes() == there.read_bytes()
    copies = [path for path in FIRMWARE.glob("*.py") if "COBS" in path.read_text()]
    assert copies == []
    page = (ROOT / "docs" / "firmware.md").read_text()
    assert (
        "cp \\\n    packages/antennate/src/antennate/hardware/esp32/frame.py :antenna_frame.py"
        in page
    )


def on_micropython(folder: Path, script: str) -> bytes:
    """Output of a script on MicroPython's Unix port, with the firmware in a folder."""
    program = shutil.which("micropython", path=f"{Path(sys.executable).parent}:/usr/bin")
    if program is None:
        pytest.skip("MicroPython's Unix port is not installed")
    shutil.copy(frame.__file__, folder / "antenna_frame.py")
    for name in ("main.py", "config.py"):
        shutil.copy(FIRMWARE / name, folder / name)
    (folder / "script.py").write_text(script)
    command = [program, str(folder / "script.py")]
    return subprocess.run(
        command, capture_output=True, check=True, timeout=20, stdin=subprocess.DEVNULL
    ).stdout


@pytest.mark.ci
def test_E10_micropython_encodes_the_same_bytes_and_allocates_nothing(tmp_path: Path) -> None:
    script = ON_BOARD.format(folder=str(tmp_path), boot=0x1234ABCD)
    *frames, grown, check = on_micropython(tmp_path, script).decode().split()
    for seq, line in enumerate(frames):
        sample = made(seq)
        assert bytes.fromhex(line) == encoded(sample)
    assert int(grown) == 0
    assert int(check) == 0xCBF43926 == zlib.crc32(b"123456789")


@pytest.mark.smoke
def test_the_whole_program_runs_on_micropython(tmp_path: Path) -> None:
    decoder = FrameDecoder()
    frames = decoder.feed(on_micropython(tmp_path, WHOLE_PROGRAM.format(folder=str(tmp_path))))
    assert isinstance(frames[0], Hello)
    samples = [found for found in frames if isinstance(found, Sample)]
    assert len(samples) > 10
    assert [found.seq for found in samples] == list(range(len(samples)))
    assert {(found.left, found.right) for found in samples} == {(3400, 3500)}
    assert decoder.counters.good == len(frames)
