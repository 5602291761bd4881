"""`antennate drive` as it is shipped, with somebody's own controller, before a twin elsewhere."""

from __future__ import annotations

import json
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest
from stated import STATED

from antennate.telemetry.reader import count

pytestmark = pytest.mark.ci

HERE = Path(__file__).parent
EXAMPLE = f"{HERE.parent / 'examples' / 'own_controller.py'}:OwnController"
ANTENNATE = [sys.executable, "-m", "antennate"]
MOST = 120
"""Longest walk [s]: an end, should nothing of what is waited for be said."""
RESTART = 1.0
"""Time in which a board is back after a reset [s]: half of it in silence."""
ATTEMPTS = 3
NO_SERVO = ["--limits.late-answers", "100", "--limits.silent-answers", "100"]
"""A machine that stands still for a while, as one that runs tests may, is no broken servo."""
OPEN = " HOLD (OPEN: a channel floats: its wire is open"
SHORT = " HOLD (SHORT_LO: a channel is shorted to ground"


@dataclass
class Drive:
    """A drive and what it has said."""

    folder: Path
    code: int | None = None
    lines: list[str] = field(default_factory=list)

    @property
    def result(self) -> dict[str, Any]:
        return json.loads((self.folder / "result.json").read_text())

    @property
    def sent(self) -> int:
        """Commands sent, as it said last."""
        found = re.search(r" sent=(\d+) ", self.lines[-1]) if self.lines else None
        return int(found[1]) if found else 0

    def read(self, process: subprocess.Popen[str], enough: Callable[[], bool]) -> None:
        """Read what it says until that is enough, or until it ends."""
        assert process.stderr is not None
        for line in process.stderr:
            self.lines.append(line.rstrip("\n"))
            if enough():
                return


@contextmanager
def twin(*scene: str) -> Iterator[tuple[list[str], Callable[[str], None]]]:
    """A twin: the arguments that lead to it, and what breaks it at once."""
    words = [sys.executable, str(HERE / "twin_process.py"), *scene]
    pipes: Any = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
    with subprocess.Popen(words, **pipes) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        stdin = process.stdin

        def fault(text: str) -> None:
            stdin.write(text + "\n")
            stdin.flush()

        places = json.loads(process.stdout.readline())
        try:
            yield ["--esp32", places["esp32"], "--bus", places["bus"]], fault
        finally:
            process.kill()


@pytest.fixture(scope="module")
def driven(tmp_path_factory: pytest.TempPathFactory) -> Drive:
    """A drive whose board resets twice, and of whose antennae one wire breaks, then shorts.

    A machine that stands still for 100 ms lets the watchdogs of all servos end it, as they must, or
    servos answer too late for the questions before a drive; then there is another one.
    """
    for _ in range(ATTEMPTS):
        drive = drive_with_faults(tmp_path_factory.mktemp("drive") / "run")
        if not drive.folder.exists():
            assert drive.code == 2, drive.lines
        elif "WATCHDOG" not in drive.result["why"]:
            break
    assert drive.folder.exists(), drive.lines
    return drive


def drive_with_faults(folder: Path) -> Drive:
    """One such drive, its run in a folder."""
    drive = Drive(folder)
    words = ["drive", "--arm", "--no-touch-check", "--controller", EXAMPLE]
    words += STATED
    words += ["--dry-run", "3", "--duration", f"{MOST}", "--limits.repeats", "100", *NO_SERVO]
    with (
        twin() as (places, fault),
        subprocess.Popen(
            [*ANTENNATE, *words, *places, "--out", str(drive.folder)],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
        ) as process,
    ):
        drive.read(process, lambda: " maneuver=" in drive.lines[-1])
        fault("esp32=reset")
        time.sleep(RESTART)
        drive.read(process, lambda: drive.sent > 0)
        fault("esp32=reset")
        time.sleep(RESTART)
        walked = drive.sent
        drive.read(process, lambda: drive.sent >= walked + 150)
        fault("esp32=open_left")
        drive.read(process, lambda: OPEN in drive.lines[-1])
        fault("esp32=short_left")
        drive.read(process, lambda: SHORT in drive.lines[-1])
        process.send_signal(signal.SIGINT)
        drive.read(process, lambda: False)
    drive.code = process.returncode
    return drive


def test_E1_a_reset_or_a_broken_wire_ends_no_drive(driven: Drive) -> None:
    """It goes on until it is stopped, torque off, with its result and every tick in its log."""
    result = driven.result
    assert driven.code == 0, driven.lines[-5:]
    assert driven.lines[-1] == f"written to {driven.folder}"
    assert not any("Traceback" in line for line in driven.lines)
    assert result["worst_state"] == "HOLD"
    assert result["torque_off"] is True
    assert result["resets"] == 2
    assert result["lost_samples"] < 100
    assert (result["unlogged"], result["log_complete"]) == (0, True)
    assert count(driven.folder / result["logs"][0]) == result["pace"]["ticks"]


@pytest.mark.parametrize("cause", [OPEN, SHORT], ids=["open", "short"])
def test_S1_S2_what_is_wrong_with_a_wire_is_said_through_bytes(driven: Drive, cause: str) -> None:
    assert any(cause in line for line in driven.lines)


def test_a_controller_of_ones_own_drives_another_process(driven: Drive) -> None:
    assert driven.result["controller"] == EXAMPLE
    assert driven.result["commands_sent"] > 150  # it walked on after the reset


@pytest.mark.slow
def test_B15_two_servos_of_one_id_are_named_by_the_command(tmp_path: Path) -> None:
    with twin() as (places, fault):
        fault("servo:7=id:8")
        time.sleep(1.0)
        words = [*ANTENNATE, "drive", *places, "--out", str(tmp_path / "run")]
        run = subprocess.run(words, capture_output=True, text=True, timeout=60, check=False)
    assert run.returncode == 2
    (line,) = run.stderr.splitlines()
    assert "id 7: silent, perhaps it answers as 8; id 8: two servos answer with this id" in line
    assert not (tmp_path / "run").exists()
