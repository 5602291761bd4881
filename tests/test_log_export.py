"""What is made of logs whose content or place nobody would choose."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path

import pytest
from log_ticks import HEADER, tick

from antennate.cli import main
from antennate.robots.spec import RobotSpec
from antennate.telemetry.writer import LogWriter


def test_export_leaves_the_columns_in_their_place_where_a_joint_is_missing(tmp_path: Path) -> None:
    """Whoever wrote the second and the third tick had other joints."""
    path, joints = tmp_path / "log.mcap", RobotSpec().joint_names
    with LogWriter(path, HEADER) as out:
        for number, count in enumerate((len(joints), 2, 40), start=1):
            angles = tuple(0.1 * n for n in range(count))
            out.write(replace(tick(number), angles=angles, positions=angles, velocities=(1.0,)))
    assert main(["log", "export", str(path)]) == 0
    with path.with_suffix(".csv").open(newline="") as file:
        first, second, third = csv.DictReader(file)
    assert len(first) == len(second) == len(third)
    assert [second[name] for name in joints[:3]] == ["0.0", "0.1", "nan"]
    assert (second["yaw3_position"], second["yaw1_velocity"]) == ("nan", "1.0")
    assert (third["yaw1_position"], third["yaw1_velocity"]) == ("0.0", "1.0")


@pytest.mark.parametrize("name", ["log-2.mcap", "log-3.mcap", "link.mcap", "hard.mcap"])
def test_recover_never_writes_over_a_part_of_the_log_nor_makes_one(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    for path, number in (("log.mcap", 1), ("log-2.mcap", 2)):
        with LogWriter(Path(path), HEADER) as out:
            out.write(tick(number))
    Path("link.mcap").symlink_to("log-4.mcap")
    Path("hard.mcap").hardlink_to("log-2.mcap")
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir() if path.exists()}
    assert main(["log", "recover", "log.mcap", "--out", name, "--overwrite"]) == 2
    err = capsys.readouterr().err
    assert f"found {name}" in err
    assert err.count("\n") == 1
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir() if path.exists()} == before
    assert main(["log", "recover", "log.mcap", "--out", "whole.mcap"]) == 0
    assert "2 ticks were written" in capsys.readouterr().out


@pytest.mark.parametrize(
    "words",
    [
        ["log", "replay", "run"],
        ["log", "replay", "run/logs/a.mcap"],
        ["servo", "--recording", "run/drive.mcap"],
        ["calibrate", "--recording", "elsewhere/../run/recording.csv"],
    ],
)
def test_no_run_replaces_the_one_that_it_reads(
    words: list[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("elsewhere").mkdir()
    Path("run/logs").mkdir(parents=True)
    log = Path("run/logs/a.mcap" if "run/logs/a.mcap" in words else "run/drive.mcap")
    with LogWriter(log, HEADER) as out:
        out.write(tick(1))
    files = [log, Path("run/result.json"), Path("run/config.toml"), Path("run/recording.csv")]
    for file in files[1:]:
        file.write_text("what was measured")
    names = [str(file.relative_to("run")) for file in files]
    title = "# Files that this run wrote."
    Path("run/files.txt").write_text("\n".join([title, *names, ""]))
    before = [file.read_bytes() for file in files]
    assert main([*words, "--out", "run", "--overwrite"]) == 2
    assert capsys.readouterr().err.count("\n") == 1
    assert [file.read_bytes() for file in files] == before
