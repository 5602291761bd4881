"""`drive` before a twin over real ports, in the twin's own time: the same bits on any machine."""

from __future__ import annotations

import json
import os
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import cast

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some
from ticked_rig import Late, served, terminals

import antennate
from antennate.cli import main
from antennate.errors import BadInputError
from antennate.experiments.driven import Driven, driven, simulated_alike
from antennate.experiments.tunnel.run import TunnelConfig
from antennate.experiments.twin import TwinConfig, build
from antennate.hardware.driving.config import DriveConfig
from antennate.hardware.driving.connect import connect, prepare
from antennate.hardware.driving.session import Session
from antennate.hardware.ports import clock_words as words
from antennate.hardware.ports.port import PortError
from antennate.hardware.ports.serial_port import SerialPort
from antennate.hardware.ports.twin_clock import TwinClock
from antennate.hardware.safety.causes import State
from antennate.params import ClockParams
from antennate.robots.layout import LayoutParams
from antennate.telemetry.reader import LogReader
from antennate.twin.clock import ClockServer, FaultyClock
from antennate.twin.ends import End, Terminal
from antennate.twin.faults import Faults, read
from antennate.twin.lockstep import BoardPort
from antennate.twin.robot import TwinRobot
from antennate.twin.tcp import TcpEnd

CONFIG = TunnelConfig(seed=0)
LAYOUT = LayoutParams()
QUICK = ClockParams(arrival=0.2)
SILENT = ("servo:7=silent@1.8s",)
"""Amid the ticks that are compared."""
HERE = Path(__file__).parent
SOURCE = Path(antennate.__file__).resolve().parents[1]
PROGRAM = [sys.executable, "-c", "import sys; from antennate.cli import main; sys.exit(main())"]
BUSY = [sys.executable, "-c", "while True: sum(range(10_000))"]


def over(ends: Callable[[], list[End]], ticks: int, faults: tuple[str, ...] = ()) -> Driven:
    """Trial 0 by a `drive` that is connected to a twin over real ports."""
    with ExitStack() as stack:

        def wired(orders: DriveConfig, robot: TwinRobot) -> Session:
            paths = stack.enter_context(served(robot, ends, faults))
            wires = connect(orders, paths["esp32"], paths["bus"], clock=paths["clock"])
            return stack.enter_context(wires)

        return driven(CONFIG, "closed", 0, LAYOUT, ticks, wired)


def without_ports(ticks: int, faults: tuple[str, ...] = ()) -> Driven:
    """The same by calls."""

    def wired(orders: DriveConfig, robot: TwinRobot) -> Session:
        clock = FaultyClock(robot, Faults([read(text) for text in faults], LAYOUT.ids))
        return prepare(orders, BoardPort(robot, clock), clock, clock)

    return driven(CONFIG, "closed", 0, LAYOUT, ticks, wired)


def tcp_ports() -> list[End]:
    return [TcpEnd("127.0.0.1", 0) for _ in range(3)]


def late_terminals() -> list[End]:
    return [Late(end, 0.002) for end in terminals()]


@pytest.fixture(scope="module")
def whole() -> Driven:
    return driven(CONFIG, "closed", 0, LAYOUT, 200)


@pytest.mark.parametrize(
    ("ends", "ticks"), [(terminals, 200), (tcp_ports, 60), (late_terminals, 20)]
)
def test_M7_drive_over_real_ports_is_bit_for_bit_that_without_ports(
    ends: Callable[[], list[End]], ticks: int, whole: Driven
) -> None:
    one = over(ends, ticks)
    assert len(one.walk.maneuvers) == ticks
    assert one.start.standing == whole.start.standing
    assert len(one.start.before) == len(whole.start.before)
    assert one.walk.readings == whole.walk.readings[:ticks]
    assert one.walk.maneuvers == whole.walk.maneuvers[:ticks]
    assert one.walk.commands == whole.walk.commands[:ticks]
    assert one.walk.goals == whole.walk.goals[:ticks]
    assert one.report == whole.report or ticks < 200


def test_M7_a_silent_servo_costs_the_twins_time_alone_and_always_as_much() -> None:
    one, other = over(terminals, 60, SILENT), without_ports(60, SILENT)
    assert repr(one.walk.readings) == repr(other.walk.readings)  # NaN among them
    assert one.walk.commands == other.walk.commands
    assert one.report == other.report
    assert one.report.worst == State.FAULT
    assert one.report.on == [7]


@contextmanager
def twin(*flags: str) -> Iterator[tuple[subprocess.Popen[str], list[str]]]:
    """A twin in a process of its own, and the flags of `drive` that name it."""
    argv = [*PROGRAM, "twin", "--pace", "lockstep", *flags]
    environment = {**os.environ, "PYTHONPATH": str(SOURCE)}
    pipe, quiet = subprocess.PIPE, subprocess.DEVNULL
    process = subprocess.Popen(argv, env=environment, text=True, stdout=pipe, stderr=quiet)
    assert process.stdout is not None
    try:
        paths = json.loads(process.stdout.readline())
        yield process, [word for name, at in paths.items() for word in (f"--{name}", at)]
    finally:
        process.kill()
        process.wait()
        process.stdout.close()


