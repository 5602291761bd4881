"""What a person answers, and which port is which by unplugging and plugging in."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from setup_rig import Script

from antennate.cli import keys
from antennate.cli.keys import TerminalPerson
from antennate.errors import BadInputError, ConfigError
from antennate.hardware.setup.person import Quit, all_ports, find_port, ports_like


class Ports:
    """Device files of a machine."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.plug("ttyUSB0", "ttyUSB1", "ttyS0")

    def plug(self, *names: str) -> None:
        for name in names:
            (self.folder / name).touch()

    def unplug(self, name: str) -> None:
        (self.folder / name).unlink()

    def find(self, script: Script) -> str:
        listing = ports_like(str(self.folder / "tty*"))
        found = find_port(script, "adapter", listing, lambda time: None, 0.3)
        return Path(found).name if found else ""


@pytest.mark.parametrize("name", ["ttyUSB1", "ttyUSB7"])
def test_the_port_that_goes_and_comes_back_is_it_by_any_name(name: str, tmp_path: Path) -> None:
    ports = Ports(tmp_path)
    script = Script(
        [
            ("unplug the adapter", lambda: ports.unplug("ttyUSB1"), ""),
            ("plug it in again", lambda: ports.plug(name), ""),
        ]
    )
    assert ports.find(script) == name


def test_none_or_two_are_told_and_asked_for_once_more(tmp_path: Path) -> None:
    ports = Ports(tmp_path)
    script = Script(
        [
            ("unplug", None, ""),
            ("expected a port that is gone, found none gone", None, None),
            ("unplug", lambda: ports.unplug("ttyUSB0"), ""),
            ("plug it in", None, ""),
            ("expected a new port within 0.3 s, found none", None, None),
            ("unplug", lambda: ports.plug("ttyUSB0"), ""),
            ("found a new one, .*ttyUSB0; now unplug it", None, None),
            ("unplug", lambda: ports.unplug("ttyUSB0"), ""),
            ("plug it in", lambda: ports.plug("ttyUSB0", "ttyACM0"), ""),
            ("expected one new port, found 2: .*ttyACM0, .*ttyUSB0; once more", None, None),
            ("unplug", lambda: ports.unplug("ttyUSB0"), ""),
            ("plug it in", lambda: ports.plug("ttyUSB0"), ""),
            ("found the adapter at .*ttyUSB0", None, None),
        ]
    )
    assert ports.find(script) == "ttyUSB0"
    assert script.script == []


def test_it_may_be_left_out_or_ended(tmp_path: Path) -> None:
    ports = Ports(tmp_path)
    assert ports.find(Script([("unplug", None, "s")])) == ""
    with pytest.raises(Quit):
        ports.find(Script([("unplug", None, "q")]))


@pytest.fixture
def pipe(monkeypatch: pytest.MonkeyPatch) -> Iterator[int]:
    """The end of a pipe to write to; standard input is the other one."""
    reader, writer = os.pipe()
    with os.fdopen(reader) as stdin:
        monkeypatch.setattr("sys.stdin", stdin)
        yield writer
    os.close(writer)


def test_lines_are_answers_one_by_one(pipe: int) -> None:
    os.write(pipe, b"\n S \nq\nrest")
    asked = TerminalPerson()
    assert [asked.ask("?"), asked.ask("?"), asked.answer(), asked.answer()] == ["", "s", "q", None]


def test_a_pipe_that_stays_silent_is_told(pipe: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(keys, "PATIENCE", 0.05)
    with pytest.raises(BadInputError, match=r"an answer to 'go on\?', found none in 0.05 s"):
        TerminalPerson().ask("go on?")


def test_no_standard_input_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.stdin", None)
    with pytest.raises(BadInputError, match="found no standard input"):
        TerminalPerson().ask("go on?")


def test_without_pyserial_one_line_says_how_to_get_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "serial.tools", None)
    monkeypatch.delitem(sys.modules, "antennate.hardware.ports.serial_line", raising=False)
    with pytest.raises(ConfigError, match=r"expected pyserial for real ports, .* --extra hardware"):
        all_ports()
