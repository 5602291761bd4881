"""Tables of learned policies, and of a search with one budget, are what scripts make of rows."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[1] / "docs"


def numbers(line: str) -> list[str]:
    """The cells of a line of a table that begin with a number, without what is said of them."""
    cells = (cell.strip() for cell in line.strip().strip("|").split("|"))
    found = [cell.partition(",")[0] for cell in cells if re.match(r"[-+]?[0-9]", cell)]
    return [cell if re.search("[ /]", cell) else f"{float(cell):g}" for cell in found]


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
