"""Rows of checks as a table, and under it what to do."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import IO

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table
from rich.text import Text

from antennate.hardware.doctor.check import Row
from antennate.messages import one_line

_STYLES = {"ok": "green", "warn": "yellow", "bad": "bold red"}


def show_rows(rows: Sequence[Row], file: IO[str] | None = None) -> None:
    """Print one line for each row, then the cures; on stdout unless told otherwise."""
    console = Console(file=file or sys.stdout, highlight=False)
    table = Table(box=SIMPLE_HEAD, pad_edge=False)
    for head in ("", "check", "expected", "found"):
        table.add_column(head, overflow="fold", no_wrap=not head)
    for row in rows:
        grade = Text(row.grade, _STYLES[row.grade])
        words = (f"{row.part}: {row.check}", row.expected, row.found)
        table.add_row(grade, *(Text(one_line(word)) for word in words))
    console.print(table)
    wrong = [row for row in rows if row.grade != "ok"]
    for row in sorted(wrong, key=lambda row: row.grade == "warn"):
        line = Text.assemble(
            (f"{row.grade:<4} ", _STYLES[row.grade]),
            (f"{row.part}: {row.check}: ", "bold"),
            one_line(row.cure),
        )
        console.print(line, soft_wrap=True)
    bad = sum(row.grade == "bad" for row in wrong)
    console.print(Text(_sentence(len(rows), bad, len(wrong) - bad)), soft_wrap=True)


def _sentence(checks: int, bad: int, warnings: int) -> str:
    """What came out, in one sentence."""
    if bad:
        return (
            f"The robot must not be driven yet: {bad} of {checks} checks are bad, {warnings} warn."
        )
    if warnings:
        return f"The robot may be driven: no check is bad, {warnings} of {checks} warn."
    return f"The robot may be driven: all {checks} checks are good."
