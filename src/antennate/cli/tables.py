"""Result tables on stdout."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from antennate.studies.measures import Table, shown

Cell = Callable[[Mapping[str, Any]], str]
number = shown


def print_table(table: Table) -> None:
    """Print a table and its note; underscores of a name are shown as spaces, of a path not."""
    from rich.box import SIMPLE_HEAD  # slow to import
    from rich.console import Console
    from rich.table import Table as Drawn
    from rich.text import Text

    drawn = Drawn(title=table.title, title_justify="left", box=SIMPLE_HEAD, pad_edge=False)
    drawn.add_column("", overflow="fold")
    for name in table.columns:
        heading = name if ":" in name else name.replace("_", " ")
        drawn.add_column(Text(heading), justify="right", overflow="fold")
    for name, cells in table.rows:
        drawn.add_row(Text(name), *(Text(cell) for cell in cells))
    console = Console(file=sys.stdout, highlight=False)
    console.print(drawn)
    if table.note:
        console.print(Text(table.note), soft_wrap=True)
        console.print()


def show(
    title: str,
    columns: Mapping[str, Mapping[str, Any]],
    rows: Sequence[tuple[str, Cell]],
    note: str,
) -> None:
    """Print a table of a column per name and a row per cell function, and a note under it."""
    lines = [(name, [cell(column) for column in columns.values()]) for name, cell in rows]
    print_table(Table(title, list(columns), lines, note.rstrip("\n")))
