"""Result tables: measures are rows and arms are columns, so that they fit a narrow terminal."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table
from rich.text import Text

NONE = "-"
Cell = Callable[[Mapping[str, Any]], str]


def number(value: float | None, form: str = ".3f") -> str:
    """A number, or a dash if there is none."""
    return NONE if value is None else f"{value:{form}}"


def span(interval: Sequence[float] | None, form: str = ".1f", scale: float = 1.0) -> str:
    """An interval as `low to high`."""
    if interval is None:
        return NONE
    return " to ".join(f"{scale * end:{form}}" for end in interval)


def show(
    title: str,
    columns: Mapping[str, Mapping[str, Any]],
    rows: Sequence[tuple[str, Cell]],
    note: str,
) -> None:
    """Print a table on stdout: one column per name, one row per measure, and a note under it.

    Names break at underscores, which are shown as spaces.
    """
    table = Table(title=title, title_justify="left", box=SIMPLE_HEAD, pad_edge=False)
    table.add_column("", overflow="fold")
    for name in columns:
        table.add_column(Text(name.replace("_", " ")), justify="right", overflow="fold")
    for measure, cell in rows:
        table.add_row(Text(measure), *(Text(cell(column)) for column in columns.values()))
    console = Console(file=sys.stdout, highlight=False)
    console.print(table)
    console.print(Text(note), soft_wrap=True)
