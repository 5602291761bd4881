"""Boards and twins on the network: real UDP and TCP on loopback, and delays in invented time."""

from __future__ import annotations

import contextlib
import json
import os
import select
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest
from esp32_streams import encoded, hello, made
from stated import STATED

from antennate.cli import main
from antennate.errors import BadInputError
from antennate.hardware.esp32.wire import FrameDecoder, Hello, Sample
from antennate.hardware.ports.finder import finder, read_key
from antennate.hardware.ports.network import UdpPort
from antennate.params.hardware import NetworkParams
from antennate.twin.board import UdpEndpoint
from dynamixel_bus.endpoints import TcpEndpoint
from dynamixel_bus.port import Port, PortError

KEY = bytes(range(32))


class Clock:
    """Invented time."""

    t = 0.0

    def __call__(self) -> float:
        return self.t


def place(path: str) -> tuple[str, int]:
    host, _, port = path.removeprefix("udp://").removeprefix("tcp://").rpartition(":")
    return host, int(port)


@dataclass(frozen=True)
class Flooder:
    """Who sends from the address of a board, and to whom."""

    own: socket.socket
    victim: tuple[str, int]

    def send(self, data: bytes) -> None:
        self.own.sendto(data, self.victim)


@contextlib.contextmanager
def flooded_board(params: NetworkParams) -> Iterator[tuple[UdpPort, Clock, UdpEndpoint, Flooder]]:
    """A port that a board has been granted, the board's end, and a flooder with its address."""
    end, clock = UdpEndpoint("127.0.0.1", 0, KEY), Clock()
    port = UdpPort(*place(end.path), KEY, params, clock)
    own = socket.socket(fileno=os.dup(end.fileno()))
    with contextlib.closing(port), contextlib.closing(end), own:
        end.write(hello(5))
        for _ in range(3):
            port.write(b"")
            _, victim = own.recvfrom(1, socket.MSG_PEEK)
            end.read()
            port.read(4096, 0.0)
        yield port, clock, end, Flooder(own, victim)


def test_X17_a_flood_is_looked_at_in_part_and_real_frames_get_through() -> None:
    """50 000 forged datagrams a second, from the board's own address, for 2 s of invented time."""
    with flooded_board(NetworkParams()) as (port, clock, end, flooder):
        forged = os.urandom(44)
        seq, came, most = 0, bytearray(), 0
        for _ in range(200):
            clock.t += 0.01
            end.read()
            for n in range(500):
                if n == 100:
                    end.write(encoded(made(seq, boot=5)))
                    seq += 1
                flooder.send(forged)
            before = port.tally.received
            while part := port.read(4096, 0.0):
                came += part
            most = max(most, port.tally.received - before)
        assert most <= NetworkParams().look_burst
        assert port.tally.forged >= 10_000
        samples = [f for f in FrameDecoder().feed(bytes(came)) if isinstance(f, Sample)]
        assert len(samples) >= 150


def test_X17_no_poll_looks_at_more_than_its_share() -> None:
    """200 datagrams wait at each of 100 polls; a fifth of them may be looked at."""
    with flooded_board(NetworkParams(look_burst=40, look_rate=4000.0)) as (port, clock, _, flooder):
        for _ in range(100):
            clock.t += 0.01
            for _ in range(200):
                flooder.send(bytes(44))
            before = port.tally.received
            while port.read(4096, 0.0):
                pass
            assert 39 <= port.tally.received - before <= 40


def test_X14_other_senders_are_not_even_heard() -> None:
    with flooded_board(NetworkParams()) as (port, _, end, flooder):
        received = port.tally.received
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
            for _ in range(100):
                stranger.sendto(os.urandom(44), flooder.victim)
        end.write(encoded(made(0, boot=5)))
        assert port.read(4096, 0.0) == encoded(made(0, boot=5))
        assert port.tally.received == received + 1


def test_a_board_that_is_not_there_yet_is_awaited() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as line:
        line.bind(("127.0.0.1", 0))
        number = line.getsockname()[1]
    clock = Clock()
    port = UdpPort("127.0.0.1", number, KEY, None, clock)
    for _ in range(10):
        clock.t += 0.3
        assert port.read(4096, 0.0) == b""
    end = UdpEndpoint("127.0.0.1", number, KEY)
    end.write(hello(5))
    for _ in range(4):
        clock.t += 0.3
        port.read(4096, 0.0)
        end.read()
    end.write(encoded(made(0, boot=5)))
    assert encoded(made(0, boot=5)) in port.read(4096, 0.0)
    port.close()
    end.close()
    with pytest.raises(PortError, match="read from udp"):
        port.read(1, 0.0)


def private(folder: Path, text: str, mode: int = 0o600) -> Path:
    path = folder / "board.key"
    path.write_text(text)
    path.chmod(mode)
    return path


