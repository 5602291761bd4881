"""How a result is shown in a notebook: as text, table and figure."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Sequence
from html import escape
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.figure import Figure
_CELL = "text-align: {}; padding: .15rem .8rem .15rem 0; white-space: pre-wrap;"
_WIDEST = 36
"""Width of a figure [rem], where there is room: letters are as large as those of the notebook."""


def html(
    sentence: str,
    columns: Sequence[str],
    rows: Iterable[tuple[str, Sequence[str]]],
    figure: Figure | None,
    note: str = "",
) -> str:
    """HTML of a result, as `_repr_html_` returns it.

    Args:
        sentence: What came out.
        columns: Names of the columns of its table; none for no table.
        rows: Name and cells of each line.
        figure: Its picture, None for none.
        note: What the columns are, a line each.
    """
    parts = [f"<p><strong>{escape(sentence)}</strong></p>"]
    parts += [f"<p>{escape(note)}</p>".replace("\n", "<br>")] if note else []
    parts += [_table(columns, rows)] if columns else []
    parts += [_picture(figure, sentence)] if figure is not None else []
    return f"<div>{''.join(parts)}</div>"


def _table(columns: Sequence[str], rows: Iterable[tuple[str, Sequence[str]]]) -> str:
    """A table: the name of a line at the left, its cells at the right of their columns."""
    left, right = (f' style="{_CELL.format(side)}"' for side in ("left", "right"))
    heads = "".join(f"<th{right}>{escape(name)}</th>" for name in columns)
    lines = "".join(
        f"<tr><td{left}>{escape(name)}</td>"
        + "".join(f"<td{right}>{escape(cell)}</td>" for cell in cells)
        + "</tr>"
        for name, cells in rows
    )
    return f"<table><thead><tr><th></th>{heads}</tr></thead><tbody>{lines}</tbody></table>"


def _picture(figure: Figure, described: str) -> str:
    from antennate import figures  # slow to import

    data = base64.b64encode(figures.thumbnail(figure)).decode()
    return (
        f'<img alt="{escape(described)}" style="width: 100%; max-width: {_WIDEST}rem; '
        f'background: white" src="data:image/png;base64,{data}">'
    )
