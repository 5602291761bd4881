"""docs/leaderboard.py: the rows of a board stand on its page, and a page that is old is noticed."""

from __future__ import annotations

import shutil
import subprocess
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pytest

from antennate.studies.formats import to_csv
from antennate_lab.compete.config import DEVELOPMENT, SCENES_OF_BOARD
from antennate_lab.compete.episodes import EpisodeRow

DOCS = Path(__file__).parents[3] / "docs"


def run(folder: Path, *options: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-W", "error", str(folder / "leaderboard.py"), *options]
    return subprocess.run(command, capture_output=True, text=True, check=False)


@pytest.fixture
def page(tmp_path: Path) -> Path:
    """The page and its script beside two rows: one controller crosses, the other does not."""
    for name in ("leaderboard.py", "leaderboard.md", "generated.py"):
        shutil.copy(DOCS / name, tmp_path / name)
    (tmp_path / "images").mkdir()
    ended: Any = {"closed": ("success", 20.0), "open": ("timeout", 100.0)}
    rows = [
        EpisodeRow(
            controller=name,
            scene=SCENES_OF_BOARD[0],
            seed=5,
            trial=0,
            outcome=outcome,
            time_s=time,
            progress_m=2.0,
            drawn=True,
        )
        for name, (outcome, time) in ended.items()
    ]
    (tmp_path / "leaderboard.csv").write_text(to_csv(asdict(row) for row in rows))
    return tmp_path / "leaderboard.md"


@pytest.mark.ci
def test_the_board_is_written_between_its_marks_and_the_rest_stays(page: Path) -> None:
    before = page.read_text()
    done = run(page.parent, "--check")
    assert done.returncode == 1
    assert "out of date" in done.stderr
    assert run(page.parent).returncode == 0
    text = page.read_text()
    assert text.split("<!-- board")[0] == before.split("<!-- board")[0]
    assert text.split("end of board")[1] == before.split("end of board")[1]
    assert "| `closed` | 1 (1 to 2) | 1 of 1 |" in text
    assert "**Preliminary**: 1 draw of" in text
    assert "hidden seed 5" in text
    assert run(page.parent, "--check").returncode == 0
    assert len(list((page.parent / "images").glob("leaderboard-*.png"))) == 3


@pytest.mark.ci
@pytest.mark.parametrize(
    ("entry", "why"),
    [
        ("policy.onnx", "expected a file under entries/NAME/, found policy.onnx"),
        ("entries/nobody/policy.onnx", "expected a file, found no entries/nobody/policy.onnx"),
        ("--help", "# Usage: .ci/judge CONTROLLER"),
    ],
)
def test_a_judge_without_an_entry_says_what_is_missing(entry: str, why: str) -> None:
    words = ["bash", str(DOCS.parent / ".ci/judge"), entry]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert why in done.stdout + done.stderr


@pytest.mark.ci
def test_a_page_without_its_marks_is_left_as_it_is(page: Path) -> None:
    page.write_text(page.read_text().replace("<!-- end of board -->", ""))
    before = page.read_text()
    done = run(page.parent, str(page.with_suffix(".csv")))
    assert done.returncode == 1
    assert "expected the lines <!-- board" in done.stderr
    assert page.read_text() == before


@pytest.mark.ci
def test_tables_of_several_runs_are_joined(page: Path, tmp_path: Path) -> None:
    file = page.with_suffix(".csv")
    (tmp_path / "a.csv").write_text(file.read_text())
    (tmp_path / "b.csv").write_text(file.read_text().replace(",5,0,", ",9,0,"))
    done = run(page.parent, str(tmp_path / "b.csv"), str(tmp_path / "a.csv"))
    assert done.returncode == 0, done.stderr
    assert "hidden seeds 5, 9" in page.read_text()
    assert "| `closed` | 1 (1 to 2) | 2 of 2 |" in page.read_text()
    assert file.read_text().count("closed") == 2


@pytest.mark.ci
@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("0.1.0", "0.0.9"), "expected tables of one version, found 0.0.9, 0.1.0"),
        (("", ""), "expected each draw once a controller, found one in two tables"),
    ],
)
def test_tables_that_do_not_stand_together_leave_the_board_as_it_is(
    change: tuple[str, str], said: str, page: Path, tmp_path: Path
) -> None:
    file = page.with_suffix(".csv")
    whole, old = file.read_bytes(), page.read_bytes()
    text = whole.decode().replace(",0.1.0,", f",{change[1]},") if change[0] else whole.decode()
    (tmp_path / "b.csv").write_text(text.replace(",5,0,", ",9,0,") if change[0] else text)
    done = run(page.parent, str(file), str(tmp_path / "b.csv"))
    assert (done.returncode, done.stderr) == (1, said + "\n")
    assert (file.read_bytes(), page.read_bytes()) == (whole, old)
    done = run(page.parent, "--check", str(file))
    assert done.returncode == 1
    assert "found both" in done.stderr


@pytest.mark.ci
def test_a_seed_that_was_not_drawn_is_not_told_as_hidden(page: Path) -> None:
    file = page.with_suffix(".csv")
    file.write_text(file.read_text().replace("True", "False", 1))
    assert run(page.parent).returncode == 0
    assert "chosen seed 5" in page.read_text()
    assert "hidden seed" not in page.read_text().split("<!-- end of board")[0]


def test_the_page_tells_the_public_seeds_as_the_program_has_them() -> None:
    assert (
        f"{DEVELOPMENT[0]} to {DEVELOPMENT[-1]} are public" in (DOCS / "leaderboard.md").read_text()
    )
