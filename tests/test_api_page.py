"""Python of docs/api.md and README: its snippets run as they stand, one after the other."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


def snippets(page: Path) -> list[str]:
    return re.findall(r"^```python\n(.*?)^```$", page.read_text(), re.MULTILINE | re.DOTALL)


@pytest.mark.ci
@pytest.mark.parametrize(
    ("page", "count"),
    [("docs/api.md", 5), pytest.param("README.md", 1, marks=pytest.mark.slow)],
)
def test_the_snippets_run(page: str, count: int, tmp_path: Path) -> None:
    found = snippets(ROOT / page)
    assert len(found) >= count
    script = tmp_path / "page.py"
    script.write_text("\n".join(found))
    run = subprocess.run(
        [sys.executable, "-W", "error", str(script)], cwd=tmp_path, capture_output=True, text=True
    )
    assert run.returncode == 0, run.stderr
    assert run.stdout.count("\n") >= len(found)
