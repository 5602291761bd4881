"""Ports that do not open: one line with the flag, what was found, and the cure."""

from __future__ import annotations

import errno
import json
import os
import socket
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

from antennate.cli import main
from antennate.cli.terminal import BAD_INPUT
from antennate.hardware.ports.errors import explain, holders
from antennate.hardware.ports.serial_line import SerialPort
from antennate.messages import command_words

VISER = find_spec("viser") is not None


@pytest.fixture
def terminal() -> object:
    master, slave = os.openpty()
    yield os.ttyname(slave)
    os.close(master)
    os.close(slave)


@pytest.mark.parametrize(
    ("error", "said"),
    [
        (OSError(errno.EACCES, "Permission denied"), "no permission; run `sudo "),
        (OSError(errno.EIO, "Input/output error"), "the device is gone; plug it in again"),
        (ValueError("Failed to set custom baud rate"), "it cannot do 123 bit/s; set robot.baud"),
        (OSError(errno.EBUSY, "Device or resource busy"), "in use by another program; end that"),
    ],
)
def test_the_reason_and_the_cure_are_said(terminal: str, error: Exception, said: str) -> None:
    text = str(explain("--bus", terminal, 123, error))
    assert text.startswith(f"--bus: expected a serial port that opens, found {terminal}: ")
    assert said in text


def test_permission_names_the_group_of_the_device(
    terminal: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Path, "group", lambda _: "dialout")
    error = explain("--esp32", terminal, 1, PermissionError(errno.EACCES, "no"))
    assert error.cure == "run `sudo usermod -aG dialout $USER`, log out and in again"


@pytest.mark.ci
def test_L15_a_second_program_is_told_the_pid_of_the_first() -> None:
    """The first one is another process without the master's end, as one that uses a real port."""
    master, slave = os.openpty()
    path = os.ttyname(slave)
    hold = (
        "import serial, sys; s = serial.Serial(sys.argv[1], exclusive=True); print(1, flush=True)"
    )
    first = subprocess.Popen(
        [sys.executable, "-c", hold + "; sys.stdin.read()", path],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
    )
    try:
        assert first.stdout is not None
        assert first.stdout.readline() == b"1\n"
        assert [who.split()[1] for who in holders(path)] == [str(first.pid)]
        with pytest.raises(Exception, match=f"in use by pid {first.pid} "):
            SerialPort(path, 1_000_000, "--bus")
    finally:
        first.communicate(b"")
        os.close(master)
        os.close(slave)


@pytest.mark.parametrize("command", ["doctor", "drive", "setup", "jog", "zero"])
@pytest.mark.parametrize(
    ("path", "said"),
    [
        ("/dev/nowhere", "no such file"),
        ("/dev/pts/99999", "start `antennate twin` again"),
        ("/dev/null", "not a serial port"),
        ("/", "not a serial"),
    ],
)
def test_every_command_says_it_and_ends_with_2(
    command: str,
    path: str,
    said: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Before anything is asked of a person."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "200")  # no cell of a table is broken
    (tmp_path / "robot.toml").touch()
    both = ["--esp32", path, "--bus", "/dev/another"]
    ports = both if command == "drive" else ["--bus", path]
    ports += ["--joint", "yaw1"] if command == "jog" else []
    assert main([*command_words(command).split(), *ports]) == BAD_INPUT
    told = capsys.readouterr()
    assert said in told.out + told.err
    assert "[Enter" not in told.out + told.err
    assert "Traceback" not in told.err


@pytest.mark.parametrize(
    "more",
    [[], pytest.param(["--view"], marks=pytest.mark.skipif(not VISER, reason="needs viser"))],
    ids=["bus", "page"],
)
def test_a_twin_whose_port_is_taken_leaves_no_log(
    more: list[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    with socket.create_server(("127.0.0.1", 0)) as holder:
        port = str(holder.getsockname()[1])
        words = [*more, "--view-port", port] if more else ["--tcp", port]
        assert main(["twin", "--duration", "1", "--log", "twin.mcap", *words]) == BAD_INPUT
    (line,) = capsys.readouterr().err.splitlines()
    assert port in line
    assert not list(tmp_path.iterdir())


def test_bad_robot_toml_is_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "robot.toml"
    file.write_text("[robot]\nbuad = 1\n")
    assert main(["doctor", "--bus", "/dev/null", "--config", str(file)]) == BAD_INPUT
    assert "did you mean baud?" in capsys.readouterr().err


def test_json_is_the_result_alone_and_out_keeps_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "run"
    assert main(["doctor", "--bus", "/dev/null", "--json", "--out", str(out)]) == BAD_INPUT
    result = json.loads(capsys.readouterr().out)
    assert result == json.loads((out / "result.json").read_text())
    assert (result["schema"], result["command"], result["grade"]) == (1, "doctor", "bad")
    assert "port" in [row["check"] for row in result["rows"] if row["grade"] == "bad"]
