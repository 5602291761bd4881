"""The files of one log: a new one is begun whenever the process that keeps it dies."""

from __future__ import annotations

import re
from pathlib import Path

MOST_PARTS = 10
"""Files that one log can have."""


def log_name(name: str) -> str:
    """File of the log of a simulated trial or walk with a name of any characters."""
    return re.sub(r"[^\w.-]", "_", name) + ".mcap"


def part(path: Path, number: int) -> Path:
    """The n-th file of a log, 1 the first: `drive.mcap`, then `drive-2.mcap` beside it."""
    return path if number == 1 else path.with_name(f"{path.stem}-{number}{path.suffix}")


def parts(path: Path) -> tuple[Path, ...]:
    """The first file and those that continue it; one that was never begun is left out."""
    following = (part(path, number) for number in range(2, MOST_PARTS + 1))
    return (path, *(each for each in following if each.exists()))
