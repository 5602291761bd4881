"""Ticks on their way to another process: the loop waits for nobody, and nothing is lost unseen."""

from __future__ import annotations

import io
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from antennate.errors import LogError
from antennate.params import ControllerParams
from antennate.telemetry.feed import Feed, messages
from antennate.telemetry.header import Header
from antennate.telemetry.reader import LogReader
from antennate.telemetry.ticks import Tick

HEADER = Header(controller="paper", params=ControllerParams())
PAIR = (1.0, 2.0)


def tick(number: int) -> Tick:
    return Tick(
        number, 0.01 * number, 0.01 * number, PAIR, PAIR, PAIR, (0, 1), 0, 0.5, (0.25,) * 19,
        state="OK", note="touch=passed", age=0.005, sent=number,
    )  # fmt: skip


def viewer(path: Path) -> list[str]:
    return [sys.executable, "-m", "antennate.cli.viewer", str(path)]


def test_the_viewer_keeps_every_tick_in_order(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    with Feed(viewer(tmp_path / "drive.log"), HEADER.pack()) as feed:
        for number in range(1, 301):
            assert feed.send(tick(number).pack())
    assert (feed.dropped, feed.failed) == (0, False)
    with LogReader(tmp_path / "drive.log") as log:
        assert list(log) == [tick(number) for number in range(1, 301)]
        assert (log.header, log.end, log.bad) == (HEADER, 300, 0)
    said = capfd.readouterr().err
    assert "OK FORWARD counts=1,2" in said
    assert "touch=passed" in said


def test_G5_a_reader_that_stands_still_costs_no_time_and_what_it_misses_is_counted() -> None:
    """A pipe holds 1 MiB at most, 400 bytes a tick: 3000 ticks do not fit twice."""
    count = "import sys; print(len(sys.stdin.buffer.read()))"
    feed = Feed([sys.executable, "-c", f"import time; time.sleep(1.0); {count}"], b"first")
    content = bytes(400)
    with feed:
        begin = time.monotonic()
        taken = sum(feed.send(content) for _ in range(6000))
        assert time.monotonic() - begin < 0.9, "it must not wait for the reader"
    assert taken + feed.dropped == 6000
    assert feed.dropped > 3000
    assert not feed.failed


def test_G6_a_reader_that_dies_ends_nothing() -> None:
    with Feed([sys.executable, "-c", "pass"], b"first") as feed:
        end = time.monotonic() + 10.0
        while feed.send(b"tick") and time.monotonic() < end:
            time.sleep(0.01)
        assert not feed.send(b"tick")
    assert feed.failed


def test_a_killed_loop_is_told_from_one_that_ended(tmp_path: Path) -> None:
    log = tmp_path / "drive.log"
    loop = (
        "import os, signal, sys, time\nfrom antennate.telemetry.feed import Feed\n"
        f"feed = Feed({viewer(log)!r}, {HEADER.pack()!r})\nfeed.__enter__()\n"
        f"feed.send({tick(1).pack()!r})\ntime.sleep(0.2)\nos.kill(os.getpid(), signal.SIGKILL)"
    )
    with subprocess.Popen(
        [sys.executable, "-c", loop], stderr=subprocess.PIPE, text=True
    ) as killed:
        said = killed.communicate(timeout=30)[1]  # until the viewer has ended too
    assert killed.returncode == -signal.SIGKILL
    assert "its process was killed" in said
    with LogReader(log) as kept:
        assert list(kept) == [tick(1)]
        assert kept.end is None


@pytest.mark.parametrize("cut", [1, 7, 9])
def test_a_stream_that_breaks_off_is_no_end(cut: int) -> None:
    whole = b"\2\0\0\0" + bytes(4) + b"ab"
    assert [m.content for m in messages(io.BytesIO(whole + bytes(8)))] == [b"ab"]
    with pytest.raises(LogError, match="killed"):
        list(messages(io.BytesIO(whole[:cut])))


def test_a_log_that_cannot_be_written_is_said_once_and_the_status_line_goes_on(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    taken = tmp_path / "drive.log"
    taken.write_text("another drive")
    with Feed(viewer(taken), HEADER.pack()) as feed:
        feed.send(tick(1).pack())
    assert feed.failed
    said = capfd.readouterr().err
    assert said.count("does not exist yet") == 1
    assert "OK FORWARD" in said
    assert taken.read_text() == "another drive"


def test_ctrl_c_does_not_end_the_viewer_before_the_loop(tmp_path: Path) -> None:
    log = tmp_path / "drive.log"
    with Feed(viewer(log), HEADER.pack()) as feed:
        feed.send(tick(1).pack())
        end = time.monotonic() + 20.0
        while (
            not (log.exists() and log.stat().st_size > len(HEADER.pack()) + 100)
            and time.monotonic() < end
        ):
            time.sleep(0.01)
        assert feed._process is not None  # pyright: ignore[reportPrivateUsage]
        os.kill(feed._process.pid, signal.SIGINT)  # pyright: ignore[reportPrivateUsage]
        feed.send(tick(2).pack())
    assert not feed.failed
    with LogReader(log) as kept:
        assert len(list(kept)) == 2


def _holds_a_tick(log: Path) -> bool:
    return log.exists() and log.stat().st_size > len(HEADER.pack()) + 100
