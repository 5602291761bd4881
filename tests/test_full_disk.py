"""A disk that fills up while a drive or a twin logs: told once, with its cause; nothing ends."""

from __future__ import annotations

import re
import resource
import subprocess
import time
from pathlib import Path

import pytest
from test_drive_processes import ANTENNATE, Drive, twin
from test_simulated_logs import HEADER, rows, walked

from antennate.telemetry.apart import LogProcess
from antennate.telemetry.reader import LogReader, count

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
    assert process.returncode == 0, drive.lines
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
    assert result["log_complete"] is False
    assert result["log_failure"] == found[0]
    assert f"The log is not complete: {found[0]}. Its files: drive.mcap." in out


def test_a_twin_tells_its_failed_log_with_the_cause_and_ends_with_2(tmp_path: Path) -> None:
    said, _ = walked(tmp_path, "--scene", "flat", "--log", "t.mcap", code=2, limits=tiny_disk)
    *_, last = said.splitlines()
    found = re.fullmatch("antennate twin: error: " + CAUSE.format("t.mcap"), last)
    assert found, said
    assert said.count("the twin goes on without it") == said.count("log: ") <= 1
    with LogReader(tmp_path / "t.mcap") as log:
        assert sum(1 for _ in log) >= int(found[1])


def test_a_log_of_another_process_says_once_why_it_has_failed(tmp_path: Path) -> None:
    """While it is written, not only at its end."""
    path, told = tmp_path / "log.mcap", list[str]()
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    try:
        resource.setrlimit(resource.RLIMIT_FSIZE, (ROOM, hard))
        log = LogProcess(path, HEADER, told.append)
        end = time.monotonic() + 60.0
        for row in rows(6000):
            log.add(row)
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
