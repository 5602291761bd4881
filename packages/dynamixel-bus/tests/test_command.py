"""The command `dynamixel-bus`: what it serves, what goes wrong on demand, and what it refuses."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from dynamixel_bus import __version__
from dynamixel_bus.answers import Span, Timing, Value
from dynamixel_bus.bus import Bus
from dynamixel_bus.command import main
from dynamixel_bus.ports import TcpPort

PATIENT = Timing(gap=0.1, latest=0.5)


@contextmanager
def served(*words: str) -> Iterator[Bus]:
    """A master before what a process of its own serves on a TCP port, until it is told to end."""
    program = [sys.executable, "-m", "dynamixel_bus", *words, "--tcp", "0"]
    with subprocess.Popen(program, stdout=subprocess.PIPE, text=True) as serving:
        assert serving.stdout is not None
        try:
            host, _, port = json.loads(serving.stdout.readline())["bus"][6:].rpartition(":")
            line = TcpPort(host, int(port))
            yield Bus(line, PATIENT)
            line.close()
            serving.send_signal(signal.SIGTERM)
            assert serving.wait(10.0) == 130
        finally:
            serving.kill()


@pytest.mark.ci
def test_nineteen_servos_answer_a_broadcast_ping() -> None:
    words = [f"{i}:{'xc430-w240' if i <= 17 else 'xl330-m288'}" for i in range(1, 20)]
    with served(*words) as bus:
        assert sorted(status.id for status in bus.scan()) == list(range(1, 20))


@pytest.mark.ci
def test_faults_begin_on_demand() -> None:
    """Overload is bit 5 of Hardware Error Status, at address 70, by the manual."""
    faults = ("servo:2=silent", "servo:3=overload", "servo:1=return_delay_time:7")
    with served("1:xl330-m288", "2:xl330-m288", "3:xl430-w250", "--fault", *faults) as bus:
        assert sorted(status.id for status in bus.scan()) == [1, 3]
        assert bus.read(3, Span(70, 1)) == Value(b"\x20", alert=True)
        assert bus.read(1, Span(9, 1)) == Value(b"\x07", alert=False)


@pytest.mark.ci
def test_a_fault_may_stand_before_the_servos_and_be_given_twice() -> None:
    words = ("--fault", "servo:2=silent", "1:xl330-m288", "2:xl330-m288", "3:xl330-m288")
    with served(*words, "--fault", "servo:3=silent") as bus:
        assert [status.id for status in bus.scan()] == [1]


@pytest.mark.ci
def test_a_list_says_the_speed_of_a_servo() -> None:
    """57600 bit/s are 1 in the register Baud Rate, 1000000 are 3, by the manual."""
    with served("5:xl430-w250@1000000", "6:xl330-m288") as bus:
        assert [bus.read(i, Span(8, 1)) for i in (5, 6)] == [
            Value(b"\3", False),
            Value(b"\1", False),
        ]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("", "the following arguments are required"),
        (
            "xl330-m288",
            "expected ID:MODEL[@BAUD][xCOUNT], such as 1:xl330-m288, found 'xl330-m288'",
        ),
        ("1:xl33-m288", "expected as model one of xc330-m181, xc330-m288, xc330-t181, "),
        ("1:xl330-m288@1234", "expected as speed of xl330-m288 one of 9600, 57600"),
        ("1:xl330-m288x0", "expected servos, found none"),
        ("253:xl330-m288", "expected an id from 0 to 252, found 253"),
        ("1:xl330-m288 --fault servo:2=silent", "--fault: expected a servo of 1, found 2"),
        (
            "1:xl330-m288 --fault servo:9=silent --fault bus=echo --duration 0.05",
            "--fault: expected a servo of 1, found 9",
        ),
        ("--fault bus=echo", "the following arguments are required"),
        ("1:xl330-m288 --dur 0.05", "unrecognized arguments: --dur"),
        ("1:xl330-m288 --fault servo:1=late", "--fault: expected seconds from 0 on"),
        ("1:xl330-m288 --fault esp32=silent", "--fault: expected TARGET=WHAT"),
        ("1:xl330-m288 --fault bus=frozen", "--fault: expected one of loss, silent"),
        ("1:xl330-m288 --duration 0", "--duration: expected seconds above 0, found '0'"),
        ("1:xl330-m288 --tcp 99999", "--tcp: expected [HOST:]PORT with a port of 0 to 65535"),
        ("1:xl330-m288 --frobnicate", "unrecognized arguments: --frobnicate"),
    ],
)
def test_bad_input_is_one_line_and_ends_with_2(
    words: str, said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(words.split()) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("dynamixel-bus: error: ")
    assert err.count("\n") == 1
    assert said in err


def test_the_version_is_told(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match="0"):
        main(["--version"])
    assert capsys.readouterr().out == f"{__version__}\n"


def test_it_ends_by_itself(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["1:xl330-m288", "--duration", "0.05"]) == 0
    assert json.loads(capsys.readouterr().out)["bus"].startswith("/dev/")


@pytest.mark.ci
@pytest.mark.parametrize(
    ("redirected", "code", "said"),
    [
        ("> /dev/full", 2, "No space left on device"),
        (">&-", 2, "it is closed"),
        ("| true; exit ${PIPESTATUS[0]}", 0, ""),
    ],
)
def test_standard_output_that_fails_gives_no_traceback(
    redirected: str, code: int, said: str
) -> None:
    """A reader that has ended is no error, as for other programs in a pipe."""
    command = f"{sys.executable} -m dynamixel_bus 1:xl330-m288 --duration 0.05 {redirected}"
    ran = subprocess.run(["bash", "-c", command], capture_output=True, text=True, timeout=60)
    lines = [f"dynamixel-bus: error: cannot write to standard output: {said}"] if said else []
    assert (ran.returncode, ran.stderr.splitlines()) == (code, lines)


@pytest.mark.ci
@pytest.mark.parametrize(
    ("words", "code", "told"),
    [
        ("1:xl330-m288 --duration 0.05 2>&-", 0, '{"bus": '),
        ("1:xl330-m288 --duration 0.05 2> /dev/full", 0, '{"bus": '),
        ("1:xl330-m288 >&- 2>&-", 2, ""),
        ("1:xl330-m288 > /dev/full 2> /dev/full", 2, ""),
        ("1:ax-12 2>&-", 2, ""),
        ("1:ax-12 2> /dev/full", 2, ""),
        ("1:ax-12 > /dev/full", 2, "dynamixel-bus: error: expected as model one of "),
        ("--version > /dev/full", 2, "dynamixel-bus: error: cannot write to standard output: "),
        ("--version >&-", 2, "dynamixel-bus: error: cannot write to standard output: it is closed"),
    ],
)
def test_streams_that_cannot_be_written_to_change_no_exit_code(
    words: str, code: int, told: str
) -> None:
    """What is left of the two streams tells the result, or one line why there is none."""
    command = f"{sys.executable} -m dynamixel_bus {words}"
    ran = subprocess.run(["bash", "-c", command], capture_output=True, text=True, timeout=60)
    left = (ran.stdout + ran.stderr).splitlines()
    assert (ran.returncode, len(left)) == (code, 1 if told else 0)
    assert "".join(left).startswith(told)
