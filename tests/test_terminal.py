"""What a person sees on a terminal, wide or narrow."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest
from stated import STATED
from terminal import Terminal


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
