"""Names that a run writes at its end alone: one that is somebody else's is refused before the run.
A run that is finished says so, whatever its command, and its list holds what is there."""

from __future__ import annotations

from pathlib import Path

import pytest

import antennate
from antennate.cli import main
from antennate.errors import OutputError

SHORT = ["--trials", "1", "--time-limit", "0.1", "--controllers", "open"]
RUNS = {
    "tunnel": ["tunnel", *SHORT],
    "gait": ["gait", "--sweep-points", "4", "--cycles", "2"],
    "calibrate": ["calibrate"],
    "force": ["bench", "force", "--profiles", "descending", "--speeds", "0.15"],
    "wall": ["bench", "wall", "--trials", "1", "--profiles", "stiff"],
}
MINE = "mine, and no run's\n"


@pytest.fixture(autouse=True)
def _here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


@pytest.mark.parametrize(
    ("words", "name"),
    [
        (["tunnel", *SHORT], "figures/trajectories.png"),
        (["tunnel", *SHORT, "--video"], "films/open.mp4"),
        pytest.param(
            ["compete", "--trials", "1", "--controllers", "open"], "README.md", marks=pytest.mark.ci
        ),
        (["dataset"], "gap.parquet"),
        (["dataset"], "README.md"),
        (["reproduce", "--quick"], "figures/sigmoid.svg"),
        (["robot"], "figures/wiring.svg"),
    ],
)
def test_a_name_that_is_taken_is_refused_before_the_run(
    words: list[str], name: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    if words[0] == "dataset":
        pytest.importorskip("pyarrow", reason="data sets need pyarrow")
    if "--video" in words:
        monkeypatch.setattr("antennate.telemetry.film.require_video", lambda: None)
    file = Path("run", name)
    file.parent.mkdir(parents=True)
    file.write_text(MINE)
    assert main([*words, "--out", "run"]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.count("\n") == 1, err
    assert f"expected no file {name} but of this run" in err
    assert [path for path in Path("run").rglob("*") if path.is_file()] == [file]
    assert file.read_text() == MINE


def test_so_it_is_from_python() -> None:
    Path("run/figures").mkdir(parents=True)
    Path("run/figures/summary.svg").write_text(MINE)
    with pytest.raises(OutputError, match=r"expected no file figures/summary\.svg"):
        antennate.run("tunnel", trials=1, time_limit=0.1, controllers=("open",), out="run")
    assert not Path("run/result.json").exists()


def test_without_figures_no_figure_is_in_the_way() -> None:
    Path("run/figures").mkdir(parents=True)
    Path("run/figures/summary.svg").write_text(MINE)
    assert main(["tunnel", *SHORT, "--no-figures", "--out", "run"]) == 0
    assert Path("run/figures/summary.svg").read_text() == MINE


@pytest.mark.parametrize(
    "name", ["tunnel", "calibrate", *(pytest.param(n, marks=pytest.mark.slow) for n in RUNS)]
)
def test_a_finished_run_says_so_and_lists_what_is_there(
    name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    words = [*RUNS[name], "--no-figures", "--workers", "1", "--out", "run"]
    assert main(words) == 0
    there = {p: p.read_bytes() for p in Path("run").rglob("*") if p.is_file()}
    names = Path("run/files.txt").read_text().splitlines()[1:]
    assert sorted([*names, "files.txt"]) == sorted(str(p.relative_to("run")) for p in there)
    capsys.readouterr()
    assert main([*words, "--resume"]) == 0
    assert capsys.readouterr().err.endswith("complete already; nothing was run: run\n")
    assert {p: p.read_bytes() for p in Path("run").rglob("*") if p.is_file()} == there
