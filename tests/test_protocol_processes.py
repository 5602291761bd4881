"""`antennate drive --protocol` before `antennate twin`: to its end, and broken off and gone on."""

from __future__ import annotations

import json
import os
import subprocess
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from first_hour import ANTENNATE, start

from antennate.telemetry.steps import steps

pytestmark = pytest.mark.ci

PROTOCOL = """
carry = 1.5
reach = 0.5
[[steps]]
place = "hanging"
joint = "yaw1"
seconds = 2.0
[[steps]]
place = "hanging"
joint = "leg_r2"
seconds = 3.0
[[steps]]
maneuver = "FORWARD"
seconds = 1.0
[[steps]]
place = "hand"
antenna = "left"
mark = 80.0
seconds = 1.0
"""
NAMES = ["yaw1", "leg_r2", "forward", "left"]
PATIENT = ["--limits.late-answers", "100", "--limits.silent-answers", "100"]


class Place:
    """A folder with a twin that takes orders from a pipe, and a protocol."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        (folder / "short.toml").write_text(PROTOCOL)
        os.mkfifo(folder / "orders")
        words = ["twin", "--scene", "flat", "--orders", "orders", "--robot-toml", "twin.toml"]
        self.twin = start(words, folder)
        assert self.twin.stdout is not None
        assert json.loads(self.twin.stdout.readline())

    def order(self, text: str) -> None:
        (self.folder / "orders").write_text(f"{text}\n")

    def drive(
        self, out: str, *words: str, seen: str = "", act: Callable[[], None] = lambda: None
    ) -> tuple[int, str, str]:
        """A drive: its exit code, its sentences and what it said; `act` once it said `seen`."""
        usual = ["--config", "twin.toml", "--dry-run", "1", "--no-touch-check", "--arm"]
        usual += ["--protocol", "short.toml", "--tell", "orders", "--out", out, "--fault-time", "1"]
        said: list[str] = []
        with start(["drive", *usual, *words], self.folder) as process:
            assert process.stderr is not None
            for line in process.stderr:
                said.append(line.decode())
                if seen and seen in said[-1]:
                    act()
                    seen = ""
            assert process.stdout is not None
            text = process.stdout.read().decode()
        return process.returncode, text, "".join(said)


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Place]:
    there = Place(tmp_path_factory.mktemp("protocol"))
    with there.twin:
        yield there
        there.twin.kill()


def test_a_protocol_runs_through_and_its_log_has_all_steps(place: Place) -> None:
    code, _, said = place.drive("whole", *PATIENT)
    folder = place.folder / "whole"
    assert code == 0, said
    assert [(s.name, s.whole) for s in steps(folder / "drive.mcap")] == [(n, True) for n in NAMES]
    for number, name in enumerate(NAMES, 1):
        assert f"Step {number} of 4: {name}, " in said
    assert json.loads((folder / "result.json").read_text())["protocol"]["left"] == []
    again, _, said = place.drive("whole", *PATIENT)
    assert again == 2
    assert said.count("\n") == 1


def test_a_lost_servo_ends_it_and_given_again_it_goes_on_with_the_broken_step(
    place: Place,
) -> None:
    code, text, said = place.drive(
        "broken", seen="Step 2 of 4", act=lambda: place.order("fault servo:7=silent")
    )
    assert code == 2, said
    assert "FAULT" in text
    assert "It goes on with leg_r2: " in text
    place.order("fault servo:7=none")
    place.order("fault servo:7=reboot")
    time.sleep(1.0)
    code, text, said = place.drive("broken")
    assert code == 0, said + text
    log = place.folder / "broken" / "drive.mcap"
    assert (log.parent / "drive-2.mcap").exists()
    assert [(s.name, s.whole) for s in steps(log)] == [
        ("yaw1", True),
        ("leg_r2", False),
        *((name, True) for name in NAMES[1:]),
    ]
    info = [*ANTENNATE, "log", "info", str(log)]
    assert b"it is complete" in subprocess.run(info, check=True, capture_output=True).stdout