@pytest.mark.parametrize("flags", [(), pytest.param(("--tcp", "0"), marks=pytest.mark.slow)])
def test_a_drive_ends_in_one_line_at_once_when_its_twin_dies(
    flags: tuple[str, ...], tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    log, died = tmp_path / "drive.log", [0.0]
    with twin(*flags) as (process, addresses):

        def kill() -> None:
            while not (log.exists() and log.stat().st_size > 30_000):
                time.sleep(0.01)
            died[0] = time.monotonic()
            process.kill()

        killer = threading.Thread(target=kill)
        killer.start()
        argv = ["drive", *addresses, "--dry-run", "600", "--out", str(tmp_path), "--overwrite"]
        assert main(argv) == 2
        lasted = time.monotonic() - died[0]
        killer.join()
    errors = [line for line in capfd.readouterr().err.splitlines() if "error" in line]
    assert len(errors) == 1
    assert errors[0].startswith("antennate drive: error: --clock: lost the twin: ")
    assert lasted < 10.0  # 0.2 s on an idle machine; a busy one may need longer


REFUSED = {
    b"until 1\n": b"error expected `hello antennate-clock 2` first, found another word\n",
    b"\nhello antennate-clock 3\n": b"error expected `hello antennate-clock 2`, ",
    b"hello antennate-clock 2\nuntil nan\n": b"found 'until nan'\n",
    b"hello antennate-clock 2\nuntil 5\n": b"expected a time of 0.0 to 1 s later, found 5.0",
    b"hello antennate-clock 2\nsent bus 0\n": b"expected 1 to 65536 bytes in one piece",
    b"x" * 300: b"found 'xxx",
    b"\xff\0'`$(exit)`\n": b"error expected",
    b"hello antennate-clock 2\nuntil 0.02\nuntil 0.01\n": b"expected a time of 0.02 to",
}


def test_the_clock_refuses_in_a_line_what_it_does_not_know() -> None:
    with served(build(TwinConfig(), 5)) as paths:
        line = SerialPort(paths["clock"], 115_200)
        for said, found in REFUSED.items():
            heard, end = b"", time.monotonic() + 20.0
            line.write(said)
            while not (b"error" in heard and heard.endswith(b"\n")) and time.monotonic() < end:
                heard += line.read(4096, 1.0)
            assert found in heard
            line.write(b"\nhello antennate-clock 2\n")  # whoever greets anew may go on
            assert line.read(4096, 20.0).startswith(b"at 0.0")
        line.close()


@settings(max_examples=50)
@given(some.binary(max_size=60) | some.from_regex(rb"(at|until|sent|error)[ -~]*", fullmatch=True))
def test_words_are_understood_or_refused(said: bytes) -> None:
    for understand in (words.request, words.answer):
        with suppress(BadInputError):
            assert understand(said) is not None


@settings(max_examples=50)
@given(some.floats(0.0, 1e6))
def test_every_bit_of_a_time_comes_back(t: float) -> None:
    asked = words.request(words.go_on(t, listens=False).encode())
    assert asked == words.GoOn(t, listens=False)
    assert words.answer(f"at {t!r} 1 2".encode()) == words.At(t, (1, 2))
    named = words.At(t, (1, 2), ("tcp:4001", "/dev/pts/3"))
    assert words.answer(f"at {t!r} 1 2 tcp:4001 /dev/pts/3".encode()) == named


def test_whoever_greets_at_time_0_gets_all_that_the_board_says() -> None:
    robot = build(TwinConfig(), 5)
    said = robot.take()
    robot.advance(0.1)
    with served(build(TwinConfig(), 5)) as paths:
        lines = [SerialPort(paths[name], 115_200) for name in ("clock", "esp32", "bus")]
        clock = TwinClock(lines[0], lines[1], lines[2])
        assert clock.esp32.read(4096, 0.0) == said
        clock.sleep_until(0.1)
        assert clock.now() == 0.1
        assert clock.esp32.read(4096, 0.0) == robot.take()
        for line in lines:
            line.close()


def test_bytes_that_a_wire_swallows_are_missed_and_there_is_no_way_back() -> None:
    nobody = Terminal()
    with served(build(TwinConfig(), 5)) as paths:
        lines = [SerialPort(at, 115_200) for at in (paths["clock"], nobody.path, paths["bus"])]
        with pytest.raises(
            PortError, match="from the twin on --esp32, found 0; are --esp32, --bus"
        ):
            TwinClock(lines[0], lines[1], lines[2], ClockParams(arrival=0.2))
        for line in lines:
            line.close()
    nobody.close()


class Stuck:
    """A wire on which every question is answered with the same time."""

    def __init__(self) -> None:
        self.questions = 0

    def write(self, data: bytes) -> None:
        self.questions += 1

    def read(self, most: int, timeout: float) -> bytes:
        return b"at 0.0 0 0\n"

    def close(self) -> None: ...


def test_a_twin_whose_time_stands_still_is_given_up() -> None:
    line = Stuck()
    clock = TwinClock(line, line, line)
    with pytest.raises(PortError, match=r"go on until 0\.01 s, found 0\.0 s; start it anew"):
        clock.sleep_until(0.01)
    with pytest.raises(PortError, match="go on until"):
        clock.bus.read(1, 0.01)
    assert line.questions == 2


class Chatter:
    """A wire whose client never stops."""

    path, taken = "tcp://127.0.0.1:1", True

    def read(self) -> bytes:
        return b"x"

    def clear(self) -> None: ...


def test_a_greeting_beside_a_client_that_never_stops_is_refused() -> None:
    robot, end = build(TwinConfig(), 5), Terminal()
    wire = cast(End, Chatter())
    server = ClockServer(
        robot, Faults([], LAYOUT.ids), {"esp32": wire, "bus": wire}, end, params=QUICK
    )
    line = SerialPort(end.path, 115_200)
    line.write(words.HELLO.encode() + b"\n")
    server.hear()
    assert b"error expected silence on the wire esp32 before" in line.read(4096, 5.0)
    line.close()
    end.close()


def test_a_clock_is_refused_with_a_bus_that_is_not_its_twins_before_a_byte_goes_there(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A real bus behind a TCP bridge, while another client has the twin's."""
    monkeypatch.chdir(tmp_path)
    bridge = socket.create_server(("127.0.0.1", 0))
    port = bridge.getsockname()[1]
    with served(build(TwinConfig(), 5), tcp_ports) as paths:
        other = socket.create_connection(("127.0.0.1", int(paths["bus"].rpartition(":")[2])))
        flags = ["--esp32", paths["esp32"], "--bus", f"tcp://127.0.0.1:{port}"]
        said = refusal(capsys, *flags, "--clock", paths["clock"])
        assert f"--bus: expected {words.place(paths['bus'])}, which the twin of --clock " in said
        assert f"found tcp:{port}; --clock is for a twin alone, never for a robot" in said
        heard, _ = bridge.accept()
        assert heard.recv(1) == b""  # closed, and nothing before
        for each in (other, heard, bridge):
            each.close()


def refusal(capsys: pytest.CaptureFixture[str], *flags: str) -> str:
    assert main(["drive", *flags]) == 2
    err = capsys.readouterr().err
    assert err.count("\n") == 1
    return err


def test_a_clock_is_refused_for_what_can_be_no_twin(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with served(build(TwinConfig(), 5)) as paths:
        bus, clock = paths["bus"], ["--clock", paths["clock"]]
        real = refusal(capsys, "--esp32", "/dev/null", "--bus", bus, *clock)
        assert "--esp32: expected the address of a twin in lock-step, because of --clock, " in real
        assert "found /dev/null, no pseudo-terminal; real adapters have no such clock" in real
        udp = ["--esp32", "udp://127.0.0.1:9", "--insecure-udp", "--bus", bus, *clock]
        assert main(["drive", *udp]) == 2
        assert "found udp://, which may lose packets" in capsys.readouterr().err
        ports = ["--esp32", paths["esp32"], "--bus", bus]
        assert "a port of its own" in refusal(capsys, *ports, "--clock", bus)
        assert "no such file" in refusal(capsys, *ports, "--clock", "/dev/pts/no")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("flags", "busy", "most"), [((), 0, 10_000), (("--tcp", "0"), 4, 400)], ids=["alone", "busy"]
)
def test_M7_drive_by_the_command_line_decides_as_the_pure_simulation(
    flags: tuple[str, ...], busy: int, most: int, tmp_path: Path
) -> None:
    """Two processes: a whole trial alone, and the begin of one beside four busy processes."""
    start = driven(CONFIG, "closed", 0, LAYOUT, 1).start
    simulated = simulated_alike(CONFIG, "closed", 0, LAYOUT, start, most)
    count = len(simulated.maneuvers)
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join((str(SOURCE), str(HERE)))}
    with ExitStack() as stack, twin(*flags) as (_, addresses):
        for _ in range(busy):
            stack.callback(stack.enter_context(subprocess.Popen(BUSY)).kill)
        argv = [*PROGRAM, "drive", *addresses, "--arm", "--no-touch-check", "--dry-run", "0.5"]
        argv += ["--duration", str(0.01 * count + 0.5), "--controller", "ticked_rig:closed"]
        argv += ["--out", str(tmp_path), "--overwrite", "--json"]
        said = subprocess.run(argv, env=environment, capture_output=True, check=True).stdout
    assert json.loads(said)["log_complete"]
    with LogReader(tmp_path / "drive.log") as log:
        ticks = list(log)
    first = next(at for at, tick in enumerate(ticks) if not np.isnan(tick.counts).all())
    ticks = ticks[first : first + count]
    assert len(ticks) == count
    assert simulated.status == ("" if busy else "success")
    assert [(tick.t, *tick.counts) for tick in ticks] == simulated.readings
    assert [tick.maneuver for tick in ticks] == simulated.maneuvers
    assert [np.array(tick.angles).tobytes() for tick in ticks] == simulated.commands
