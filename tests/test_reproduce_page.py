"""docs/reproduce.py: the verdicts of a run stand on the page and on the home page."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from antennate.experiments.reproduce.experiment import CLAIMS

DOCS = Path(__file__).parents[1] / "docs"


def run(folder: Path, *options: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-W", "error", str(folder / "reproduce.py"), *options]
    return subprocess.run(command, capture_output=True, text=True, check=False)


@pytest.fixture
def pages(tmp_path: Path) -> Path:
    """The script beside a home page, with a whole run: one claim is met, all others are not."""
    for name in ("reproduce.py", "generated.py", "index.md"):
        shutil.copy(DOCS / name, tmp_path / name)
    rows = [
        {
            "claim": claim.claim,
            "criterion": claim.criterion,
            "paper": claim.paper,
            "ours": "1 | 2",
            "verdict": "not_reproduced" if i else "conditional",
            "reason": "Because.",
            "command": f"antennate {claim.experiment}",
        }
        for i, claim in enumerate(CLAIMS)
    ]
    result = {"quick": False, "interrupted": False, "seed": 7, "claims": rows}
    (tmp_path / "science").mkdir()
    (tmp_path / "science" / "reproduce.json").write_text(json.dumps(result))
    return tmp_path


def test_both_pages_tell_what_the_run_found(pages: Path) -> None:
    assert "out of date" in run(pages, "--check").stderr
    done = run(pages)
    assert done.returncode == 0, done.stderr
    counts = f"1 conditional, {len(CLAIMS) - 1} not reproduced"
    page, index = ((pages / name).read_text() for name in ("reproduce.md", "index.md"))
    assert counts in page
    assert counts in index
    table = [line for line in page.splitlines() if line.endswith("reproduced** |")]
    assert len(table) == len(CLAIMS) - 1
    assert {line.count(" | ") for line in table} == {4}  # a bar in a cell ends no cell
    assert all(claim.criterion in page for claim in CLAIMS)
    assert run(pages, "--check").returncode == 0


@pytest.mark.parametrize("change", [{"quick": True}, {"interrupted": True}, {"claims": []}])
def test_only_a_whole_run_is_written(pages: Path, change: dict[str, object]) -> None:
    result = pages / "science" / "reproduce.json"
    result.write_text(json.dumps(json.loads(result.read_text()) | change))
    done = run(pages)
    assert done.returncode == 1
    assert "expected a whole run" in done.stderr
    assert not (pages / "reproduce.md").exists()
