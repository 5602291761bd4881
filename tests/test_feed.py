"""Ticks on their way to another process: the loop waits for nobody, and nothing is lost unseen."""

from __future__ import annotations

import io
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from antennate.cli.viewer import REQUIRED
from antennate.errors import LogError
from antennate.host import STOPS
from antennate.params.control import ControlParams
from antennate.telemetry.feed import KEPT, Feed, messages
from antennate.telemetry.header import Header, part
from antennate.telemetry.reader import LogReader, count
from antennate.telemetry.ticks import Tick

HEADER = Header(controller="paper", params=ControlParams())
PAIR = (1.0, 2.0)


def tick(number: int) -> Tick:
    return Tick(
        number, 0.01 * number, 0.01 * number, PAIR, PAIR, PAIR, (0, 1), 0, 0.5, (0.25,) * 19,
        state="OK", note="touch=passed", age=0.005, sent=number,
    )  # fmt: skip


def viewer(path: Path, *words: str) -> Callable[[int], list[str]]:
    """The viewer that keeps a log, as `antennate drive` starts it."""
    begin = [sys.executable, "-m", "antennate.cli.viewer"]
    return lambda number: [*begin, str(part(path, number)), *words]


def script(source: str) -> Callable[[int], list[str]]:
    return lambda number: [sys.executable, "-c", source]


def until(true: Callable[[], object], feed: Feed, begin: int = 1) -> tuple[int, float]:
    """Send a tick every 10 ms until something is true: the next number, the longest sending."""
    number, worst, end = begin, 0.0, time.monotonic() + 90.0
    while not true() and time.monotonic() < end:
        before = time.thread_time()
        feed.send(tick(number).pack())
        worst = max(worst, time.thread_time() - before)
        number += 1
        time.sleep(0.01)
    assert true()
    return number, worst


