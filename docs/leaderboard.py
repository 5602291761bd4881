"""Write the board of docs/leaderboard.md from docs/leaderboard.csv; with --check only compare it.

The table holds the rows of one run or more of `antennate compete`: `python docs/leaderboard.py
runs/*/trials.csv` joins theirs first. What stands outside of the two marks is written by hand.
Without --check it draws the figures, too.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

from generated import finish

from antennate.errors import ConfigError
from antennate.studies.formats import to_csv
from antennate_lab.compete.checking import read_rows
from antennate_lab.compete.config import CompeteConfig
from antennate_lab.compete.episodes import EpisodeRow
from antennate_lab.compete.page import apart, markdown, sentence
from antennate_lab.compete.result import Standing
from antennate_lab.compete.standings import standing

HERE = Path(__file__).parent
ROWS = Path(__file__).with_suffix(".csv")
BEGIN, END = "<!-- board: python docs/leaderboard.py -->", "<!-- end of board -->"
WHOLE = 100
"""Draws of each scene that a board needs; with fewer it is preliminary."""


def board(rows: Sequence[EpisodeRow], result: Standing) -> str:
    """What stands between the marks."""
    counts = [cell.episodes for cells in result.scenes.values() for cell in cells.values()]
    kinds = {
        name: ", ".join(sorted({getattr(row, name) for row in rows}))
        for name in ("version", "engine", "processor")
    }
    least, most = min(counts), max(counts)
    draws = f"{least}" if least == most else f"{least} to {most}"
    parts = []
    if least < WHOLE:
        parts.append(
            f"**Preliminary**: {draws} draw{'s' * (most > 1)} of each scene and controller, where "
            f"a board has {WHOLE}."
        )
    parts += [
        sentence(result),
        apart(result),
        markdown(result),
        f"{len(rows)} episodes of antennate {kinds['version']}, MuJoCo "
        f"{kinds['engine']}, {kinds['processor']}. Every row is in `docs/leaderboard.csv`.",
    ]
    return "\n\n".join(parts)


def joined(paths: Sequence[str]) -> str:
    """The table of several runs, controller by controller and scene by scene.

    Raises:
        ConfigError: They are of several versions or engines, or have a draw twice.
    """
    rows = [row for path in paths for row in read_rows(Path(path))]
    for name in ("version", "engine"):
        if len(kinds := {getattr(row, name) for row in rows}) > 1:
            raise ConfigError(f"expected tables of one {name}, found {', '.join(sorted(kinds))}")
    if len({(row.controller, row.scene, row.seed, row.trial) for row in rows}) < len(rows):
        raise ConfigError("expected each draw once a controller, found one in two tables")
    names, scenes = (
        list(dict.fromkeys(getattr(r, n) for r in rows)) for n in ("controller", "scene")
    )
    rows.sort(key=lambda r: (names.index(r.controller), scenes.index(r.scene), r.seed, r.trial))
    return to_csv(asdict(row) for row in rows)


def main() -> None:
    """Write the page and the figures, or compare the page."""
    paths = [word for word in sys.argv[1:] if not word.startswith("-")]
    if paths and "--check" in sys.argv[1:]:
        sys.exit("expected --check or tables to join, found both")
    page = Path(__file__).with_suffix(".md").read_text(encoding="utf-8")
    before, begin, rest = page.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not (begin and end):
        sys.exit(f"leaderboard.md: expected the lines {BEGIN} and {END}")
    if paths:
        try:
            table = joined(paths)
        except ConfigError as error:
            sys.exit(str(error))
        ROWS.write_text(table, encoding="utf-8")
    rows = read_rows(ROWS)
    result = standing(rows, CompeteConfig().tie)
    text = f"{before}{BEGIN}\n{board(rows, result)}\n{END}{after}"
    if "--check" not in sys.argv[1:]:
        from antennate.figures import render
        from antennate_lab.compete.figure import drawn

        for name, figure in drawn(result, rows).items():
            (HERE / "images" / f"leaderboard-{name}.png").write_bytes(render(figure)["png"])
    finish(__file__, text, name="leaderboard.md")


if __name__ == "__main__":
    main()
