"""Which port is which, by unplugging and plugging in."""

from __future__ import annotations

from pathlib import Path

import pytest
from setup_rig import Script

from antennate.hardware.setup.person import Quit, find_port, ports_like


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
