"""A disk that fills up while a drive or a twin logs: told once, with its cause; nothing ends."""

from __future__ import annotations

import contextlib
import json
import re
import resource
import shutil
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from lockstep import BoardPort, LockstepClock
from test_drive_processes import ANTENNATE, Drive, twin
from test_simulated_logs import HEADER, as_made, made, walked

from antennate.cli import main
from antennate.errors import LogError, reason
from antennate.hardware.config import DriveConfig
from antennate.hardware.driving.connect import prepare
from antennate.hardware.safety.session import Session
from antennate.telemetry.reader import LogReader, count
from antennate.telemetry.simulated import TickLog
from antennate.telemetry.twin_log import LogQueue
from antennate.telemetry.writer import LogWriter
from antennate.twin.config import TwinConfig, watched
from antennate.types import JointCommand
from dynamixel_bus.port import PortError

ROOM = 70_000
"""Largest file [byte]: as a disk that is full once the log is as long; the result is shorter."""
CAUSE = (
    r"expected to write {}, found: (?:only \d+ of \d+ bytes were taken; the disk is full|"
    r"File too large); the log ends after (\d+) ticks"
)


@pytest.fixture(autouse=True)
def no_bytecode(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing is to be cut but the log."""
    monkeypatch.setenv("PYTHONDONTWRITEBYTECODE", "1")


def small_disk() -> None:
    resource.setrlimit(resource.RLIMIT_FSIZE, (ROOM, resource.RLIM_INFINITY))


def tiny_disk() -> None:
    """The log of 0.6 s of a twin does not fit; the header does."""
    resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, resource.RLIM_INFINITY))


@pytest.mark.ci
def test_a_drive_goes_on_and_counts_what_is_not_logged_at_once(tmp_path: Path) -> None:
    drive = Drive(tmp_path / "run")
    with (
        twin() as (places, _),
        subprocess.Popen(
            [*ANTENNATE, "drive", *places, "--dry-run", "8", "--out", "run"],
            cwd=tmp_path,
            preexec_fn=small_disk,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        ) as process,
    ):
        drive.read(process, lambda: False)
        assert process.stdout is not None
        out = " ".join(process.stdout.read().split())
    assert process.returncode == 2, drive.lines
    cause = CAUSE.format("run/drive.mcap")
    told = [line for line in drive.lines if re.search(cause, line)]
    assert len(told) == 1
    found = re.search(cause, told[0])
    assert found is not None
    at = drive.lines.index(told[0])
    before, after = (
        [int(number) for number in re.findall(r" unlogged=(\d+)", "\n".join(lines))]
        for lines in (drive.lines[:at], drive.lines[at:])
    )
    assert set(before) <= {0}
    assert after[0] > 0
    assert after == sorted(set(after)), "each line has more than the one before"
    result = drive.result
    assert result["unlogged"] == result["pace"]["ticks"] - count(drive.folder / "drive.mcap")
    assert (result["log_complete"], result["log_cut"]) == (False, True)
    assert result["log_failure"] == found[0]
    assert f"The log is not complete: {found[0]}. Its files: drive.mcap." in out


@pytest.mark.ci
def test_a_twin_tells_its_failed_log_with_the_cause_and_ends_with_2(tmp_path: Path) -> None:
    said, _ = walked(tmp_path, "--scene", "flat", "--log", "t.mcap", code=2, limits=tiny_disk)
    *_, last = said.splitlines()
    found = re.fullmatch("antennate twin: error: " + CAUSE.format("t.mcap"), last)
    assert found, said
    assert said.count("the twin goes on without it") == said.count("log: ") <= 1
    with LogReader(tmp_path / "t.mcap") as log:
        assert sum(1 for _ in log) >= int(found[1])


REMOVED = (
    r"expected to write (\S+), found: it was removed or renamed meanwhile; (\d+) ticks went with it"
)


def removed_is_said(result: dict[str, Any], out: str) -> None:
    """No complete log is claimed, and what was lost is said with the reason."""
    found = re.fullmatch(REMOVED, result["log_failure"])
    assert found is not None
    assert found[1].endswith("drive.mcap")
    assert (result["log_complete"], result["log_cut"], result["logs"]) == (False, True, [])
    assert result["unlogged"] == result["pace"]["ticks"] >= int(found[2])
    assert f"No log was kept: {found[0]}." in out


@pytest.mark.smoke
def test_a_drive_in_one_process_whose_folder_is_removed_says_what_is_lost(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    run = tmp_path / "run"

    @contextlib.contextmanager
    def in_process(config: DriveConfig, *addresses: object) -> Iterator[Session]:
        clock = LockstepClock(robot := watched(TwinConfig(), 5)[0])
        session = prepare(config, BoardPort(robot, clock), clock, clock)
        write = session.write

        def then_remove(command: JointCommand) -> None:
            write(command)
            if session.tally.ticks == 30:
                end = time.monotonic() + 60.0
                while not (run / "drive.mcap").exists() and time.monotonic() < end:
                    time.sleep(0.02)
                shutil.rmtree(run)

        monkeypatch.setattr(session, "write", then_remove)
        yield session

    monkeypatch.setattr("antennate.cli.drive.connect", in_process)
    argv = ["drive", "--esp32", "board", "--bus", "bus", "--dry-run", "0.5", "--out", str(run)]
    assert main(argv) == 2
    said = capsys.readouterr()
    removed_is_said(json.loads((run / "result.json").read_text()), " ".join(said.out.split()))
    assert (run / "config.toml").exists()


@pytest.mark.parametrize("gone", [shutil.rmtree, lambda path: path.rename(path.with_name("b"))])
def test_a_log_whose_file_has_lost_its_name_fails(gone: Any, tmp_path: Path) -> None:
    (folder := tmp_path / "a").mkdir()
    log = LogWriter(folder / "log.mcap", HEADER, 0.0, flush=0.0)
    gone(folder)
    with pytest.raises(LogError, match=REMOVED):
        log.close()
    assert log.kept == 0


@pytest.mark.parametrize(
    ("error", "said"),
    [
        (OSError(28, "No space left on device"), "No space left on device"),
        (OSError("a line\nand another"), "a line and another"),
        (OSError(), "OSError"),
        (PortError(" "), "PortError"),
        (TimeoutError(), "TimeoutError"),
    ],
)
def test_a_reason_is_never_empty(error: Exception, said: str) -> None:
    assert reason(error) == said


def test_a_log_behind_a_queue_says_once_why_it_has_failed(tmp_path: Path) -> None:
    """While it is written, not only at its end."""
    path, told = tmp_path / "log.mcap", list[str]()
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    try:
        resource.setrlimit(resource.RLIMIT_FSIZE, (ROOM, hard))
        log = LogQueue(TickLog(path, HEADER, as_made), told.append)
        end = time.monotonic() + 60.0
        for tick in made(6000):
            log.add(tick)
            if told or time.monotonic() > end:
                break
            time.sleep(0.002)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert len(told) == 1
    log.event("more", 100.0)
    assert log.close() == log.failure == told[0]
    assert log.dropped == 0
    assert re.fullmatch(CAUSE.format(re.escape(str(path))), told[0])
