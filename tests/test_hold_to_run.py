"""A key that is held lets the robot walk; signals of any number end a drive with its report."""

from __future__ import annotations

import json
import os
import pty
import select
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from stated import STATED
from test_drive_processes import ANTENNATE, twin
from twin_rig import rig

from antennate.hardware.config import DriveConfig
from antennate.hardware.driving.drive import Operator, drive
from antennate.hardware.driving.stopping import DeadMan
from antennate.hardware.safety.session import Session
from antennate.messages import typed
from antennate.params.hardware import DeadManParams
from antennate.twin.config import TwinConfig

REPEATS = {"Linux console": (0.25, 1 / 10.9), "X server": (0.66, 1 / 25)}
"""Pause before a held key repeats, and between repeats [s]: kbdrate(8), and xset(1)'s defaults."""
TICK = 0.01


def held(key: tuple[float, float], until: float) -> set[int]:
    """Ticks in which a key that is held from 1 s on gives a character."""
    pause, period = key
    count = int((until - 1.0 - pause) / period) + 1
    times = [1.0, *(1.0 + pause + i * period for i in range(count))]
    return {round(t / TICK) for t in times if t < until}


@pytest.mark.parametrize("key", REPEATS.values(), ids=REPEATS.keys())
def test_a_held_key_lets_it_walk_until_the_stated_time_after_its_release(
    key: tuple[float, float],
) -> None:
    params, walked = DeadManParams(), list[float]()
    n, over, characters = 0, None, held(key, 5.0)
    dead = DeadMan(params, lambda: n in characters)
    for n in range(1, 1500):
        now = n * TICK
        dead.step(now, torque=True)
        if not dead.released:
            walked.append(now)
        if dead.over and over is None and now > 5.0:
            over = now
    pause, period = key
    assert walked[0] <= 1.0 + pause + period + 2 * TICK
    assert walked == pytest.approx([walked[0] + i * TICK for i in range(len(walked))])
    assert 5.0 - period <= walked[-1] <= 5.0 + params.release
    assert over is not None
    assert walked[-1] + params.off <= over <= walked[-1] + params.off + 2 * TICK


def test_single_presses_never_let_it_walk() -> None:
    now = 0.0
    dead = DeadMan(DeadManParams(), lambda: now % 0.5 < 1e-9)
    for n in range(1000):
        now = n / 100
        dead.step(now, torque=True)
        assert dead.released


class Hand:
    """Holds a key from the second second of the drive on, and lets go of it for a while."""

    def __init__(self) -> None:
        self.t = 0.0
        self.walked = list[float]()
        self.torque = list[float]()

    def pressed(self) -> bool:
        return 2.0 <= self.t < 3.0 or 4.0 <= self.t < 5.0

    def look(self, session: Session, t: float) -> None:
        self.t += session.period
        if session.tally.sent > len(self.walked):
            self.walked.append(self.t)
        if session.actuators.enabled:
            self.torque.append(self.t)


@pytest.mark.ci
def test_without_a_key_there_is_no_torque_and_after_its_release_first_no_motion() -> None:
    made, hand = rig(TwinConfig()), Hand()
    params = DeadManParams(off=1.5)
    config = DriveConfig(dry_run=0.5, touch_check=False, hold_to_run=True, dead_man=params)
    report = drive(made.session, config, True, hand.look, Operator(pressed=hand.pressed))
    assert 2.0 < hand.torque[0] < 2.5
    between = [t for t in hand.walked if 3.0 + params.release + 0.05 < t < 4.0]
    assert between == []
    assert any(2.2 < t < 3.0 for t in hand.walked)
    assert any(4.3 < t < 5.0 for t in hand.walked)
    assert max(hand.walked) < 5.0 + params.release + 0.05
    assert hand.torque[-1] == pytest.approx(5.0 + params.release + 1.5, abs=0.1)
    assert report.safe
    assert report.ended == "a key that was let go"
    assert not any(servo.torque for servo in made.robot.servos)


@pytest.mark.slow
def test_a_key_let_go_again_and_again_is_no_fault() -> None:
    made = rig(TwinConfig())
    presses = iter([True, True, *[False] * 40] * 30)
    config = DriveConfig(dry_run=0.2, duration=4.0, touch_check=False, hold_to_run=True)
    report = drive(made.session, config, True, operator=Operator(pressed=lambda: next(presses)))
    assert report.worst.name == "HOLD"
    assert report.ended == "the end of its time"


@pytest.mark.ci
def test_it_needs_a_terminal_and_says_so(tmp_path: Path) -> None:
    words = ["drive", "--esp32", "a", "--bus", "b", "--hold-to-run", "--out", str(tmp_path / "r")]
    run = subprocess.run(
        [*ANTENNATE, *words], stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False
    )
    assert run.returncode == 2
    assert run.stderr == (
        "antennate drive: error: --hold-to-run: expected a terminal as standard input, whose keys "
        "can be held, found none\n"
    )
    assert not (tmp_path / "r").exists()


@pytest.mark.slow
def test_B19_a_key_held_in_a_terminal_is_the_dead_man_of_the_shipped_command(
    tmp_path: Path,
) -> None:
    folder = tmp_path / "run"
    words = ["drive", "--arm", "--no-touch-check", "--dry-run", "1", "--hold-to-run"]
    words += STATED
    words += ["--dead-man.off", "1", "--out", str(folder)]
    with twin() as (places, _):
        child, terminal = pty.fork()
        if child == 0:
            os.execv(sys.executable, [*ANTENNATE, *words, *places])
        text, begun, let_go = "", None, False
        while True:
            if not let_go:
                os.write(terminal, b" ")
            ready = select.select([terminal], [], [], 0.04)[0]
            try:
                text += os.read(terminal, 65536).decode() if ready else ""
            except OSError:
                break
            if begun is None and (" s OK maneuver" in text or " s DEGRADED (" in text):
                begun = time.monotonic()
            let_go = let_go or (begun is not None and time.monotonic() > begun + 2.0)
        assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
    result = json.loads((folder / "result.json").read_text())
    assert result["ended"] == "a key that was let go"
    assert result["torque_off"] is True
    assert "HOLD RELEASED" in result["why"]
    assert result["commands_sent"] > 100


@pytest.mark.slow
@pytest.mark.parametrize("name", ["SIGINT", "SIGQUIT", "SIGTERM", "SIGHUP"])
def test_B19_a_signal_sent_again_and_again_loses_no_report(name: str, tmp_path: Path) -> None:
    folder = tmp_path / "run"
    words = ["drive", "--arm", "--no-touch-check", "--dry-run", "1", "--out", str(folder)]
    words += STATED
    with (
        twin() as (places, _),
        subprocess.Popen(
            [*ANTENNATE, *words, *places],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
        ) as process,
    ):
        assert process.stderr is not None
        for line in process.stderr:
            if " sent=" in line and " sent=0 " not in line:
                break
        while process.poll() is None:
            os.killpg(process.pid, getattr(signal, name))
            time.sleep(0.02)
        out, err = process.communicate()
    assert process.returncode == 0
    assert json.loads((folder / "result.json").read_text())["torque_off"] is True
    assert err.splitlines()[-1] == f"written to {folder}"
    assert f"What was read and decided: {typed('replay')} " in out
    assert "ended by a signal; torque is off, verified." in out
