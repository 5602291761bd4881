"""Tables of learned policies, and of a search with one budget, are what scripts make of rows."""

from __future__ import annotations

import csv
import json
import re
import subprocess
import sys
from pathlib import Path

import pytest
from scipy.stats import binomtest

DOCS = Path(__file__).parents[1] / "docs"


def numbers(line: str) -> list[str]:
    """The cells of a line of a table that begin with a number, without what is said of them."""
    cells = (cell.strip() for cell in line.strip().strip("|").split("|"))
    found = [cell.partition(",")[0] for cell in cells if re.match(r"[-+]?[0-9]", cell)]
    return [cell if re.search("[ /]", cell) else f"{float(cell):g}" for cell in found]


@pytest.mark.ci
@pytest.mark.parametrize(
    ("script", "page", "count"), [("learned.py", "envs.md", 22), ("tuning.py", "leaderboard.md", 6)]
)
def test_each_row_stands_on_the_page(script: str, page: str, count: int) -> None:
    """Where a scene has several rivals, the numbers of the policy stand in its first line alone."""
    command = [sys.executable, "-W", "error", str(DOCS / "science" / script)]
    made = subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines()
    lines = (DOCS / page).read_text(encoding="utf-8").splitlines()
    there = [numbers(line) for line in lines if line.strip().startswith("|")]
    rows = [numbers(line) for line in made if line]
    assert len(rows) == count
    for row in rows:
        assert row in there or row[2:] in there, row


def test_the_clock_and_closed_on_three_sets_of_draws() -> None:
    """Pooled by hand: pairs of rows of two files, and the counts that the third set left."""
    hard = json.loads((DOCS / "science/hard.json").read_text())
    files = ("leaderboard.csv", "science/learned_elsewhere.csv")
    rows = [row for name in files for row in csv.DictReader((DOCS / name).read_text().splitlines())]
    page = (DOCS / "science/corridors.md").read_text(encoding="utf-8")
    for scene in ("corner", "deadend"):
        won: dict[str, dict[tuple[str, str], bool]] = {"timed": {}, "closed": {}}
        for row in rows:
            if row["scene"] == scene and row["controller"] in won:
                draw = row["seed"], row["trial"]
                won[row["controller"]][draw] = row["outcome"] == "success"
        pairs = [(won["timed"][draw], won["closed"][draw]) for draw in won["closed"]]
        assert len(pairs) == 200
        cell = hard[scene]
        assert cell["best"] == "timed 5 s"
        timed, closed = cell["controllers"]["timed 5 s"], cell["controllers"]["closed"]
        alone = pairs.count((True, False)) + cell["pair"]["only_rival"]
        ours = pairs.count((False, True)) + cell["pair"]["only_ours"]
        cells = [scene]
        for at, count in enumerate((timed["successes"], closed["successes"])):
            both = count + sum(pair[at] for pair in pairs)
            low, high = binomtest(both, 300).proportion_ci(method="wilson")
            cells.append(f"{both} of 300 ({low:.2f}–{high:.2f})")
        p = binomtest(ours, ours + alone).pvalue
        row = " | ".join([f"| `{cells[0]}`", *cells[1:], str(alone), str(ours)])
        assert f"{row} | {float(f'{p:.2g}'):.1e}".replace("e-0", "e-") in page