def test_X16_a_key_comes_from_a_private_file_or_the_environment(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert read_key(private(tmp_path, KEY.hex() + "\n")) == KEY
    assert read_key(private(tmp_path, KEY.hex().upper(), 0o400)) == KEY
    monkeypatch.setenv("ANTENNATE_KEY", KEY.hex())
    assert read_key(None) == KEY
    monkeypatch.delenv("ANTENNATE_KEY")
    with pytest.raises(BadInputError, match="ANTENNATE_KEY set; make one with") as refusal:
        read_key(None)
    assert "--insecure-udp" not in str(refusal.value)


@pytest.mark.parametrize("command", ["drive", "doctor", "record"])
def test_X16_without_a_key_both_ways_out_are_named(
    command: str, monkeypatch: pytest.MonkeyPatch, refused: Callable[..., str]
) -> None:
    monkeypatch.delenv("ANTENNATE_KEY", raising=False)
    place = ["--out", "left.csv"] if command == "record" else ["--bus", "/dev/null"]
    told = refused(command, "--esp32", "udp://127.0.0.1:9", *place)
    assert "make one with" in told
    assert "--insecure-udp" in told


@pytest.mark.parametrize("mode", [0o644, 0o640, 0o604, 0o620, 0o602, 0o666, 0o777, 0o610, 0o601])
def test_X16_a_key_that_others_can_read_is_refused_with_the_cure(tmp_path: Path, mode: int) -> None:
    path = private(tmp_path, KEY.hex(), mode)
    with pytest.raises(BadInputError, match=rf"mode {mode:04o}.*chmod 600") as refusal:
        read_key(path)
    assert KEY.hex() not in str(refusal.value)


@pytest.mark.parametrize("text", ["", "00" * 31, "00" * 33, "zz" * 32, "00 " * 32, "0" * 2000])
def test_X16_what_is_no_key_is_refused_and_not_shown(tmp_path: Path, text: str) -> None:
    with pytest.raises(BadInputError, match="expected 64 hexadecimal digits") as refusal:
        read_key(private(tmp_path, text))
    assert not text or text not in str(refusal.value)
    with pytest.raises(BadInputError, match="expected a file, found"):
        read_key(tmp_path / "none")
    with pytest.raises(BadInputError, match="expected a"):
        read_key(tmp_path)


def eventually(port: Port, end: TcpEndpoint, said: bytes) -> bool:
    """Whether what the end writes comes within a second."""
    for _ in range(100):
        end.read()
        end.write(said)
        if said in port.read(4096, 0.01):
            return True
    return False


def test_a_tcp_end_serves_one_client_at_a_time_and_lets_it_come_back() -> None:
    end = TcpEndpoint("127.0.0.1", 0)
    end.write(b"lost, as nobody listens")
    first = finder(end.path, 9600)()
    assert eventually(first, end, b"one")
    first.write(b"hello")
    assert select.select([end], [], [], 1.0)[0] == [end]
    assert end.read() == b"hello"
    second = finder(end.path, 9600)()
    assert select.select([end], [], [], 1.0)[0] == [end]
    end.read()
    with pytest.raises(PortError, match="serves another client"):
        second.read(1, 1.0)
    first.drain()
    assert eventually(first, end, b"still here")
    first.close()
    third = finder(end.path, 9600)()
    assert eventually(third, end, b"two")
    end.close()
    with pytest.raises(PortError, match="tcp://127"):
        third.drain()
    second.close()
    third.close()


@pytest.mark.ci
def test_X16_the_key_is_in_nothing_that_a_drive_over_udp_says(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A dry run against a twin whose board speaks UDP and whose bus speaks TCP."""
    monkeypatch.chdir(tmp_path)
    key = os.urandom(32)
    path = private(tmp_path, key.hex())
    command = [sys.executable, "-m", "antennate", "twin", "--udp", "0", "--tcp", "0"]
    with subprocess.Popen(
        [*command, "--key", str(path)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as twin:
        assert twin.stdout is not None
        places = json.loads(twin.stdout.readline())
        words = ["drive", "--esp32", places["esp32"], "--bus", places["bus"]]
        dry = [*words, *STATED, "--key", str(path), "--dry-run", "0.3"]
        try:
            assert main(dry) == 0
            board = read_key(path)
            keyed = [*words[1:3], "--key", str(path)]
            assert main(["record", *keyed, "--duration", "0.3", "--out", "both.csv"]) == 0
            assert main(["doctor", *keyed]) == 0
            assert main([*words, "--insecure-udp", "--dry-run", "0.1"]) == 2
        finally:
            twin.terminate()
            said = "".join(twin.communicate())
    assert board == key
    out, err = capsys.readouterr()
    assert "A dry run" in out
    assert "anybody on this network" in err
    assert "does not answer to a wrong key" in err
    for secret in (key.hex(), key.hex().upper(), repr(key)):
        assert secret not in said + out + err


def test_a_twin_that_starts_anew_or_falls_silent_does_so_over_udp_too() -> None:
    clock = Clock()
    end = UdpEndpoint("127.0.0.1", 0, KEY, clock)
    port = UdpPort(*place(end.path), KEY, None, clock)
    heard = FrameDecoder()

    def speak(boot: int, first: int) -> list[Hello | Sample]:
        found: list[Hello | Sample] = []
        for seq in range(first, first + 100):
            clock.t += 0.01
            end.write((hello(boot) if seq == 0 else b"") + encoded(made(seq, boot=boot)))
            end.read()
            for frame_ in heard.feed(port.read(4096, 0.0)):
                assert isinstance(frame_, Hello | Sample)
                found.append(frame_)
        return found

    before, after = speak(5, 0), speak(6, 0)
    assert {found.boot_id for found in before} == {5}
    assert {found.boot_id for found in after} == {6}
    assert sum(isinstance(found, Sample) for found in before) >= 90
    assert sum(isinstance(found, Sample) for found in after) >= 60
    clock.t += 1.0
    asked = port.tally.greetings
    port.write(b"")
    end.read()
    port.read(4096, 0.0)
    assert port.tally.greetings == asked
    port.close()
    end.close()