@pytest.mark.ci
def test_the_viewer_keeps_every_tick_in_order(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    with Feed(viewer(tmp_path / "drive.mcap"), HEADER.pack()) as feed:
        for number in range(1, 301):
            assert feed.send(tick(number).pack())
    assert (feed.dropped, feed.failed) == (0, False)
    with LogReader(tmp_path / "drive.mcap") as log:
        assert list(log) == [tick(number) for number in range(1, 301)]
        assert (log.header, log.end, log.bad) == (HEADER, 300, 0)
    said = capfd.readouterr().err
    assert "OK maneuver=FORWARD counts=1,2" in said
    assert "touch=passed" in said


@pytest.mark.ci
def test_G5_a_reader_that_stands_still_costs_no_time_and_what_it_misses_is_counted() -> None:
    """A pipe holds 1 MiB at most, 400 bytes a tick; 3000 more wait: 6000 do not fit twice."""
    count = "import sys; print(len(sys.stdin.buffer.read()))"
    feed = Feed(script(f"import time; time.sleep(1.0); {count}"), b"first")
    content = bytes(400)
    with feed:
        begin = time.monotonic()
        taken = sum(feed.send(content) for _ in range(12000))
        assert time.monotonic() - begin < 0.9, "it must not wait for the reader"
    assert taken + feed.dropped == 12000
    assert feed.dropped > 6000
    assert not feed.failed


@pytest.mark.ci
def test_G5_a_recorder_that_starts_late_misses_no_tick(tmp_path: Path) -> None:
    """40 s of ticks with causes are sent before it reads a byte; the pipe alone holds 13 s."""
    log, go = tmp_path / "drive.mcap", tmp_path / "go"
    late = (
        "import os, sys, time\n"
        f"while not os.path.exists({str(go)!r}): time.sleep(0.01)\n"
        f"os.execv(sys.executable, {viewer(log)(1)!r})"
    )
    causes = ("FAULT NOT_READY: " + 400 * "x",)
    contents = [replace(tick(number), causes=causes).pack() for number in range(1, 4001)]
    assert len(contents[0]) > 750
    with Feed(script(late), HEADER.pack()) as feed:
        assert all(feed.send(content) for content in contents)
        assert not feed.keeps
        go.touch()
    assert (feed.dropped, feed.complete) == (0, True)
    with LogReader(log) as kept:
        assert [each.number for each in kept] == list(range(1, 4001))


@pytest.mark.ci
def test_G6_a_reader_that_dies_ends_nothing() -> None:
    """It dies at once, and so do those that follow: after three of them no more is started."""
    with Feed(script("pass"), b"first", restarts=3) as feed:
        until(lambda: feed.failed, feed)
        assert not feed.send(b"tick")
        assert not feed.keeps
    assert feed.failure == "the process that writes it ended with exit code 0"
    assert feed.started == 4
    assert not feed.complete


@pytest.mark.ci
def test_G6_a_recorder_that_is_killed_is_followed_by_one_with_a_new_file(tmp_path: Path) -> None:
    first, second = tmp_path / "drive.mcap", tmp_path / "drive-2.mcap"
    with Feed(viewer(first), HEADER.pack()) as feed:
        number, _ = until(lambda: feed.keeps and _holds_a_tick(first), feed)
        assert feed.pid is not None
        os.kill(feed.pid, signal.SIGKILL)
        killed = number
        number, worst = until(lambda: _holds_a_tick(second), feed, number)
        assert worst < 0.01, "the loop must not do the work of starting it"
        number, _ = until(lambda: feed.keeps, feed, number)
    assert (feed.started, feed.failed, feed.complete) == (2, False, False)
    assert feed.failure == "the process that writes it was ended by signal 9"
    with LogReader(first) as log:
        numbers = [each.number for each in log]
        assert (log.parts, log.header, log.bad) == ((first, second), HEADER, 0)
    gap = [n for n in range(1, number) if n not in numbers]
    assert numbers == sorted(numbers)
    assert len(gap) == log.missing <= killed
    assert number - 1 in numbers, "what is sent while the new one starts waits for it"


@pytest.mark.ci
def test_G6_a_record_that_is_required_is_given_up_with_its_process(tmp_path: Path) -> None:
    """So that the loop hears of a disk that fails, not only of a process that dies."""
    taken = tmp_path / "drive.mcap"
    taken.write_text("another drive")
    with Feed(viewer(taken, REQUIRED), HEADER.pack()) as feed:
        assert not feed.keeps
        until(lambda: feed.keeps, feed)
        assert feed.started == 2
    with LogReader(tmp_path / "drive-2.mcap") as log:
        assert log.header == HEADER


@pytest.mark.ci
def test_G6_a_record_that_is_required_is_not_kept_while_its_process_stands_still() -> None:
    """It has said that it keeps what it gets, and then takes nothing more."""
    stuck = f"import os, time; os.write(1, {KEPT!r}); time.sleep(60)"
    with Feed(script(stuck), b"first", restarts=0) as feed:
        until(lambda: feed.keeps, feed)
        while feed.send(bytes(400)):
            pass
        assert not feed.keeps
        assert feed.pid is not None
        os.kill(feed.pid, signal.SIGKILL)


@pytest.mark.ci
def test_G6_ticks_that_a_killed_process_had_not_kept_yet_are_counted(tmp_path: Path) -> None:
    """It stood still with them in its pipe; none of them was dropped before."""
    first, second = tmp_path / "drive.mcap", tmp_path / "drive-2.mcap"
    with Feed(viewer(first), HEADER.pack()) as feed:
        number, _ = until(lambda: feed.keeps and _holds_a_tick(first), feed)
        assert feed.pid is not None
        os.kill(feed.pid, signal.SIGSTOP)
        for waiting in range(number, number + 50):
            assert feed.send(tick(waiting).pack())
        os.kill(feed.pid, signal.SIGKILL)
        number, _ = until(lambda: _holds_a_tick(second), feed, number + 50)
    assert feed.offered == number - 1
    assert feed.offered - count(first) >= 50
    first.unlink()
    with LogReader(second) as log:
        assert count(first) == len(list(log))


@pytest.mark.ci
def test_G6_ticks_that_went_to_a_process_which_never_began_are_shown_by_the_next(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    go = tmp_path / "go"
    wait = f"while not os.path.exists({str(go)!r}): time.sleep(0.01)"
    dies, follows = script(f"import os, time\n{wait}"), viewer(tmp_path / "drive.mcap")
    with Feed(lambda n: (dies if n == 1 else follows)(n), HEADER.pack()) as feed:
        for number in range(1, 51):
            assert feed.send(tick(number).pack())
        go.touch()
        until(lambda: feed.keeps, feed, 51)
        feed.send(tick(20_000).pack())
    last = capfd.readouterr().err.splitlines()[-1]
    assert int(last.split(" unlogged=")[1]) >= 50


GONE = """
import os, sys
ours, theirs = os.pipe()
os.close(ours)
os.dup2(theirs, 2)
from antennate.cli.viewer import main
sys.argv[1:] = [sys.argv[1]]
sys.exit(main())
"""


@pytest.mark.ci
def test_G6_a_display_that_is_gone_costs_no_tick_of_the_log(tmp_path: Path) -> None:
    log = tmp_path / "drive.mcap"
    words = [sys.executable, "-c", GONE, str(log)]
    with Feed(lambda number: words, HEADER.pack()) as feed:
        for number in range(1, 301):
            assert feed.send(tick(number).pack())
    assert feed.complete
    with LogReader(log) as kept:
        assert (len(list(kept)), kept.end) == (300, 300)


@pytest.mark.ci
def test_a_killed_loop_is_told_from_one_that_ended(tmp_path: Path) -> None:
    log = tmp_path / "drive.mcap"
    loop = (
        "import os, signal, sys, time\nfrom antennate.telemetry.feed import Feed\n"
        f"feed = Feed(lambda n: {viewer(log)(1)!r}, {HEADER.pack()!r})\nfeed.__enter__()\n"
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


@pytest.mark.ci
def test_a_log_that_cannot_be_written_is_said_once_and_the_status_line_goes_on(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    taken = tmp_path / "drive.mcap"
    taken.write_text("another drive")
    with Feed(viewer(taken), HEADER.pack()) as feed:
        feed.send(tick(1).pack())
    assert feed.failed
    said = capfd.readouterr().err
    assert said.count("does not exist yet") == 1
    assert "; the robot walks on without a log\n" in said
    assert " unlogged=1\n" in said
    assert feed.failure.startswith(f"expected a log that does not exist yet, found {taken};")
    assert "OK maneuver=FORWARD" in said
    assert taken.read_text() == "another drive"


@pytest.mark.ci
def test_a_signal_does_not_end_the_viewer_before_the_loop(tmp_path: Path) -> None:
    log = tmp_path / "drive.mcap"
    with Feed(viewer(log), HEADER.pack()) as feed:
        feed.send(tick(1).pack())
        end = time.monotonic() + 20.0
        while not _holds_a_tick(log) and time.monotonic() < end:
            time.sleep(0.01)
        assert feed.pid is not None
        for number in STOPS:
            os.kill(feed.pid, number)
        feed.send(tick(2).pack())
    assert feed.complete
    with LogReader(log) as kept:
        assert len(list(kept)) == 2


def _holds_a_tick(log: Path) -> bool:
    try:
        with LogReader(log) as kept:
            return any(True for _ in kept)
    except LogError:
        return False


@pytest.mark.ci
def test_the_loop_can_wait_until_somebody_looks(tmp_path: Path) -> None:
    go = tmp_path / "go"
    late = (
        "import os, sys, time\n"
        f"while not os.path.exists({str(go)!r}): time.sleep(0.01)\n"
        f"os.write(1, {KEPT!r}); sys.stdin.buffer.read()"
    )
    with Feed(script(late), HEADER.pack()) as feed:
        time.sleep(0.2)
        assert not feed.watched
        go.touch()
        until(lambda: feed.watched, feed)
        assert feed.keeps


@pytest.mark.ci
def test_nobody_is_waited_for_who_is_gone_for_good() -> None:
    with Feed(script("pass"), b"first") as feed:
        until(lambda: feed.watched, feed)
        assert feed.failed


@pytest.mark.ci
def test_the_other_process_is_not_reached_by_the_terminal() -> None:
    """Ctrl-C goes to the process group of the terminal; the recorder is in one of its own."""
    with Feed(script("import sys; sys.stdin.buffer.read()"), HEADER.pack()) as feed:
        assert feed.pid is not None
        assert os.getpgid(feed.pid) not in (os.getpgrp(), os.getpgid(os.getppid()))
