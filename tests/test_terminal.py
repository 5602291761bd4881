"""What a person sees on a terminal, wide or narrow."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest
from stated import STATED
from terminal import Terminal
from test_setup_zeros import ZEROS


@pytest.mark.ci
@pytest.mark.parametrize("columns", [80, 40])
def test_the_viewer_shows_what_to_do_whatever_the_width(columns: int, tmp_path: Path) -> None:
    terminal = Terminal(columns)
    asked = ["let go of both antennae", "bend the left antenna towards the tail"]
    notes = [f"touch=({text}) drift=+0,+0%" for text in asked] + ["touch=passed drift=+0,+0%"]
    source = (
        "import sys; from dataclasses import replace; sys.path.insert(0, sys.argv[1]); "
        "from test_feed import HEADER, tick, viewer; from antennate.telemetry.feed import Feed\n"
        "with Feed(viewer(__import__('pathlib').Path('drive.mcap')), HEADER.pack()) as feed:\n"
        "    for number in range(300):\n"
        "        note = sys.argv[2 + number // 100]\n"
        "        feed.send(replace(tick(number + 1), note=note, state='DISARMED',"
        " causes=('DISARMED ' + 'why ' * 40,)).pack())\n"
    )
    words = [sys.executable, "-c", source, str(Path(__file__).parent), *notes]
    process = terminal.start(words, cwd=tmp_path)
    terminal.until(lambda _: False)
    assert process.wait(30) == 0
    for text in asked:
        assert terminal.rows.count(f"{text.capitalize()}.") == 1
    status = [row for row in terminal.rows if " s DISARMED" in row]
    shown = [row for row in terminal.rows if row.endswith(asked[1])]
    assert len(shown) >= 2, "the instruction is lost"
    assert len(status) >= (10 if columns == 80 else 5)
    assert max(map(len, terminal.rows)) < columns  # nothing wraps
    assert terminal.text.endswith("\n")


FEED = (
    "import sys; from dataclasses import replace; sys.path.insert(0, sys.argv[1]); "
    "from test_feed import HEADER, tick, viewer; from antennate.telemetry.feed import Feed\n"
    "note = 'touch=passed drift=+0,+0%'\n"
    "with Feed(viewer(__import__('pathlib').Path('drive.mcap')), HEADER.pack()) as feed:\n"
    "    for number in range(100):\n"
    "        feed.send(replace(tick(number + 1), note=note, state='WALKING').pack())\n"
)
ZERO = (
    "import sys; sys.path.insert(0, sys.argv[1])\n"
    "from test_setup_zeros import Held\n"
    "from antennate.cli.keys import TerminalPerson\n"
    "held = Held(); person = TerminalPerson()\n"
    "held.zeroing.zeros(person); person.close()\n"
)
COUNTERS = ("maneuver", "counts", "age", "touch", "drift", "missed_ticks", "missed_answers")
COUNTERS += ("stale", "frames", "crc", "lost", "sent", "refused", "unlogged")


@pytest.mark.ci
@pytest.mark.parametrize("columns", [60, 80, 120])
def test_the_status_line_of_a_drive_has_all_its_labels(columns: int, tmp_path: Path) -> None:
    terminal = Terminal(columns)
    words = [sys.executable, "-c", FEED, str(Path(__file__).parent)]
    process = terminal.start(words, cwd=tmp_path)
    terminal.until(lambda _: False)
    assert process.wait(30) == 0
    assert max(map(len, terminal.rows)) < columns
    shown = " ".join(terminal.rows).split(" s WALKING")[1].split()
    assert [word.partition("=")[0] for word in shown if "=" in word][: len(COUNTERS)] == [*COUNTERS]


@pytest.mark.ci
@pytest.mark.parametrize("columns", [60, 80, 120])
def test_zero_shows_every_joint_that_is_watched(columns: int) -> None:
    terminal = Terminal(columns)
    words = [sys.executable, "-c", ZERO, str(Path(__file__).parent)]
    process = terminal.start(words, stdin=subprocess.PIPE)
    terminal.until(lambda text: text.count("yaw ") > 2)
    assert process.stdin is not None
    with process.stdin:
        process.stdin.write(b"\n")
    terminal.until(lambda _: False)  # what was shown may come in pieces
    assert process.wait(30) == 0
    assert max(map(len, terminal.rows)) < columns
    shown = " ".join(terminal.text.split("\x1b[J")[-1].partition("\x1b[")[0].split())
    numbers = [" ".join(map(str, part)) for part in (ZEROS[:5], ZEROS[5:17], ZEROS[17:])]
    assert shown == "yaw {} legs {} antennae {}".format(*numbers)


@pytest.mark.smoke
@pytest.mark.parametrize("columns", [80, 200])
def test_what_another_process_says_stays_when_the_status_line_changes(columns: int) -> None:
    source = (
        "from antennate.cli.terminal import StatusLine, write_below_status\n"
        "line = StatusLine()\n"
        "for number in range(3):\n"
        "    line.show(' '.join(f'{n}={number}' for n in range(40)), 'bend the antenna')\n"
        "    if number == 1: write_below_status('the disk is full')\n"
        "line.close()\n"
        "print('table', file=__import__('sys').stderr)\n"
    )
    terminal = Terminal(columns)
    process = terminal.start([sys.executable, "-c", source])
    terminal.until(lambda _: False)
    assert process.wait(30) == 0
    screen = shown_on_screen(terminal.text)
    assert screen[0].startswith("0=1 ")
    assert screen[1] == "the disk is full"
    assert " ".join(screen[2:-2]) == " ".join(f"{n}=2" for n in range(40))
    assert screen[-2:] == ["bend the antenna", "table"]


def shown_on_screen(text: str) -> list[str]:
    """Rows of a screen that is high enough, for the few sequences that we send."""
    rows, at, column = [""], 0, 0
    for piece in re.findall(r"\x1b\[\d*[AJ]|[\r\n]|[^\x1b\r\n]+", text):
        if piece == "\r":
            column = 0
        elif piece == "\n":
            at += 1
            rows += [""] * (at + 1 - len(rows))
        elif piece.endswith("A") and piece[0] == "\x1b":
            at -= int(piece[2:-1])
        elif piece == "\x1b[J":
            rows[at:] = [rows[at][:column]]
        else:
            rows[at] = rows[at][:column].ljust(column) + piece + rows[at][column + len(piece) :]
            column += len(piece)
    return [row for row in rows if row]


@pytest.mark.slow
@pytest.mark.parametrize("columns", [80, 40])
def test_drive_asks_for_the_antennae_and_walks_once_they_were_touched(
    columns: int, tmp_path: Path
) -> None:
    run = [sys.executable, "-m", "antennate"]
    words = [*run, "twin", "--touch", "left@4s", "right@7s", "--duration", "60"]
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) as twin:
        try:
            assert twin.stdout is not None
            paths = json.loads(twin.stdout.readline())
            ports = ["--esp32", paths["esp32"], "--bus", paths["bus"]]
            more = ["--arm", "--dry-run", "1", "--duration", "1", "--out", str(tmp_path / "run")]
            more += STATED
            terminal = Terminal(columns)
            drive = terminal.start([*run, "drive", *ports, *more])
            terminal.until(lambda _: False)
            assert drive.wait(30) == 0
        finally:
            twin.kill()
    for side in ("left", "right"):
        assert f"Bend the {side} antenna towards the tail." in " ".join(terminal.rows)
