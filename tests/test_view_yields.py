"""A live view beside a loop in real time: it gives way, and it is given up."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from stated import STATED
from view_rig import ANTENNATE, PATIENCE, shown, told

from antennate.cli import pages
from antennate.hardware.driving.report import MANY, Recent
from antennate.telemetry.view.channel import TICK
from antennate.telemetry.view.process import ViewProcess

LINUX = hasattr(os, "sched_setscheduler")


def test_ticks_missed_within_a_second_are_counted_from_a_second_ago() -> None:
    recent = Recent()
    assert [recent.step(0.1 * i, 0) for i in range(10)] == [0] * 10
    assert recent.step(1.0, 4) == 4
    assert recent.step(1.9, 6) == 6
    assert recent.step(2.5, 7) == 1, "the four and the two of 1.0 and 1.9 s were before 1.5 s"


@pytest.fixture
def page() -> Iterator[tuple[ViewProcess, list[str]]]:
    """A page that gives way, and what is said of its end."""
    pytest.importorskip("viser")
    said: list[str] = []
    with ViewProcess(0, pages.MODULE, on_lost=said.append, idle=True) as process:
        yield process, said


@pytest.mark.smoke
def test_a_view_is_given_up_at_once_and_one_line_says_why(
    page: tuple[ViewProcess, list[str]],
) -> None:
    process, said = page
    before = time.monotonic()
    process.give_up("the loop missed 9 ticks within a second; the drive goes on")
    assert time.monotonic() - before < 1.0, "a loop cannot wait for the end of another process"
    end = time.monotonic() + 20.0
    while not said and time.monotonic() < end:
        process.channel.send(TICK, b"one more")
        time.sleep(0.02)
    assert said == ["view: given up, as the loop missed 9 ticks within a second; the drive goes on"]


def children() -> set[str]:
    """Numbers of the processes that this thread has begun."""
    return set(Path(f"/proc/self/task/{os.getpid()}/children").read_text().split())


@pytest.mark.ci
@pytest.mark.skipif(not LINUX, reason="only Linux has SCHED_IDLE")
def test_every_thread_of_a_view_beside_a_drive_gives_way(request: pytest.FixtureRequest) -> None:
    others = children()  # those of tests before it, as of a pool of workers
    request.getfixturevalue("page")
    (child,) = children() - others
    threads = [int(thread.name) for thread in Path(f"/proc/{child}/task").iterdir()]
    assert len(threads) > 1
    assert {os.sched_getscheduler(thread) for thread in threads} == {os.SCHED_IDLE}


@pytest.mark.ci
@pytest.mark.skipif(not LINUX, reason="a stopped process goes on, as it is done on Linux")
@pytest.mark.parametrize("armed", [False, True])
def test_a_late_loop_gives_its_view_up_once_servos_have_torque(tmp_path: Path, armed: bool) -> None:
    pytest.importorskip("viser")
    with shown("twin", folder=tmp_path) as twin:
        ports = json.loads(twin.answer())
        words = ["drive", "--esp32", ports["esp32"], "--bus", ports["bus"], "--view"]
        words += ["--view-port", "0", "--out", "run", "--no-touch-check"]
        words += ["--arm", "--dry-run", "0"] if armed else ["--dry-run", "600"]
        words += STATED
        with shown(*words, folder=tmp_path) as driven:
            told(driven, "maneuver=FORWARD" if armed else "missed_ticks=")
            driven.process.send_signal(signal.SIGSTOP)
            time.sleep(0.5)
            driven.process.send_signal(signal.SIGCONT)
            if armed:
                driven.said("view: given up, as the loop missed ")
            else:
                time.sleep(2.0)
            driven.process.send_signal(signal.SIGINT)
            driven.process.wait(PATIENCE)
    result = json.loads((tmp_path / "run" / "result.json").read_text())
    assert result["pace"]["missed_cycles"] > MANY
    assert ("view: given up" in "".join(driven.lines)) is armed


@contextmanager
def busy(count: int) -> Iterator[None]:
    """So many programs that do nothing but compute."""
    words = [sys.executable, "-c", "while True: pass"]
    others = [subprocess.Popen(words) for _ in range(count)]
    try:
        yield
    finally:
        for other in others:
            other.kill()
            other.wait()


@pytest.mark.slow
@pytest.mark.skipif(not LINUX, reason="real-time priority is of Linux")
def test_a_drive_with_a_view_beside_two_busy_programs_ends_in_no_fault(tmp_path: Path) -> None:
    """The view may be given up; where the same drive without one fails, it says nothing."""
    pytest.importorskip("viser")

    def drive(name: str, *more: str) -> tuple[int, str]:
        with subprocess.Popen([*ANTENNATE, "twin"], stdout=-1, stderr=-3, cwd=tmp_path) as twin:
            assert twin.stdout is not None
            ports = json.loads(twin.stdout.readline())
            words = ["drive", "--esp32", ports["esp32"], "--bus", ports["bus"], "--arm"]
            words += STATED
            words += ["--dry-run", "1", "--no-touch-check", "--duration", "10", "--out", name]
            with busy(2):
                done = subprocess.run(
                    [*ANTENNATE, *words, *more], cwd=tmp_path, capture_output=True, text=True
                )
            twin.terminate()
        return done.returncode, done.stderr

    code, said = drive("seen", "--view", "--view-port", "0")
    if "too busy" in said or (code != 0 and drive("unseen")[0] != 0):
        pytest.skip("this machine is too busy for a drive without a view, too")
    assert code == 0, said
    result = json.loads((tmp_path / "seen" / "result.json").read_text())
    assert result["worst_state"] != "FAULT"
    assert said.count("view: given up") <= 1
    missed = result["walking"]["missed_share"]
    sys.stdout.write(f"missed {missed:.1%}, given up: {'given up' in said}, at {MANY}\n")
