"""docs/api.md: its snippets run as they stand, one after the other."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]


def snippets(page: Path) -> list[str]:
    return re.findall(r"^```python\n(.*?)^```$", page.read_text(), re.MULTILINE | re.DOTALL)


def test_the_snippets_run(tmp_path: Path) -> None:
    found = snippets(ROOT / "docs" / "api.md")
    assert len(found) >= 5
    script = tmp_path / "page.py"
    script.write_text("\n".join(found))
    run = subprocess.run(
        [sys.executable, "-W", "error", str(script)], cwd=tmp_path, capture_output=True, text=True
    )
    assert run.returncode == 0, run.stderr
    assert run.stdout.count("\n") >= len(found)
