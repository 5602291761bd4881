"""The file of trials of a run: a line a trial, which a row stands in once, and what a cut costs."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from antennate.cli import main
from antennate.errors import BadInputError, OutputError
from antennate.studies.pool import Workers, gather
from antennate.studies.run_directory import RunDirectory
from antennate.studies.trial_file import line

WALL = ["bench", "wall", "--trials", "2", "--profiles", "stiff", "--wall.travel", "0.03"]
SWEEP = ["bench", "sweep", "--profiles", "stiff", "descending", "--distances", "0.4"]
RUNS = {
    "wall": [*WALL, "--wall.start", "0.002", "--wall.speed", "0.2"],
    "sweep": [*SWEEP, "--centres", "0.8", "--amplitudes", "0.4", "--estimate.trials", "6"],
    "tunnel": ["tunnel", "--trials", "2", "--time-limit", "0.2", "--controllers", "open", "closed"],
}
WORKER = ["--workers", "1", "--no-figures", "--out"]


@pytest.fixture(scope="module")
def _runs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One finished run of each command."""
    place = tmp_path_factory.mktemp("runs")
    for name, words in RUNS.items():
        assert main([*words, *WORKER, str(place / name)]) == 0
    return place


@pytest.fixture(autouse=True)
def _there(_runs: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shutil.copytree(_runs, tmp_path / "runs")
    monkeypatch.chdir(tmp_path / "runs")


def lines(run: str) -> list[dict[str, Any]]:
    return [json.loads(line) for line in Path(run, "trials.jsonl").read_bytes().splitlines()]


def cells(rows: list[dict[str, Any]]) -> list[str]:
    """Rows in any order; a table does not tell an empty text from none."""
    return sorted(str([None if cell == "" else cell for cell in row.values()]) for row in rows)


def stopped(run: str) -> RunDirectory:
    """A run as it is when it is killed before it writes its table."""
    for name in ("trials.csv", "result.json"):
        Path(run, name).unlink()
    return RunDirectory.open(run)


@pytest.mark.parametrize(("name", "once"), [("wall", 2), ("tunnel", 4), ("sweep", 4)])
def test_rows_of_a_run_that_was_killed_are_those_of_its_table(name: str, once: int) -> None:
    """A row that is the first of what a trial returned stands there, and nowhere else."""
    table = RunDirectory.open(name).rows()
    assert [line["rows"] for line in lines(name) if "key" in line].count("first") == once
    assert not any(line.get("key", "").startswith("row") for line in lines(name))
    assert cells(stopped(name).rows()) == cells(table)


@pytest.mark.parametrize("name", RUNS)
def test_a_line_that_is_torn_or_damaged_costs_its_trial_alone(name: str) -> None:
    """The one behind a torn line is read, and what is written in the end is the same."""
    whole = {file: Path(name, file).read_bytes() for file in ("trials.csv", "result.json")}
    total = len(RunDirectory.open(name).rows())
    file = Path(name, "trials.jsonl")
    *before, torn, last = file.read_bytes().splitlines(keepends=True)
    damaged = torn.replace(b'"result"', b'"resulT"', 1)
    for cut in (torn[:-30] + b"\n", damaged):
        run = f"{name}-{len(cut)}"
        shutil.copytree(name, run)
        Path(run, "trials.jsonl").write_bytes(b"".join([*before, cut, last]))
        assert len(stopped(run).rows()) == total - 1
        assert main([*RUNS[name], *WORKER, run, "--resume"]) == 0
        assert {each: Path(run, each).read_bytes() for each in whole} == whole


@pytest.mark.parametrize("name", RUNS)
def test_a_run_that_goes_on_counts_no_row_twice(name: str) -> None:
    """Nor does one that was killed with all of its trials."""
    rows = RunDirectory.open(name).rows()
    kept = len(Path(name, "trials.jsonl").read_bytes())
    stopped(name)
    assert main([*RUNS[name], *WORKER, name, "--resume"]) == 0
    assert RunDirectory.open(name).rows() == rows
    assert len(Path(name, "trials.jsonl").read_bytes()) == kept
    assert len(stopped(name).rows()) == len(rows)


def test_rows_of_no_trial_are_lines_of_their_own_and_come_once() -> None:
    """Of an experiment without workers that is killed after two rows, and goes on."""
    what = {"command": "dice", "versions": {}, "code": {}, "config": {}}
    rows = [{"trial": trial, "eyes": trial + 0.5} for trial in range(4)]

    def run(count: int) -> None:
        with RunDirectory.create("dice", "dice", identity=what, resume=True) as run:
            for row in rows[:count]:
                run.append(row)
            raise KeyboardInterrupt

    for count in (2, 2, 1, 4):
        with pytest.raises(KeyboardInterrupt):
            run(count)
        expected = rows[: max(2, count)]
        assert RunDirectory.open("dice").rows() == expected
        assert [line["rows"] for line in lines("dice") if "key" in line] == [[r] for r in expected]
    with Path("dice/trials.jsonl").open("ab") as file:
        file.write(b'{"crc":"00000000","key":"row.4","rows":[{"trial":4,"eyes":1.0}]}\n{"crc":')
    assert RunDirectory.open("dice").rows() == rows


@dataclass(frozen=True)
class Throw:
    """A row that is all that a trial returns."""

    trial: int
    eyes: float


def throw(trial: int) -> Throw:
    return Throw(trial, float("nan") if trial == 1 else trial / 3)


def test_a_row_that_a_trial_returns_stands_once_also_where_a_page_had_shown_it() -> None:
    what = {"command": "dice", "versions": {}, "code": {}, "config": {}}
    tasks = [(trial,) for trial in range(3)]

    def stop(run: Callable[[RunDirectory], Any]) -> None:
        with RunDirectory.create("dice", "dice", identity=what, resume=True) as directory:
            run(directory)
            raise KeyboardInterrupt

    def on_workers(run: RunDirectory) -> None:
        found = gather(throw, tasks, Workers(1, trials=run.trials), lambda *_: None, run.append)
        assert [row.eyes for row in found[::2]] == [0.0, 2 / 3]

    for shown_or_run in (lambda run: run.append(throw(0)), on_workers, on_workers):
        with pytest.raises(KeyboardInterrupt):
            stop(shown_or_run)
    kept = [line["rows"] for line in lines("dice") if "key" in line]
    assert kept == [[{"trial": 0, "eyes": 0.0}], "result", "result", "result"]
    assert [row["eyes"] for row in RunDirectory.open("dice").rows()] == [0.0, None, 2 / 3]


@pytest.mark.parametrize("old", ["trials.store.jsonl", "trials.partial.jsonl"])
def test_a_run_of_a_version_before_is_read_or_refused_in_one_line(
    old: str, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("wall/trials.jsonl").rename(Path("wall", old))
    list_ = Path("wall/files.txt")
    list_.write_text(list_.read_text().replace("trials.jsonl", old))
    assert len(RunDirectory.open("wall").rows()) == 2
    assert main(["report", "wall"]) == 0
    capsys.readouterr()
    before = {path: path.read_bytes() for path in Path("wall").rglob("*") if path.is_file()}
    for _ in range(2):
        assert main([*RUNS["wall"], *WORKER, "wall", "--resume"]) == 2
        (line,) = capsys.readouterr().err.splitlines()
        assert f"expected an unfinished run of this version, found wall/{old}; choose" in line
        assert {path: path.read_bytes() for path in before} == before
        Path("wall/result.json").unlink(missing_ok=True)
        Path("wall/trials.csv").unlink(missing_ok=True)
        before = {path: path.read_bytes() for path in Path("wall").rglob("*") if path.is_file()}
    with pytest.raises(BadInputError, match=f"found {old} of a version before"):
        RunDirectory.open("wall").rows()
    assert main(["report", "wall"]) == 2
    assert main([*RUNS["wall"], *WORKER, "wall", "--overwrite"]) == 0
    assert Path("wall.old", old).exists()


def test_a_row_that_is_none_is_refused_and_one_after_the_end() -> None:
    with RunDirectory.create("dice", "dice") as run:
        with pytest.raises(BadInputError, match="expected a dictionary or a dataclass"):
            run.append(3)
        run.append({"trial": 0})
        run.finish({"schema": 1}, [{"trial": 0}])
        with pytest.raises(OutputError, match="found a finished one"):
            run.append({"trial": 1})
    assert not Path("dice/trials.jsonl").exists()


def test_rows_as_the_version_before_kept_them_are_read(tmp_path: Path) -> None:
    lines = [line({"row": i, "values": {"a": i}}) for i in (1, 2)]
    (tmp_path / "trials.jsonl").write_bytes(b"".join(lines))
    assert RunDirectory.open(tmp_path).rows() == [{"a": 1}, {"a": 2}]
