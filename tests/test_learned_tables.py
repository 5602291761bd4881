"""The tables of learned policies in docs/envs.md are those that docs/science/learned.py makes."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

DOCS = Path(__file__).parents[1] / "docs"


def numbers(line: str) -> list[str]:
    """The cells of a line of a table that begin with a number, without what is said of them."""
    cells = (cell.strip() for cell in line.strip().strip("|").split("|"))
    found = [cell.partition(",")[0] for cell in cells if re.match(r"[-+]?[0-9]", cell)]
    return [cell if " " in cell else f"{float(cell):g}" for cell in found]


def test_each_row_stands_on_the_page() -> None:
    """Where a scene has several rivals, the numbers of the policy stand in its first line alone."""
    command = [sys.executable, "-W", "error", str(DOCS / "science/learned.py")]
    made = subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines()
    page = (DOCS / "envs.md").read_text(encoding="utf-8").splitlines()
    there = [numbers(line) for line in page if line.strip().startswith("|")]
    rows = [numbers(line) for line in made if line]
    assert len(rows) == 22
    for row in rows:
        assert row in there or row[2:] in there, row
